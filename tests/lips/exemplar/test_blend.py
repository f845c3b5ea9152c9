"""Averages, joins, smoothing and contacts of chosen exemplars."""

from dataclasses import replace

import numpy as np
import pytest

from tts2face.lips.blending import AveragedTokens, average_tokens, exemplar_weights, gaussian_smooth, join_averages
from tts2face.lips.contacts import (
    CONTACT_RULES,
    ChosenExemplars,
    ContactRule,
    Contacts,
    LipGap,
    contact_rule,
    enforce_contacts,
    find_contacts,
    shown_contact,
)
from tts2face.lips.exemplar import ExemplarModel
from tts2face.lips.options import THEOBALD_2007, SynthesisOptions
from tts2face.lips.targets import Targets
from tts2face.lips.tokens import spans_with_reach

GAP = LipGap.with_spread(np.zeros(3, np.float32), np.array([[0.0, 1.0, 0.0]], np.float32), np.ones(1))


def targets(*edges):
    starts, ends = np.array(edges[:-1]), np.array(edges[1:])
    return Targets(("x",) * len(starts), spans_with_reach(starts, ends), np.arange(len(starts)))


def test_weights_fall_with_the_score_and_sum_to_one():
    weights = exemplar_weights(np.array([[2.0, 1.0, -np.inf]]), 1.0)
    np.testing.assert_allclose(weights, [[1 / (1 + np.exp(-1)), np.exp(-1) / (1 + np.exp(-1)), 0.0]], rtol=1e-12)
    np.testing.assert_allclose(exemplar_weights(np.array([[2.0, 1.0, -np.inf]]), 0.0), [[0.5, 0.5, 0.0]])


def test_the_average_of_one_token_is_its_own_motion(voice: ExemplarModel):
    options = SynthesisOptions(overlap=False)
    pieces = average_tokens(voice.tokens, np.array([[30]], np.int32), np.array([[1.0]]), voice.spread, options)
    start, end = voice.tokens.spans[30, 1:3] * voice.tokens.fps
    first = voice.tokens.first_frame[voice.tokens.utterance[30]]
    knots = np.linspace(start, end, pieces.mean.shape[1])
    frames = voice.tokens.frames[first : first + 60]
    straight = np.stack([np.interp(knots, np.arange(60), frames[:, d]) for d in range(2)], axis=1)
    np.testing.assert_allclose(pieces.mean[0, :, :2] * voice.spread[:2], straight, atol=0.8)  # mm, cubic against lines
    assert pieces.variance.max() < 1e-6


def test_mean_and_variance_of_several_tokens(voice: ExemplarModel):
    options = SynthesisOptions(align=False)
    chosen = np.array([[30, 100, 200, -1]], np.int32)
    weights = np.array([[0.5, 0.3, 0.2, 0.0]])
    together = average_tokens(voice.tokens, chosen, weights, voice.spread, options)
    alone = np.concatenate(
        [
            average_tokens(voice.tokens, chosen[:, e : e + 1], np.ones((1, 1)), voice.spread, options).mean
            for e in range(3)
        ]
    )
    np.testing.assert_allclose(together.mean[0], np.average(alone, axis=0, weights=weights[0, :3]), atol=1e-5)
    np.testing.assert_allclose(
        together.variance[0], np.average((alone - together.mean) ** 2, axis=0, weights=weights[0, :3]), atol=1e-5
    )


def pieces_of(*values, knots=25):
    mean = np.tile(np.array(values, np.float32)[:, None, None], (1, knots, 1))
    return AveragedTokens(mean, np.zeros_like(mean))


def test_adjacent_pieces_keep_their_positions():
    joined, contacts_with = join_averages(pieces_of(1.0, 3.0, knots=9), targets(0.1, 0.2, 0.4), 60, THEOBALD_2007)
    assert contacts_with.nonzero()[0].tolist() == list(range(10, 41))
    np.testing.assert_allclose(joined[11:20, 0], 1.0)
    np.testing.assert_allclose(joined[21:41, 0], 3.0)
    assert (joined[~contacts_with] == 0).all()


