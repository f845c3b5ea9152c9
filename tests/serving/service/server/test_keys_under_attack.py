"""Five minutes of `tests/bench/bench_keys.py`: what three keys meet while a fourth one attacks."""

import pytest

from tests.bench.bench_keys import KINDS, MOST_PROCESSES_MB, MOST_RATIO, MOST_SERVER_MB, TARGETS_S, Finding, run_keys

MINUTES = 5.0


@pytest.fixture(scope="module")
def findings() -> list[Finding]:
    return run_keys(MINUTES)


@pytest.mark.nightly
def test_each_key_is_answered_whatever_another_one_does(findings: list[Finding]) -> None:
    for found in findings:
        assert not found.under.refused, found.attack
        assert min(len(found.under.seconds[kind]) for kind in KINDS) > 0, found.attack


@pytest.mark.nightly
def test_a_key_waits_no_longer_than_in_its_share(findings: list[Finding]) -> None:
    """First bytes take twice as long at most, or no longer than they may on two cores with nothing else."""
    slow = {
        (found.attack, kind): (found.without.p(kind, 95), found.under.p(kind, 95))
        for found in findings for kind in KINDS
        if found.ratio(kind) > MOST_RATIO and found.under.p(kind, 95) > TARGETS_S[kind]
    }  # fmt: skip
    assert slow == {}


@pytest.mark.nightly
def test_an_attack_takes_no_more_memory_than_there_is(findings: list[Finding]) -> None:
    large = {
        found.attack: (found.server_mb, found.processes_mb)
        for found in findings if found.server_mb > MOST_SERVER_MB or found.processes_mb > MOST_PROCESSES_MB
    }  # fmt: skip
    assert large == {}
