"""Tokens of recorded phones, their contexts and targets."""

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.exemplar import ExemplarModel
from tts2face.lips.similarity import token_samples
from tts2face.lips.targets import build_targets, substitute_phones
from tts2face.lips.tokens import PAUSE_REACH_S, collect_tokens, phone_contexts, sample_tokens, spoken_spans
from tts2face.models.talker import Talker

INVENTORY = tuple(sorted({"p", "b", "s", "t", "i", "ɪ", "ɔ", "u", SILENCE}))


def test_tokens_are_the_phones_of_all_utterances(talker: Talker):
    tokens = collect_tokens(talker)
    assert len(tokens) == 40 * 12
    said = [label for spoken in talker.utterances for label in spoken.phones.phones]
    assert [tokens.inventory[at] for at in tokens.phone] == said
    assert tokens.first_frame[-1] == len(tokens.frames) == sum(len(spoken.shape) for spoken in talker.utterances)
    assert tokens.frames.shape[1] == 3


def test_contexts_are_nearest_first_and_end_with_the_utterance():
    phone, utterance = np.array([1, 2, 3, 4, 5], np.int32), np.array([0, 0, 0, 1, 1], np.int32)
    around = phone_contexts(phone, utterance, 0)
    assert around[1, :6].tolist() == [1, 3, 0, 0, 0, 0]
    assert around[2, :6].tolist() == [2, 0, 1, 0, 0, 0]
    assert around[3, :4].tolist() == [0, 5, 0, 0]
    assert phone_contexts(phone[:1], utterance[:1], 7).tolist() == [[7] * 12]


def test_only_silence_next_to_speech_is_kept():
    spans = spoken_spans((SILENCE, "i", SILENCE), np.array([0.0, 1.0, 1.2, 3.0]))
    reach = PAUSE_REACH_S
    np.testing.assert_allclose(spans[0, 1:], [1 - reach, 1.0, 1.2])
    np.testing.assert_allclose(spans[1], [1 - reach, 1.0, 1.2, 1.2 + reach])
    np.testing.assert_allclose(spans[2, :3], [1.0, 1.2, 1.2 + reach])


def read_tokens(frames, bounds, positions):
    samples = np.zeros((*positions.shape, frames.shape[1]), np.float32)
    sample_tokens(frames, bounds, positions, samples)
    return samples


def test_motion_passes_through_its_frames_and_is_exact_for_a_parabola():
    frames = (np.arange(8.0) ** 2).astype(np.float32)[:, None]
    positions = np.array([[0.0, 3.0, 2.5, 4.25, 7.0, 9.0, -1.0]])
    read = read_tokens(frames, np.array([[0, 8]]), positions)[0, :, 0]
    np.testing.assert_allclose(read, [0.0, 9.0, 6.25, 18.0625, 49.0, 49.0, 0.0], rtol=1e-6)


def test_motion_never_reads_beyond_its_utterance():
    frames = np.array([[5.0], [1.0], [2.0], [9.0]], np.float32)
    read = read_tokens(frames, np.array([[1, 3]]), np.array([[-1.0, 0.0, 0.5, 1.0, 5.0]]))[0, :, 0]
    np.testing.assert_allclose(read, [1.0, 1.0, 1.5, 2.0, 2.0])
    assert read_tokens(frames, np.array([[3, 4]]), np.array([[0.3]]))[0, 0, 0] == 9.0


def test_token_samples_lie_within_the_token(talker: Talker, voice: ExemplarModel):
    samples = token_samples(voice.tokens)
    assert samples.shape == (len(voice.tokens), 5, 3)
    at = 5  # a phone of the first utterance: its middle sample is the motion at its middle
    spoken = talker.utterances[0]
    middle = spoken.phones.edges[at : at + 2].mean() * talker.fps
    near = np.interp(middle, np.arange(len(spoken.shape)), spoken.shape[:, 0])
    assert abs(samples[at, 2, 0] - near) < 0.7  # mm; a cubic against straight lines


def test_recorded_phones_map_to_themselves_and_others_to_the_nearest():
    assert substitute_phones("p", INVENTORY) == ("p",)
    assert substitute_phones("m", INVENTORY) == ("b",)
    assert substitute_phones("h", INVENTORY) == ()
    assert substitute_phones("h", (*INVENTORY, "h")) == ("h",)


def test_a_diphthong_is_shown_by_its_parts_in_halves():
    targets = build_targets(PhoneSequence(["b", "ɔɪ", "t"], [0.0, 0.1, 0.3, 0.4]), INVENTORY)
    assert targets.labels == ("b", "ɔ", "ɪ", "t")
    np.testing.assert_allclose(targets.spans[:, 1], [0.0, 0.1, 0.2, 0.3])
    assert targets.source.tolist() == [0, 1, 1, 2]


def test_a_throat_sound_lends_its_time():
    before_vowel = build_targets(PhoneSequence(["p", "h", "i"], [0.0, 0.1, 0.2, 0.3]), INVENTORY)
    assert before_vowel.labels == ("p", "i")
    np.testing.assert_allclose(before_vowel.spans[1, 1:3], [0.1, 0.3])
    before_silence = build_targets(PhoneSequence(["i", "h", SILENCE], [0.0, 0.1, 0.2, 0.5]), INVENTORY)
    assert before_silence.labels == ("i", SILENCE)
    np.testing.assert_allclose(before_silence.spans[0, 1:3], [0.0, 0.2])
    alone = build_targets(PhoneSequence(["h"], [0.0, 0.1]), INVENTORY)
    assert alone.labels == (SILENCE,)


def test_a_long_pause_belongs_half_to_either_side():
    targets = build_targets(PhoneSequence(["i", SILENCE, "p"], [0.0, 0.1, 2.0, 2.1]), INVENTORY)
    assert targets.labels == ("i", SILENCE, SILENCE, "p")
    np.testing.assert_allclose(targets.spans[1, 1:3], [0.1, 0.1 + PAUSE_REACH_S])
    np.testing.assert_allclose(targets.spans[2, 1:3], [2.0 - PAUSE_REACH_S, 2.0])
    short = build_targets(PhoneSequence(["i", SILENCE, "p"], [0.0, 0.1, 0.4, 0.5]), INVENTORY)
    assert short.labels == ("i", SILENCE, "p")
