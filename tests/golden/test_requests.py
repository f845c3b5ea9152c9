"""Motion, sound and pictures of twelve requests stay as they were, to the byte where the machine is the same."""

import json

import numpy as np
import pytest

from tests.golden.requests import GOLDEN, KEPT, environment, fingerprint

KNOWN = json.loads(KEPT.read_text(encoding="utf-8"))
MOTION_MEAN = 0.01  # weights: libraries and processors differ in the last bits, which a field's draw can amplify
SAMPLES = 0.02  # share: voices of other versions speak a little longer or shorter


@pytest.mark.parametrize("name", GOLDEN)
def test_a_request_gives_what_it_gave(name: str) -> None:
    found, known = fingerprint(GOLDEN[name]), KNOWN["requests"][name]
    if environment() == KNOWN["environment"]:
        assert found == known
        return
    assert found["n_samples"] == pytest.approx(known["n_samples"], rel=SAMPLES)
    assert len(found["motion_mean"]) == len(known["motion_mean"])
    assert np.abs(np.subtract(found["motion_mean"], known["motion_mean"])).mean() < MOTION_MEAN


def test_the_requests_differ_from_each_other() -> None:
    assert set(GOLDEN) == set(KNOWN["requests"])
    assert len({known["motion"] for known in KNOWN["requests"].values()}) == len(GOLDEN)
