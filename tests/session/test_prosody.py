"""Pitch, range and duration that a request or a mark asks of the voice."""

import numpy as np
import pytest

from lexicon.errors import InputError
from lexicon.sentences import Phrase, Sentence, split_sentences
from tests.tones import LetterVoice
from tts2face.models.palette import PLAIN, Delivery
from tts2face.models.person import Person
from tts2face.request import Request
from tts2face.session.prepared import prepare, read_marks
from tts2face.session.speech import prosody_of, sentence_sound, speak_sentence
from tts2face.sound.fitting import fitting_voice
from tts2face.sound.prosody import Prosody
from tts2face.sound.voice_pool import SHIPPED_VOICES, TYPICAL_HZ, VoicePool, usual_pitch_hz
from tts2face.types import Waveform

TEXT = "We were away a year ago."


def sentence(request: Request) -> Sentence:
    return next(iter(split_sentences(read_marks(request), request.language)))


def phrase(text: str, **options: object) -> tuple[Phrase, Request]:
    request = Request(text=text, **options)  # type: ignore[arg-type]
    return sentence(request).utterances[0], request


def test_the_request_and_the_style_make_the_prosody() -> None:
    assert prosody_of(*phrase(TEXT), PLAIN) == Prosody()
    part, request = phrase(TEXT, rate=1.2, voice_pitch=-2, voice_range=0.5)
    assert prosody_of(part, request, PLAIN) == Prosody(1.2, -2.0, 0.5)
    assert prosody_of(*phrase(TEXT), Delivery(0.9, -2.0, -1.5, 0.7)) == Prosody(0.9, -1.5, 0.7)


@pytest.mark.parametrize(("seconds", "rate"), [(1.0, 0.7), (0.4, 1.75), (0.2, 2.0), (4.0, 0.5)])
def test_a_duration_sets_the_rate_as_far_as_rates_reach(seconds: float, rate: float) -> None:
    request = Request(text=f'<speak><prosody duration="{seconds}s">hi there</prosody></speak>', rate=1.5, lead=None)
    voice = LetterVoice()  # seven letters of 0.1 s
    spoken = speak_sentence(voice, sentence(request), request)
    assert [said for said, _ in voice.said] == ["hi there"] * 2
    assert voice.said[1][1] == pytest.approx(rate, rel=1e-6)
    sound = sentence_sound(voice, sentence(request), request)
    assert sound.samples.tobytes() == spoken.sound.samples.tobytes()


def test_pitches_in_hz_are_those_of_the_voice() -> None:
    hz = '<prosody pitch="188Hz">a</prosody>'
    text = f'<speak>{hz} <voice name="heart">{hz}</voice></speak>'
    runs = read_marks(Request(text=text, voice="joe")).runs
    pitches = [run.tone.pitch for run in runs if run.tone.pitch]
    assert pitches == pytest.approx([12.0, 12 * np.log2(188 / 198.8)], abs=0.01)
    shifted = read_marks(Request(text='<speak><prosody pitch="94Hz">a</prosody></speak>', voice="joe", voice_pitch=3))
    assert shifted.runs[0].tone.pitch == pytest.approx(-3.0)


def test_the_pitch_of_every_voice_is_known_or_that_of_its_sex() -> None:
    assert {name for name, info in SHIPPED_VOICES.items() if info.pitch_hz} >= {
        "heart",
        "joe",
        "espeak",
        "espeak-female",
    }
    assert usual_pitch_hz("kore", "en-us") == TYPICAL_HZ["female"]
    assert usual_pitch_hz(None, "en-us") == usual_pitch_hz("heart", "en-us") == 198.8
    assert usual_pitch_hz("somebody.onnx", "de") == TYPICAL_HZ["-"]


@pytest.mark.parametrize(
    ("text", "options", "reason"),
    [
        (
            '<prosody pitch="+6st">a</prosody>',
            {"voice_pitch": 8},
            r"pitch of the text \(6 semitones\) and of the request",
        ),
        ('<prosody range="+60%">a</prosody>', {"voice_range": 1.5}, "a range of pitch of 1.6 in the text times 1.5 of"),
        ("a", {"voice_pitch": 13}, "voice_pitch must lie between -12 and 12, not 13"),
        ("a", {"voice_range": -1}, "voice_range must lie between 0 and 2, not -1"),
    ],
)
def test_prosody_out_of_range_is_refused(text: str, options: dict, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        prepare(Request(text=f"<speak>{text}</speak>", **options))


def test_pitches_in_hz_are_those_of_the_voice_that_fits_the_face() -> None:
    request, child = Request(text='<speak><prosody pitch="150Hz">We were away.</prosody></speak>'), Person("female", 6)
    pitches = [prepare(request, person).text.runs[0].tone.pitch for person in (None, child)]
    shift = fitting_voice(child, "en-us").prosody.pitch
    assert shift > 1.0
    assert pitches == pytest.approx([12 * np.log2(150 / 198.8), 12 * np.log2(150 / 198.8) - shift])


def f0_of(sound: Waveform) -> np.ndarray:
    """F0 of the voiced frames, in semitones over 1 Hz."""
    from parselmouth import Sound

    pitch = Sound(sound.samples.astype(float), sound.rate).to_pitch_ac(0.01, 50, very_accurate=True, pitch_ceiling=500)
    hz = pitch.selected_array["frequency"]
    return 12 * np.log2(hz[hz > 0])


def test_a_real_voice_does_what_it_is_asked(voices: VoicePool) -> None:
    voice = voices.voice("heart", "en-us", {})
    said = {}
    for name, text, options in (
        ("plain", TEXT, {}),
        ("high", TEXT, {"voice_pitch": 3}),
        ("marked", f'<speak><prosody pitch="+3st">{TEXT}</prosody></speak>', {}),
        ("even", TEXT, {"voice_range": 0.3}),
        ("long", f'<speak><prosody duration="2s">{TEXT}</prosody></speak>', {}),
        ("stressed", TEXT.replace("away", "AWAY"), {}),
    ):
        request = Request(text=text, seed=0, **options)
        said[name] = speak_sentence(voice, sentence(request), request)
    tones = {name: f0_of(spoken.sound) for name, spoken in said.items()}
    middle = {name: np.median(tone) - np.median(tones["plain"]) for name, tone in tones.items()}
    assert middle["high"] == pytest.approx(3.0, abs=0.5)
    assert middle["marked"] == pytest.approx(3.0, abs=0.7)
    spread = {name: np.ptp(np.percentile(tone, [10, 90])) for name, tone in tones.items()}
    assert spread["even"] < 0.5 * spread["plain"]
    words = {name: {word.text.strip("."): word for word in spoken.speech.words} for name, spoken in said.items()}
    seconds = {
        name: np.diff(said[name].speech.phones.edges[[found["away"].first, found["away"].last]])[0]
        for name, found in words.items()
    }
    assert seconds["stressed"] > 1.1 * seconds["plain"]
    edges = said["long"].speech.phones.edges
    assert edges[words["long"]["ago"].last] - edges[words["long"]["We"].first] == pytest.approx(2.0, abs=0.1)


def test_notes_on_a_document_are_those_of_its_request() -> None:
    prepared = prepare(Request(text="<speak><b>a</b> 你好</speak>"))
    assert prepared.notes[0] == "SSML, line 1: <b> is not supported; its text is spoken"
    assert len(prepared.notes) == 2


def test_emphasis_of_a_recordings_words_is_text() -> None:
    words = read_marks(Request(text="It is NOT *here*.", audio="a.wav"))
    assert (words.text, len(words.runs)) == ("It is NOT *here*.", 1)
