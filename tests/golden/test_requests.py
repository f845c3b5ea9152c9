"""Motion, sound, pictures and files of twenty requests stay as they were, to the byte where the machine is the same."""

import copy

import pytest

from tests.golden.doors import NEEDS
from tests.golden.fingerprints import differences, environment, is_here, read_machines, renewed
from tests.golden.requests import CLIPS, NAMES, fingerprint
from tests.packages import needs

RENEW = "a commit that changes results on purpose renews them: python -m tests.golden.requests"
MACHINES = read_machines()
LONG = ("character", "http_job", "batch", "realistic", "identity_transparent")  # to make; each has a shorter relative
THERE = {"environment": {"machine": "another"}}


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.build] * (name in LONG)) for name in NAMES])
def test_a_request_gives_what_it_gave(name: str) -> None:
    needs(*NEEDS.get(name, ()))
    known = sorted((one for one in MACHINES if name in one["requests"]), key=is_here)[-1]
    found = differences(fingerprint(name), known["requests"][name], is_same_machine=is_here(known))
    if found:
        pytest.fail("\n".join([f"{name} gives another result; {RENEW}", *found]), pytrace=False)


def test_the_requests_differ_from_each_other() -> None:
    assert len(NAMES) == 20
    assert {name for one in MACHINES for name in one["requests"]} == set(NAMES)
    for machine in MACHINES:
        motion = [known["motion"] for name, known in machine["requests"].items() if name in CLIPS]
        assert len(set(motion)) == len(motion)


def test_another_machine_may_differ_in_the_last_bits_only() -> None:
    known = next(one["requests"]["heart"] for one in MACHINES)
    assert differences(known, known, is_same_machine=True) == []
    louder = known | {"motion": "0", "means": [1.1 * mean for mean in known["means"]]}
    assert differences(louder, known, is_same_machine=True)[0].startswith("motion is 0, not")
    assert differences(louder, known, is_same_machine=False) == []
    wrong = known | {"means": [1.2 * mean for mean in known["means"]], "n_samples": 2 * known["n_samples"]}
    assert [one.split()[0] for one in differences(wrong, known, is_same_machine=False)] == ["n_samples", "means"]
    assert "inf" in differences(known | {"means": [1.0]}, known, is_same_machine=False)[0]


def test_a_changed_result_removes_the_records_of_other_machines() -> None:
    here = {"environment": environment(), "requests": {"a": {"motion": "1"}, "b": {"motion": "2"}}}
    there = THERE | {"requests": {"a": {"motion": "3"}, "b": {"motion": "4"}, "gone": {"motion": "5"}}}
    found = copy.deepcopy(here["requests"])
    found["b"]["motion"] = "6"
    assert renewed([there, here], found) == [here | {"requests": found}, THERE | {"requests": {"a": {"motion": "3"}}}]
    assert renewed([there], found)[1]["requests"].keys() == {"a", "b"}  # the first record of this machine
