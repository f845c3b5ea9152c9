"""The published fields against the paper's formula in plain Python: Ju and Lee 2008, section 5.1."""

import numpy as np
import pytest

from tts2face.gestures.field import Field, FieldState, build_field, initial_state, sample_field_moments
from tts2face.gestures.stream import FIELD_OPTIONS, JU_2008
from tts2face.models.palette import FEATURES

N, LENGTH, N_SHOWN = 12, 60, 200
H = 10  # preceding frames
N_BEST = 4  # "a small number (2 to 4 in our experiments) of good candidates"
MOMENTS = np.array([moment for moment in range(N * LENGTH) if moment % LENGTH >= H])
BEFORE = MOMENTS[:, None] - H + np.arange(H)  # the h frames before each in its recording


def recordings(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smooth motion (T, 2), its sound (T, 1), and the lengths of the recordings."""
    generator = np.random.default_rng(seed)
    steps = generator.normal(size=(3, N * LENGTH))
    smooth = np.stack([np.convolve(row, np.hanning(9), "same") for row in steps], axis=1).astype(np.float32)
    return smooth[:, :2], smooth[:, 2:], np.full(N, LENGTH, np.int32)


def distances(made: Field, shown: np.ndarray, loudness: np.ndarray) -> dict[int, float]:
    """dist(t, t') of every recorded frame with h frames before it in its recording; alpha is in `heard` already."""
    of_sound = np.square(loudness.astype(float) - made.prosody[BEFORE]).sum(axis=(1, 2))
    of_motion = np.square(shown.astype(float) - made.values[BEFORE]).sum(axis=(1, 2))
    return dict(zip(MOMENTS.tolist(), (of_sound + of_motion).tolist(), strict=True))


def draw_frame(away: dict[int, float], sigma: float, chance: float) -> int:
    """One of the best candidates, with a probability proportional to exp(-dist / sigma)."""
    best = sorted(away, key=lambda moment: away[moment])[:N_BEST]
    weights = np.exp(-(np.array([away[moment] for moment in best]) - away[best[0]]) / sigma)
    passed = np.cumsum(weights) / weights.sum()
    return best[int(np.searchsorted(passed, chance, side="right"))]


def test_the_preset_is_what_the_paper_prints() -> None:
    assert JU_2008.history == H
    assert 2 <= JU_2008.candidates <= 4
    assert (JU_2008.stride, JU_2008.continuity, JU_2008.memory) == (1, 1.0, 0)
    assert (JU_2008.settle_s, JU_2008.apart, JU_2008.search_error) == (0.0, 1, 1.0)
    assert set(FIELD_OPTIONS["ju2008"]) == set(FEATURES)


@pytest.mark.parametrize("seed", range(3))
def test_every_frame_follows_the_formula(seed: int) -> None:
    values, loudness, lengths = recordings(seed)
    made = build_field(values, loudness, lengths, JU_2008)
    generator = np.random.default_rng(50 + seed)
    sound = np.convolve(generator.normal(size=N_SHOWN), np.hanning(9), "same").astype(np.float32)[:, None]
    chances = generator.random(N_SHOWN)
    state = initial_state(made, 0.4)
    walk = sample_field_moments(made, state, sound, chances)
    shown, driving = list(state.motion), [*state.prosody, *(sound * made.weights)]
    expected = []
    for frame in range(N_SHOWN):
        away = distances(made, np.array(shown[-H:]), np.array(driving[frame : frame + H]))
        moment = draw_frame(away, H * JU_2008.sigma * made.median_distance, chances[frame])
        expected.append(moment)
        shown.append(made.values[moment])
    assert walk.moments.tolist() == expected
    np.testing.assert_array_equal(walk.values, made.values[expected] * np.float32(made.scale))
    assert (np.diff(expected) != 1).sum() > N_SHOWN / 20  # leaps are among them


def test_sound_and_motion_weigh_alike() -> None:
    """alpha is 1 in units of variance: the windows' two terms have the same mean."""
    values, loudness, lengths = recordings(4)
    made = build_field(values, loudness, lengths, JU_2008)
    assert np.square(made.prosody - made.prosody.mean(axis=0)).sum(axis=1).mean() == pytest.approx(1.0, rel=1e-3)
    assert np.square(made.values - made.values.mean(axis=0)).sum(axis=1).mean() == pytest.approx(1.0, rel=1e-3)


def test_candidates_come_with_the_frequencies_of_the_formula() -> None:
    values, loudness, lengths = recordings(5)
    made = build_field(values, loudness, lengths, JU_2008)
    start = initial_state(made, 0.0)
    state = FieldState(
        np.zeros_like(start.motion), np.zeros_like(start.prosody), -1, start.offset, start.recent_jumps, 0
    )
    away = distances(made, state.motion, state.prosody)
    best = sorted(away, key=lambda moment: away[moment])[:N_BEST]
    weights = np.exp(
        -np.array([away[moment] - away[best[0]] for moment in best]) / (H * JU_2008.sigma * made.median_distance)
    )
    chances = (np.arange(2000) + 0.5) / 2000
    found = [
        int(sample_field_moments(made, state, np.zeros((1, 1), np.float32), chances[i : i + 1]).moments[0])
        for i in range(2000)
    ]
    assert set(found) <= set(best)
    shares = [found.count(moment) / 2000 for moment in best]
    np.testing.assert_allclose(shares, weights / weights.sum(), atol=2 / 2000)
