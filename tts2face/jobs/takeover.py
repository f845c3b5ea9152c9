"""Return of the work of dead workers to the queue, and how often workers look at it."""

from typing import Any

from tts2face.jobs.database import APPLICATION_VERSION, JOB_WORKFLOW, WORKFLOW

POLL_S = 0.2  # between two looks at the queue
MAX_LOOKS_PER_S = 200.0  # of all workers together: with more than 40, each looks less often


def poll_interval(n_workers: int) -> float:
    """Seconds between two looks of a worker at the queue, for a number of workers."""
    return max(POLL_S, n_workers / MAX_LOOKS_PER_S)


def return_work(executor_ids: set[str]) -> set[str]:
    """Return the running work of executors to the queue; the executors that have none left.

    The engine has no public function that does so safely: `resume_workflows` has no condition on the owner, so that it
    would take work from a worker that has just taken it over, and it sets the number of tries to zero, so that a
    segment that ends every worker would never fail (decision 083).
    """
    from dbos import DBOS

    names = sorted(executor_ids)
    DBOS._recover_pending_workflows(names)
    return executor_ids - {str(one.executor_id) for one in list_running(names)}


def list_running(executor_ids: list[str] | None = None) -> list[Any]:
    """Running jobs of this version, of some executors or all."""
    from dbos import DBOS

    found: list[Any] = DBOS.list_workflows(
        status="PENDING",
        name=[WORKFLOW, JOB_WORKFLOW],
        app_version=APPLICATION_VERSION,
        executor_id=executor_ids,
        load_input=False,
        load_output=False,
    )
    return found


def is_cancelled(name: str) -> bool:
    """Whether a job of the queue was cancelled."""
    from dbos import DBOS

    found = DBOS.list_workflows(workflow_ids=[name], load_input=False, load_output=False)
    return any(one.status == "CANCELLED" for one in found)