def test_overlapping_pieces_hand_over_without_a_jump():
    joined, contacts_with = join_averages(
        pieces_of(0.0, 1.0), targets(0.0, 0.2, 0.4), 41, SynthesisOptions(precision=0.0)
    )
    assert contacts_with.all()
    steps = np.diff(joined[:, 0])
    assert (steps >= -1e-6).all()
    assert steps.max() < 0.06
    assert joined[20, 0] == pytest.approx(0.5, abs=0.01)  # at the shared edge both count alike


@pytest.mark.parametrize(
    ("options", "knots", "n_steps"), [(THEOBALD_2007, 9, 25), (SynthesisOptions(precision=0.0), 25, 75)]
)
def test_even_motion_stays_even_over_its_knots(options, knots, n_steps):
    """Knots lie evenly over the span of a piece, from its first instant to its last one."""
    ramp = np.linspace(0.0, 1.0, knots, dtype=np.float32)[None, :, None]
    joined, is_covered = join_averages(AveragedTokens(ramp, 0.0 * ramp), targets(0.5, 0.75), 121, options)
    covered = joined[is_covered, 0]
    assert len(covered) == n_steps + 1
    np.testing.assert_allclose(covered, np.linspace(0.0, 1.0, n_steps + 1), atol=1e-5)


def test_the_surer_piece_wins_where_they_overlap():
    even = pieces_of(0.0, 1.0)
    unsure = AveragedTokens(even.mean, np.where(even.mean == 0, 1.0, 0.0).astype(np.float32))
    joined, _ = join_averages(unsure, targets(0.0, 0.2, 0.4), 41, SynthesisOptions(precision=1.5))
    assert joined[20, 0] > 0.95


def test_smoothing_is_a_gaussian_in_seconds():
    pulse = np.zeros((201, 1))
    pulse[100] = 1.0
    made = gaussian_smooth(pulse, 0.05, 100.0)[:, 0]
    times = (np.arange(201) - 100) / 100
    gauss = np.exp(-(times**2) / (2 * 0.05**2))
    np.testing.assert_allclose(made, gauss / gauss.sum(), atol=2e-5)  # the kernel ends at four sigma
    np.testing.assert_allclose(gaussian_smooth(np.full((30, 2), 3.0), 0.05, 100.0), 3.0, rtol=1e-6)  # edges do not sag
    assert gaussian_smooth(pulse, 0.0, 100.0)[100, 0] == 1.0


def test_phones_with_lip_contact_are_found():
    assert [contact_rule(label) for label in ("p", "b", "m")] == [CONTACT_RULES["bilabial"]] * 3
    assert [contact_rule(label) for label in ("f", "v")] == [CONTACT_RULES["labiodental"]] * 2
    assert not any(contact_rule(label) for label in ("w", "t", "u", "ɹ", "sil"))


def test_a_contact_closes_lips_that_averaging_opened():
    values = np.full((100, 1), 4.0, np.float32)
    values[45:56, 0] = 2.0
    contact = Contacts(np.array([[0.46, 0.54]]), np.array([[0.0, 0.1, 0.0]], np.float32), np.array([0.1], np.float32))
    kept = enforce_contacts(values, contact, GAP, 100.0)
    low = int(kept[:, 0].argmin())
    assert 43 <= low <= 57
    np.testing.assert_allclose(kept[low, 0], 0.1, atol=1e-6)
    assert (kept[:35] == values[:35]).all()
    assert (kept[65:] == values[65:]).all()
    assert (kept <= values + 1e-6).all()


def test_a_closed_contact_is_not_changed():
    values = np.full((100, 1), 0.05, np.float32)
    contact = Contacts(np.array([[0.46, 0.54]]), np.array([[0.0, 0.1, 0.0]], np.float32), np.array([0.1], np.float32))
    assert (enforce_contacts(values, contact, GAP, 100.0) == values).all()
    beyond = replace(contact, spans=np.array([[5.0, 5.1]]), enough=np.zeros(1, np.float32))
    assert (enforce_contacts(values + 1, beyond, GAP, 100.0) == values + 1).all()
    lenient = replace(contact, enough=np.array([1.1], np.float32))
    assert (enforce_contacts(values + 1, lenient, GAP, 100.0) == values + 1).all()


