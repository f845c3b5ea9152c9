"""Return of the work of dead workers to the queue.

DBOS keeps the queue. Its open-source package has no fail-over of its own: work of an executor that died waits for an
executor of the same id. Here every worker has a new id and sends heartbeats (`Workers`); with each of them it learns
which workers have sent none for some time, and returns their work to the queue. A worker is forgotten only when none of
its work is running any more. A segment that two workers take nevertheless is rendered twice and stored once, as its
name is its content address.
"""

from typing import Any

from tts2face.serving.work.queues import APPLICATION_VERSION, JOB_WORKFLOW, WORKFLOW


def return_work(executor_ids: set[str]) -> set[str]:
    """Return the running work of executors to the queue; the executors that have none left.

    The engine has no public function that does so safely: `resume_workflows` has no condition on the owner, so that it
    would take work from a worker that has just taken it over, and it sets the number of tries to zero, so that a
    segment that ends every worker would never fail (decision 083).
    """
    from dbos import DBOS

    names = sorted(executor_ids)
    DBOS._recover_pending_workflows(names)
    return executor_ids - {str(job.executor_id) for job in list_running(names)}


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
