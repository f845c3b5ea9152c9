"""Breaths, micro-saccades and pupils lie within what is published of people."""

import pytest

from corpus_tools.studies.gestures.body import measure_body


@pytest.mark.parametrize("seed", [0, 11])
def test_what_the_body_does_by_itself_is_within_published_ranges(seed: int) -> None:
    outside = [one for one in measure_body(seed) if not one.published[0] <= one.value <= one.published[1]]
    assert not outside
