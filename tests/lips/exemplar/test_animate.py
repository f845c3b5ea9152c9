"""Lip motion of an exemplar model for phone sequences."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.exemplar import (
    ExemplarModel,
    build_exemplar_model,
    select_tokens,
    speech_trajectory,
)
from tts2face.lips.explanation import explain_selection, explanation_json, explanation_text
from tts2face.lips.options import METHOD_OPTIONS, THEOBALD_2007, SynthesisOptions
from tts2face.lips.rest import REST_FROM_S, rest_weights
from tts2face.lips.tokens import MAX_CONTEXT
from tts2face.models.talker import Talker
from tts2face.types import frame_count

LABELS = [SILENCE, "p", "b", "m", "f", "s", "t", "i", "ɑ", "u", "h", "ɔɪ", "ʃ"]
OF_OTHERS = {"network", "articulation"}  # this talker has no network; faces articulate (tests/lips/retargeting)


def sequence(labels, durations):
    return PhoneSequence(labels, np.concatenate([[0.0], np.cumsum(durations)]))


def moved(voice, phones, fps=50.0, **options):
    n_frames = frame_count(phones.end, fps)
    return speech_trajectory(phones, voice, fps=fps, n_frames=n_frames, options=SynthesisOptions(**options))


SENTENCE = sequence([SILENCE, "s", "ɑ", "p", "i", "m", "u", SILENCE], [0.4, 0.1, 0.12, 0.1, 0.12, 0.08, 0.12, 0.5])


@st.composite
def phone_sequences(draw):
    labels = draw(st.lists(st.sampled_from(LABELS), min_size=1, max_size=12))
    durations = [draw(st.floats(0.01, 0.9)) for _ in labels]
    return sequence(labels, durations)


@settings(max_examples=60, deadline=None)
@given(
    phones=phone_sequences(),
    fps=st.sampled_from([12.5, 24.0, 25.0, 30.0, 60.0]),
    method=st.sampled_from(sorted(METHOD_OPTIONS)),
)
def test_every_chunk_begins_and_ends_at_rest_and_stays_finite(voice: ExemplarModel, phones, fps, method):
    made = speech_trajectory(
        phones, voice, fps=fps, n_frames=frame_count(phones.end, fps), options=METHOD_OPTIONS[method]
    ).values
    assert (made[0] == voice.rest).all()
    assert (made[-1] == voice.rest).all()
    assert np.isfinite(made).all()
    assert np.abs(made[:, 0]).max() < 25.0  # mm; the recorded lips open to 16


@settings(max_examples=40, deadline=None)
@given(phones=phone_sequences())
def test_silence_far_from_speech_is_at_rest(voice: ExemplarModel, phones):
    made = moved(voice, phones).values
    times = np.arange(len(made)) / 50.0
    sounding = [at for at, label in enumerate(phones.phones) if label != SILENCE]
    near = np.zeros(len(times), bool)
    for at in sounding:
        near |= (times > phones.edges[at] - REST_FROM_S) & (times < phones.edges[at + 1] + REST_FROM_S)
    assert (made[~near] == voice.rest).all()


def test_frame_rates_agree_where_their_frames_meet(voice: ExemplarModel):
    slow, fast = moved(voice, SENTENCE, 25.0).values, moved(voice, SENTENCE, 50.0).values
    np.testing.assert_allclose(slow, fast[::2][: len(slow)], atol=1e-5)


def test_a_pause_cuts_a_text_into_parts_that_move_alone(voice: ExemplarModel):
    """The motion of a sentence between silences does not depend on other sentences."""
    twice = sequence([*SENTENCE.phones[:-1], SILENCE, *SENTENCE.phones[1:]],
                     [*SENTENCE.durations[:-1], 2.1, *SENTENCE.durations[1:]])  # fmt: skip
    alone, both = moved(voice, SENTENCE, context=1).values, moved(voice, twice, context=1).values
    n = int((SENTENCE.edges[-2] + 0.3) * 50)
    np.testing.assert_allclose(both[:n], alone[:n], atol=1e-5)


def test_shows_the_mouth_of_each_phone(voice: ExemplarModel):
    made = moved(voice, SENTENCE, 100.0).values
    middles = ((SENTENCE.edges[:-1] + SENTENCE.edges[1:]) / 2 * 100).round().astype(int)
    opening = dict(zip(SENTENCE.phones, made[middles, 0], strict=True))
    assert opening["ɑ"] > 12 > opening["i"] > 6 > opening["s"] > opening["p"]
    assert opening["p"] < 0.5
    assert opening["m"] < 1.0


def test_averaging_opens_lips_and_keeping_contacts_closes_them(voice: ExemplarModel):
    keep, lose = (moved(voice, SENTENCE, 100.0, contacts=kept, smoothing_s=0.03).values[:, 0] for kept in (True, False))
    during = slice(62, 72)  # p
    assert keep[during].min() < 0.2
    assert lose[during].min() > 0.5
    np.testing.assert_array_equal(keep[:40], lose[:40])


def test_lips_move_before_the_sound(voice: ExemplarModel):
    made = moved(voice, sequence([SILENCE, "ɑ", SILENCE], [0.6, 0.2, 0.6]), 100.0).values[:, 0]
    assert made[35] == voice.rest[0]
    assert made[59] > voice.rest[0] + 0.5


def test_moves_only_in_speech():
    phones = sequence([SILENCE, "p", SILENCE], [0.5, 0.1, 0.5])
    pull = rest_weights(phones, np.arange(101) / 100)
    assert pull[0] == pull[-1] == pull[25] == pull[85] == 1
    assert (pull[45:66] == 0).all()
    assert (np.diff(pull[:50]) <= 0).all()


def test_silence_is_rest(voice: ExemplarModel):
    assert (moved(voice, sequence([SILENCE], [1.0])).values == voice.rest).all()


def test_a_throat_sound_takes_the_next_phone_s_shape(voice: ExemplarModel):
    with_h = sequence([SILENCE, "h", "i", SILENCE], [0.4, 0.1, 0.1, 0.4])
    without = sequence([SILENCE, "i", SILENCE], [0.4, 0.2, 0.4])
    # The pull to rest ends with the sound of either, so that both agree in full.
    np.testing.assert_allclose(moved(voice, with_h).values, moved(voice, without).values, atol=1e-6)


def test_a_recorded_sentence_finds_itself_first(voice: ExemplarModel, talker: Talker):
    phone_sequences = talker.utterances[7]
    found = select_tokens(phone_sequences.phones, voice, SynthesisOptions(context=4, k=1)).found
    assert (voice.tokens.utterance[found.tokens[:, 0]] == 7).all()


def test_one_exemplar_of_a_recorded_sentence_gives_the_recording_back(voice: ExemplarModel, talker: Talker):
    phone_sequences = talker.utterances[7]
    options = SynthesisOptions(context=4, k=1, smoothing_s=0.0, contacts=False, amplitude=1.0)
    made = speech_trajectory(
        phone_sequences.phones, voice, fps=25.0, n_frames=len(phone_sequences.shape), options=options
    ).values
    inner = slice(int(phone_sequences.phones.edges[1] * 25) + 1, int(phone_sequences.phones.edges[-2] * 25))
    # mm; straight lines between knots cut the corners of a curve with 25 frames a second
    assert np.abs(made[inner, 0] - phone_sequences.shape[inner, 0]).max() < 0.6


@pytest.mark.parametrize("name", [field.name for field in fields(SynthesisOptions) if field.name not in OF_OTHERS])
def test_every_option_matters(voice: ExemplarModel, name):
    changed = {
        "context": 1, "k": 1, "duration": 0.0, "sharpness": 0.0, "overlap": False, "precision": 0.0, "align": False,
        "amplitude": 1.2, "smoothing_s": 0.04, "contacts": False,
    }  # fmt: skip
    assert (moved(voice, SENTENCE).values != moved(voice, SENTENCE, **{name: changed[name]}).values).any()


def test_the_published_method_is_kept():
    assert METHOD_OPTIONS["theobald2007"] == THEOBALD_2007
    assert METHOD_OPTIONS["exemplar"] == SynthesisOptions()


def test_same_arguments_give_the_same_bytes(voice: ExemplarModel, talker: Talker):
    again = build_exemplar_model(talker)
    assert moved(voice, SENTENCE).values.tobytes() == moved(again, SENTENCE).values.tobytes()


def test_refuses_impossible_requests(voice: ExemplarModel):
    for change, reason in [
        ({"context": 0}, "context must be"),
        ({"context": MAX_CONTEXT + 1}, "context must be"),
        ({"k": 2**31}, "the number of exemplars must be 1 to 10000, not 2147483648"),
        ({"k": 0}, "the number of exemplars must be 1 to 10000, not 0"),
    ]:
        with pytest.raises(InputError, match=reason):
            moved(voice, SENTENCE, **change)
    with pytest.raises(InputError, match="smoothing_s must be 0 or more"):
        replace(SynthesisOptions(), smoothing_s=-0.1)
    with pytest.raises(InputError, match="begin at 0 s"):
        speech_trajectory(PhoneSequence(SENTENCE.phones, SENTENCE.edges + 1.0), voice, fps=25.0, n_frames=30)
    with pytest.raises(InputError, match="§"):
        moved(voice, sequence(["§"], [0.2]))


def test_explains_which_tokens_were_used(voice: ExemplarModel):
    phones = sequence([SILENCE, "b", "ɔɪ", SILENCE], [0.3, 0.1, 0.2, 0.3])
    shown = explain_selection(select_tokens(phones, voice), voice)
    assert [phone.phone for phone in shown] == [SILENCE, "b", "ɔɪ", SILENCE] or len(shown) == 5
    b = shown[1]
    assert (b.phone, b.shown, b.left[-1], b.right[0]) == ("b", "b", SILENCE, shown[2].shown)
    assert len(b.tokens) <= 30
    assert sum(used.weight for used in b.tokens) == pytest.approx(1.0)
    assert [used.score for used in b.tokens] == sorted((used.score for used in b.tokens), reverse=True)
    first = b.tokens[0]
    assert first.utterance.startswith("u")
    assert len(first.left) == len(first.right) == 3
    text = explanation_text(shown, n_tokens=2)
    assert "ɔɪ (shown by" in text
    assert f"{first.utterance} {first.start:.2f}" in text
    assert json.loads(json.dumps(explanation_json(shown)))[1]["tokens"][0]["utterance"] == first.utterance


def test_the_amplitude_is_counted_from_the_mean_speaking_pose(voice: ExemplarModel, talker: Talker):
    plain = SynthesisOptions(contacts=False, amplitude=1.0)
    more = replace(plain, amplitude=1.5)
    phones = sequence([SILENCE, "b", "i", "p", "ɑ", "b", SILENCE], [0.4, *[0.1] * 5, 0.4])
    one, other = (
        speech_trajectory(phones, voice, fps=100.0, n_frames=130, options=options).values for options in (plain, more)
    )
    inner = slice(50, 80)  # far from silence, where the rest pose has no influence
    np.testing.assert_allclose(
        other[inner] - voice.mean_speaking_pose,
        1.5 * (one[inner] - voice.mean_speaking_pose),
        atol=1e-3 * voice.spread.max(),
    )
