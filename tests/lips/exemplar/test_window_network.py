"""Networks from phones to lips: their output, their file, and their share of the motion."""

from dataclasses import replace

import numpy as np
import pytest

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.exemplar import (
    FAR_CONTEXT,
    NEAR_CONTEXT,
    ExemplarModel,
    context_farness,
    interpolated_farness,
    select_tokens,
    speech_trajectory,
)
from tts2face.lips.options import SynthesisOptions
from tts2face.lips.rest import BREAK_S
from tts2face.lips.targets import Targets, target_phones
from tts2face.lips.token_search import context_weights
from tts2face.models.phone_network import PhoneNetwork, window_features
from tts2face.models.talker import Talker
from tts2face.models.talker_file import read_talker, write_talker

PHONES = PhoneSequence([SILENCE, "b", "i", "p", SILENCE], [0.0, 0.3, 0.4, 0.6, 0.7, 1.0])
KNOWN = ("b", "i", "p", SILENCE)
TIMES = np.arange(25) / 25


def one_hot_features(phones: PhoneSequence, times: np.ndarray) -> np.ndarray:
    shown, place = window_features(phones, times, KNOWN)
    return np.array([[*np.eye(len(KNOWN))[row].ravel(), *where] for row, where in zip(shown, place, strict=True)])


def random_network(n_outputs: int, n_networks: int = 2) -> PhoneNetwork:
    generator = np.random.default_rng(0)
    n_features = one_hot_features(PHONES, TIMES).shape[1]
    shapes = [(n_features, 7), (7, 5), (5, n_outputs)]
    weights = tuple(generator.normal(0, 1, (n_networks, *shape)).astype(np.float32) for shape in shapes)
    biases = tuple(generator.normal(0, 1, (n_networks, shape[1])).astype(np.float32) for shape in shapes)
    return PhoneNetwork(KNOWN, weights, biases)


def test_the_answer_is_the_mean_of_the_networks_neuron_by_neuron() -> None:
    network = random_network(2)
    features = one_hot_features(PHONES, TIMES)
    wanted = np.zeros((len(TIMES), 2))
    for member in range(2):
        for frame, row in enumerate(features):
            seen = [float(value) for value in row]
            for layer in range(3):
                weights, biases = network.weights[layer][member], network.biases[layer][member]
                seen = [
                    sum(value * weights[at, unit] for at, value in enumerate(seen)) + biases[unit]
                    for unit in range(weights.shape[1])
                ]
                if layer < 2:
                    seen = [max(value, 0.0) for value in seen]
            wanted[frame] += np.array(seen) / 2
    np.testing.assert_allclose(network.parameters(PHONES, TIMES), wanted, rtol=1e-4, atol=1e-4)


def test_a_single_network_can_be_evaluated() -> None:
    network = random_network(2)
    alone = [network.parameters(PHONES, TIMES, slice(at, at + 1)) for at in (0, 1)]
    np.testing.assert_allclose(np.mean(alone, axis=0), network.parameters(PHONES, TIMES), atol=1e-4)


def test_features_say_what_sounds_when() -> None:
    features = one_hot_features(PHONES, np.array([0.45]))[0]
    columns = features[: 21 * 4].reshape(21, 4)
    assert (columns.sum(axis=1) == 1).all()
    sounding = [KNOWN[at] for at in columns.argmax(axis=1)]
    assert sounding[7] == "i"  # now
    assert sounding[7 - 2] == "b"  # 80 ms before
    assert sounding[7 + 4] == "p"  # 160 ms after
    assert sounding[15:] == [SILENCE, SILENCE, "b", "p", SILENCE, SILENCE]  # neighbours; beyond the end the end goes on
    np.testing.assert_allclose(features[-4:], [0.25, 0.05, 0.15, 0.2], atol=1e-6)


def test_an_unknown_phone_is_encoded_as_the_nearest_one() -> None:
    other = PhoneSequence([SILENCE, "m", "i", "p", SILENCE], PHONES.edges)
    features = one_hot_features(other, np.array([0.35]))[0][:84].reshape(21, 4)
    assert KNOWN[int(features[7].argmax())] in {"b", "p"}
    with pytest.raises(InputError, match="§"):
        window_features(PhoneSequence(["§"], [0.0, 1.0]), TIMES, KNOWN)


def test_a_talker_keeps_its_networks(talker: Talker, tmp_path) -> None:
    with_one = replace(talker, network=random_network(talker.model.n_speech))
    write_talker(tmp_path / "a.talker", with_one)
    read = read_talker(tmp_path / "a.talker").network
    assert read is not None
    assert read.inventory == KNOWN
    np.testing.assert_allclose(  # weights are kept in 16 bits
        read.parameters(PHONES, TIMES), with_one.network.parameters(PHONES, TIMES), rtol=0.02, atol=0.1
    )
    write_talker(tmp_path / "b.talker", talker)
    assert read_talker(tmp_path / "b.talker").network is None


