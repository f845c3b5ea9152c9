"""A minute of the soak of `tests/bench/bench_soak.py`: answers are as expected, no job is lost, nothing is left."""

from pathlib import Path

import pytest

from tests.packages import reason

pytest.importorskip("dbos", reason=reason("dbos"))
pytest.importorskip("fastapi", reason=reason("fastapi"))

from tests.bench.bench_soak import check, run_soak
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


def test_a_short_soak_loses_nothing_and_leaves_nothing_behind(request: pytest.FixtureRequest) -> None:
    try:
        postgres: Postgres | None = request.getfixturevalue("postgres")
    except pytest.skip.Exception:
        postgres = None  # a SQLite file, which is never away
    report = run_soak(N_REQUESTS, n_warm=N_WARM, postgres=postgres, away_s=AWAY_S)
    check(report)
    grown = {name: after - before for name, before, after in report.rows()}
    assert {name: more for name, more in grown.items() if more > MOST_GROWTH[name]} == {}
