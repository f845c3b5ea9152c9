"""Some seconds and, nightly, a minute of the soak of `tests/bench/bench_soak.py`.

Answers are as expected, no job is lost, nothing is left.
"""

from pathlib import Path

import pytest

from tests.packages import reason

pytest.importorskip("dbos", reason=reason("dbos"))
pytest.importorskip("fastapi", reason=reason("fastapi"))

from tests.bench.bench_soak import Report, check, run_soak
from tests.bench.soak_traffic import KINDS
from tests.serving.work.conftest import Postgres

pytestmark = pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs /proc")
N_WARM, N_REQUESTS = 40, 60
AWAY_S = 10.0  # several tries of the worker and of the server to reach the database
# Pools of threads and of connections grow to their sizes once; a thread or a descriptor of each client that leaves are
# 16 and more. Allocators keep some memory, and a synthesis process that was started again and has made movies has
# up to 180 MB more; the pictures of one clip whose client leaves are 60 MB.
MOST_GROWTH = {
    "server_bytes": 30.0, "process_bytes": 300.0, "n_threads": 12, "n_descriptors": 12, "n_processes": 0,
    "n_temporary": 0,
}  # fmt: skip


def assert_nothing_is_left(report: Report) -> None:
    """Answers and jobs are as expected, and what the server holds has not grown."""
    check(report)
    grown = {name: after - before for name, before, after in report.rows()}
    assert {name: more for name, more in grown.items() if more > MOST_GROWTH[name]} == {}


@pytest.mark.nightly
def test_a_soak_loses_nothing_and_leaves_nothing_behind(request: pytest.FixtureRequest) -> None:
    """With all attacks."""
    try:
        postgres: Postgres | None = request.getfixturevalue("postgres")
    except pytest.skip.Exception:
        postgres = None  # a SQLite file, which is never away
    assert_nothing_is_left(run_soak(N_REQUESTS, n_warm=N_WARM, postgres=postgres, away_s=AWAY_S))


def test_a_short_soak_loses_nothing_and_leaves_nothing_behind() -> None:
    """Requests of each kind while a synthesis process and a worker are killed."""
    attacks = ("synthesis processes", "worker")
    assert_nothing_is_left(run_soak(3 * len(KINDS), n_warm=2 * len(KINDS), postgres=None, attacks=attacks))