def test_the_share_of_the_networks_is_that_of_the_nearest_target(voice: ExemplarModel) -> None:
    knowing = replace(voice, network=random_network(len(voice.spread)))
    plain = SynthesisOptions(network=0.0, amplitude=1.0, smoothing_s=0.0, contacts=False)

    def moved(which: ExemplarModel, share: float) -> np.ndarray:
        options = replace(plain, network=share)
        return speech_trajectory(PHONES, which, fps=100.0, n_frames=100, options=options).values[35:65]

    none, half, whole = (moved(knowing, share) for share in (0.0, 0.5, 1.0))
    np.testing.assert_array_equal(none, moved(voice, 0.5))
    selection = select_tokens(PHONES, knowing, replace(plain, network=0.5))
    farness = interpolated_farness(selection.targets, context_farness(selection), 100)[35:65, None]
    assert 0 < farness.min() < farness.max()
    share = 0.5 + 0.5 * farness
    np.testing.assert_allclose(half, (1 - share) * none + share * whole, atol=1e-4)
    with pytest.raises(InputError, match="from 0 to 1"):
        SynthesisOptions(network=1.5)


def test_networks_take_over_where_contexts_are_far_and_phones_unrecorded(voice: ExemplarModel) -> None:
    options = SynthesisOptions(network=0.4)
    recorded = select_tokens(PHONES, voice, options)
    highest = 2 * context_weights(options.context).sum()

    def farness(distance: float) -> np.ndarray:
        scores = np.full_like(recorded.found.scores, highest - distance)
        return context_farness(replace(recorded, found=recorded.found._replace(scores=scores)))

    np.testing.assert_array_equal(farness(0.0), 0.0)
    np.testing.assert_allclose(farness(NEAR_CONTEXT), 0.0, atol=1e-12)
    np.testing.assert_allclose(farness(FAR_CONTEXT), 1.0, atol=1e-12)
    assert (np.diff([farness(distance)[0] for distance in np.linspace(NEAR_CONTEXT, FAR_CONTEXT, 9)]) > 0).all()
    unrecorded = select_tokens(PhoneSequence([SILENCE, "v", SILENCE], [0.0, 0.3, 0.5, 1.0]), voice, options)
    assert context_farness(unrecorded)[unrecorded.targets.source == 1] == pytest.approx(1.0)


def test_networks_know_phones_that_were_not_recorded(voice: ExemplarModel) -> None:
    network = random_network(len(voice.spread))
    wider = PhoneNetwork(
        (*KNOWN, "v"), (np.repeat(network.weights[0], 2, axis=1)[:, : 21 * 5 + 4], *network.weights[1:]), network.biases
    )
    knowing = replace(voice, network=wider)
    options = SynthesisOptions(smoothing_s=0.0, contacts=False, amplitude=1.0)

    def moved(label: str) -> np.ndarray:
        phones = PhoneSequence([SILENCE, label, SILENCE], [0.0, 0.3, 0.7, 1.0])
        return speech_trajectory(phones, knowing, fps=100.0, n_frames=100, options=options).values[50]

    phones = PhoneSequence([SILENCE, "v", SILENCE], [0.0, 0.3, 0.7, 1.0])
    predicted = wider.parameters(phones, np.array([0.5]))[0]
    np.testing.assert_allclose(moved("v"), predicted, atol=1e-4)


def test_time_that_belongs_to_no_target_is_silence() -> None:
    spans = np.array([[0.0, 0.2, 0.4, 0.5], [0.2, 0.4, 0.5, 0.5], [0.8, 0.9, 1.0, 1.1]])
    shown = target_phones(Targets(("b", "i", "p"), spans, np.arange(3)))
    assert shown.phones == (SILENCE, "b", "i", SILENCE, "p")
    np.testing.assert_allclose(shown.edges, [0.0, 0.2, 0.4, 0.5, 0.9, 1.0])


def paused(pause_s: float) -> PhoneSequence:
    return PhoneSequence([SILENCE, "b", "i", SILENCE, "p", SILENCE], np.cumsum([0.0, 0.3, 0.1, 0.2, pause_s, 0.1, 0.3]))


@pytest.mark.parametrize(("pause_s", "share"), [(0.52, 1.0), (BREAK_S - 0.04, 1.0), (BREAK_S + 0.04, 0.0)])
def test_lips_rest_in_a_pause_as_the_networks_learnt_and_in_a_break_as_at_the_end(
    voice: ExemplarModel, pause_s: float, share: float
) -> None:
    """A pause is one silence for the networks, however it is cut for the search."""
    network = random_network(len(voice.spread))
    knowing = replace(voice, network=network)
    phones, at = paused(pause_s), round(100 * (0.6 + pause_s / 2))
    options = SynthesisOptions(smoothing_s=0.0, contacts=False)
    n_frames = round(100 * phones.end)

    def made(share_of_networks: float) -> np.ndarray:
        chosen = replace(options, network=share_of_networks)
        return speech_trajectory(phones, knowing, fps=100.0, n_frames=n_frames, options=chosen).values

    learnt = network.parameters(phones, np.array([at / 100]))[0]
    np.testing.assert_allclose(made(0.5)[at], share * learnt + (1 - share) * voice.rest, atol=2e-3)
    np.testing.assert_array_equal(made(0.5)[[0, -1]], np.stack([voice.rest] * 2))
    np.testing.assert_array_equal(made(0.0)[at], voice.rest)
