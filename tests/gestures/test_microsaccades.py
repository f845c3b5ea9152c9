"""Micro-saccades of resting eyes."""

import numpy as np

from tts2face.gestures.gaze import microsaccades


def test_one_to_two_jumps_a_second_below_a_degree() -> None:
    times = np.arange(0, 300, 1 / 100)
    found = np.degrees(microsaccades(times, 3))
    jumps = np.linalg.norm(np.diff(found, axis=0), axis=1)
    jumps = jumps[jumps > 0.02]
    assert 0.8 < len(jumps) / 300 < 2.0
    assert 0.15 < np.median(jumps) < 0.6
    assert np.quantile(jumps, 0.95) < 1.0
    assert found[:, 1].std() > 1.5 * found[:, 0].std()
    assert np.abs(found.mean(axis=0)).max() < 0.05


def test_pieces_of_a_clip_are_those_of_the_whole() -> None:
    times = np.arange(0, 20, 1 / 25)
    whole = microsaccades(times, 7)
    for parts in (2, 7, 100):
        np.testing.assert_array_equal(
            np.concatenate([microsaccades(part, 7) for part in np.array_split(times, parts)]), whole
        )
    assert np.abs(whole - microsaccades(times, 8)).max() > 1e-3
    assert microsaccades(times[:0], 7).shape == (0, 2)