def test_a_contact_changes_the_gap_by_the_least_motion_and_nothing_else():
    """Closed form for one axis: the change along ``spread**2 * basis`` that closes the gap; oracle: random changes."""
    stream = np.random.default_rng(3)
    basis, spread = stream.normal(size=(4, 3)), np.array([2.0, 1.0, 0.5, 0.2])
    basis[:, ::2] = 0.0
    gap = LipGap.with_spread(np.zeros(3, np.float32), basis.astype(np.float32), spread)
    values = np.tile(stream.normal(size=4).astype(np.float32), (100, 1))
    contact = Contacts(np.array([[0.46, 0.54]]), np.zeros((1, 3), np.float32), np.zeros(1, np.float32))
    moved = (enforce_contacts(values, contact, gap, 100.0) - values).astype(np.float64)
    at = int(np.abs(moved[:, 0]).argmax())
    axis = basis[:, 1]
    np.testing.assert_allclose(moved[at], -(values[0] @ axis) / (spread**2 @ axis**2) * spread**2 * axis, atol=1e-5)
    for _ in range(20):  # any other change that closes the gap is larger in units of the spread
        other = stream.normal(size=4)
        other += (moved[at] - other) @ axis / (axis @ axis) * axis
        assert np.linalg.norm(other / spread) > np.linalg.norm(moved[at] / spread)


def test_directions_in_which_lips_hardly_move_are_not_corrected():
    """Sideways a parameter moves the gap by 0.05 mm, in height another one by 1 mm."""
    basis = np.array([[0.05, 0.0, 0.0], [0.0, 1.0, 0.0]], np.float32)
    gap = LipGap.with_spread(np.array([0.3, 0.0, 0.0], np.float32), basis, np.ones(2))
    values = np.tile(np.array([0.5, 2.0], np.float32), (100, 1))
    contact = Contacts(np.array([[0.46, 0.54]]), np.zeros((1, 3), np.float32), np.zeros(1, np.float32))
    kept = enforce_contacts(values, contact, gap, 100.0)
    assert (kept[:, 0] == values[:, 0]).all()
    np.testing.assert_allclose(kept[:, 1].min(), 0.0, atol=1e-6)


def test_a_replaced_phone_has_only_contacts_of_its_own_kind():
    assert shown_contact("m", "b") is CONTACT_RULES["bilabial"]
    assert shown_contact("v", "f") is CONTACT_RULES["labiodental"]
    assert shown_contact("pf", "p") is CONTACT_RULES["bilabial"]
    assert shown_contact("f", "p") is None
    assert shown_contact("t", "p") is None


def test_gaps_are_taken_where_each_token_is_closest(voice: ExemplarModel):
    """Two p tokens, and one that never closes: the gap is that of the weighted mean of the closed ones."""
    label = voice.tokens.inventory.index("p")
    p = np.flatnonzero(voice.tokens.phone == label)[:2]
    open_one = np.flatnonzero(voice.tokens.phone == voice.tokens.inventory.index("ɑ"))[0]
    chosen = np.array([[open_one, *p]], np.int32)
    exemplars = ChosenExemplars(voice.tokens, chosen, np.array([[0.2, 0.4, 0.4]]))

    def contacts_with(enough: float) -> Contacts:
        return find_contacts(exemplars, voice.lip_gap, np.array([[0.0, 0.1]]), [ContactRule(0.7, enough)])

    least, frames = [], voice.tokens.frames
    for token in (*p, open_one):
        first, last = voice.tokens.first_frame[voice.tokens.utterance[token] :][:2]
        times = np.arange(last - first) / voice.tokens.fps
        near = (times >= voice.tokens.spans[token, 1] - 0.03) & (times <= voice.tokens.spans[token, 2] + 0.03)
        least.append(np.abs(frames[first:last][near, 0]).min())
    mean = np.zeros((1, frames.shape[1]), np.float32)
    mean[0, 0] = np.mean(least[:2])
    np.testing.assert_allclose(contacts_with(0.0).gaps, voice.lip_gap.vectors(mean), atol=1e-5)
    assert contacts_with(0.7).enough[0] == pytest.approx(max(least[:2]), abs=1e-5)
    assert contacts_with(0.9).enough[0] == pytest.approx(least[2], abs=1e-5)
