"""Maps from a base to a person: known maps are found, and networks and audio maps give what the map gives."""

from itertools import pairwise

import numpy as np
import pytest

from corpus_tools.training.adapt_talker import lip_gain
from corpus_tools.training.base_map import N_OFFSETS, BaseMap, FrameTerms, fit_base_map, frame_terms
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.audio_map import AudioMap
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.phone_network import N_PHONES_SEEN, N_PLACE, PhoneNetwork
from tts2face.models.talker import ShapeModel

INVENTORY = ("a", "b", "i", SILENCE, "ʃ")
PHONES = PhoneSequence([SILENCE, "a", "ʃ", "i", "b", SILENCE], [0.0, 0.3, 0.5, 0.6, 0.8, 0.9, 1.2])
TIMES = np.arange(30) / 25
PRIOR = BaseMap(INVENTORY, np.eye(2, 3), np.zeros(2), np.zeros((N_OFFSETS, len(INVENTORY), 2)))
UNIT = (np.ones(3), np.ones(2))


def made_map(seed: int = 0, n_base: int = 3, n_own: int = 2) -> BaseMap:
    rng = np.random.default_rng(seed)
    window = 0.3 * rng.normal(size=(N_OFFSETS, len(INVENTORY), n_own))
    return BaseMap(INVENTORY, rng.normal(size=(n_own, n_base)), rng.normal(size=n_own), window)


def made_network(inventory: tuple[str, ...], seed: int = 1, n_outputs: int = 3) -> PhoneNetwork:
    rng = np.random.default_rng(seed)
    sizes = (N_PHONES_SEEN * len(inventory) + N_PLACE, 7, 6, n_outputs)
    weights = tuple(rng.normal(size=(2, *pair)).astype(np.float32) for pair in pairwise(sizes))
    biases = tuple(rng.normal(size=(2, size)).astype(np.float32) for size in sizes[1:])
    return PhoneNetwork(inventory, weights, biases)


@pytest.mark.parametrize("known", [INVENTORY, ("a", "b", "s", SILENCE)])
def test_a_mapped_network_gives_the_mapped_output(known: tuple[str, ...]) -> None:
    """The second network knows neither i nor ʃ: they are a and s to it, and themselves to the map."""
    network, mapped = made_network(known), made_map()
    plain = network.parameters(PHONES, TIMES)
    expected = mapped.parameters(frame_terms(PHONES, TIMES, INVENTORY, plain))
    assert mapped.network(network).parameters(PHONES, TIMES) == pytest.approx(expected, abs=1e-4)


def test_a_mapped_audio_map_gives_the_mapped_output() -> None:
    rng = np.random.default_rng(2)
    parts = [rng.normal(size=size).astype(np.float32) for size in (4, (5, 12), (6, 5), (3, 6), 5, 6, 3)]
    plain = AudioMap("formants", 1, 1, parts[0], np.ones(4, np.float32), tuple(parts[1:4]), tuple(parts[4:]), "tanh")
    mapped, features = made_map(), rng.normal(size=(9, 4))
    expected = plain.parameters(features) @ mapped.matrix.T + mapped.offset
    assert mapped.audio_map(plain).parameters(features) == pytest.approx(expected, abs=1e-5)


def many_frames(n: int = 4000) -> FrameTerms:
    rng = np.random.default_rng(3)
    labels = rng.integers(0, len(INVENTORY), (n // 5 + N_OFFSETS,)).repeat(5)
    windows = np.lib.stride_tricks.sliding_window_view(labels, N_OFFSETS)[:n]
    return FrameTerms(windows.copy(), rng.normal(size=(n, 3)), np.arange(n) // 80)


def test_a_linear_relation_is_found_from_much_material() -> None:
    """1 %: of 4000 frames with a ridge penalty of 1."""
    terms, matrix = many_frames(), np.array([[0.5, -0.2, 0.1], [0.3, 1.2, 0.0]])
    targets = terms.base @ matrix.T + np.array([3.0, -1.0])
    found = fit_base_map(terms, targets, PRIOR, UNIT, trust=1.0, penalty=1.0)
    assert found.matrix == pytest.approx(matrix, abs=0.01)
    assert found.parameters(terms) == pytest.approx(targets, abs=0.02)


def test_without_evidence_the_prior_is_kept_with_the_mean_pose_of_the_person() -> None:
    terms = many_frames()
    targets = terms.base @ np.array([[0.5, -0.2, 0.1], [0.3, 1.2, 0.0]]).T + 2.0
    found = fit_base_map(terms, targets, PRIOR, UNIT, trust=1.0, penalty=1e12)
    assert found.matrix == pytest.approx(PRIOR.matrix, abs=1e-6)
    assert found.parameters(terms).mean(axis=0) == pytest.approx(targets.mean(axis=0), abs=1e-6)


def test_a_phone_of_the_person_takes_over_as_it_is_spoken_more_often() -> None:
    """The person lowers the second parameter by 2 in every b."""
    terms = many_frames()
    b = INVENTORY.index("b")
    targets = terms.base[:, :2] - 2.0 * np.outer(terms.labels[:, N_OFFSETS // 2] == b, [0.0, 1.0])
    shifts = []
    for n in (20, 100, 4000):
        part = FrameTerms(terms.labels[:n], terms.base[:n], terms.utterance[:n])
        found = fit_base_map(part, targets[:n], PRIOR, UNIT, trust=1.0, penalty=30.0)
        steady = found.window.sum(axis=0)[:, 1]
        shifts.append(steady[b] - np.delete(steady, b).mean())
    assert 0 > shifts[0] > shifts[1] + 0.3
    assert shifts[1:] == pytest.approx([-2.0, -2.0], abs=0.4)


def test_the_resting_position_of_single_utterances_is_no_evidence() -> None:
    """Every utterance is shifted by a random amount; the phones of an utterance must not explain it."""
    terms = many_frames(800)
    shift = np.random.default_rng(4).normal(0, 3, (10, 2))[terms.utterance]
    plain = fit_base_map(terms, terms.base[:, :2], PRIOR, UNIT, trust=1.0, penalty=30.0)
    moved = fit_base_map(terms, terms.base[:, :2] + shift, PRIOR, UNIT, trust=1.0, penalty=30.0)
    assert moved.window == pytest.approx(plain.window, abs=1e-9)
    assert moved.matrix == pytest.approx(plain.matrix, abs=1e-9)


def test_a_gain_multiplies_the_motion_about_a_pose() -> None:
    terms, mapped, pose = many_frames(100), made_map(), np.array([1.0, -2.0])
    gain = np.array([[1.3, 0.1], [-0.2, 0.9]])
    expected = pose + (mapped.parameters(terms) - pose) @ gain.T
    assert mapped.amplified(gain, pose).parameters(terms) == pytest.approx(expected, abs=1e-9)


def test_opening_and_width_have_gains_of_their_own() -> None:
    stream = np.random.default_rng(0)
    spread = np.array([3.0, 2.0, 1.0, 0.5], np.float32)
    basis = stream.normal(size=(4, N_LANDMARKS, 3)).astype(np.float32)
    model = ShapeModel(np.zeros((N_LANDMARKS, 3), np.float32), basis, spread, 3, np.zeros(4, np.float32))
    gain, moved = lip_gain(model, (1.5, 0.7)), stream.normal(size=(20, 3))
    opening, width = (basis[:3, 13, 1] - basis[:3, 14, 1]), (basis[:3, 291, 0] - basis[:3, 61, 0])
    assert moved @ gain.T @ opening == pytest.approx(1.5 * moved @ opening, abs=1e-6)
    assert moved @ gain.T @ width == pytest.approx(0.7 * moved @ width, abs=1e-6)
    assert lip_gain(model, (1.0, 1.0)) == pytest.approx(np.eye(3), abs=1e-9)


def test_motion_that_is_amplified_later_is_the_same_after_it() -> None:
    """Base frames come before amplification, too; the map was fitted behind it."""
    terms, mapped, amplitude = many_frames(500), made_map(), 1.14
    middle = terms.base.mean(axis=0)
    before = FrameTerms(terms.labels, middle + (terms.base - middle) / amplitude, terms.utterance)
    moved = mapped.before_amplification(amplitude, terms).parameters(before)
    pose = moved.mean(axis=0)
    assert pose + amplitude * (moved - pose) == pytest.approx(mapped.parameters(terms), abs=1e-9)
