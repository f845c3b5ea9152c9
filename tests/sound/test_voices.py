"""Requirements that every voice meets."""

import random
import time
import unicodedata
from dataclasses import replace

import numpy as np
import pytest

from lexicon.dictionary import MAX_PHONES, parse_dictionary
from lexicon.errors import BackendError, DataError, InputError, SilentTextError
from lexicon.ipa import IpaPhone, parse_ipa
from lexicon.phones import PHONES
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.request import Request
from tts2face.session.joining import resampled_speech
from tts2face.session.prepared import prepare
from tts2face.session.speech_stream import SpeechModels, speak_sentences
from tts2face.sound import voice_pool
from tts2face.sound.voice import SpokenWord, Voice, apply_volume
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Speech, Waveform

SENTENCE = "Bob may move five big maps."
WORDS = ["Bob", "may", "move", "five", "big", "maps"]
IN_OTHER_LANGUAGES = {
    "de": ("Guten Morgen, schöne Welt.", 4),
    "fr-fr": ("Bonjour, où est la gare?", 5),
    "es": ("¿Dónde está la biblioteca?", 4),
    "it": ("La vita è bella.", 4),
    "pl": ("Dzień dobry, świecie.", 3),
    "ru": ("Привет, мир.", 2),
    "ja": ("こんにちは", 1),
    "cmn": ("你好世界", 1),
    "hi": ("नमस्ते दुनिया", 2),
    "tr": ("Günaydın dünya.", 2),
}


@pytest.fixture(scope="module", params=["heart", "espeak"])
def voice(request: pytest.FixtureRequest) -> Voice:
    return load_voice(request.param, "en-us")


def phones_by_word(speech: Speech) -> dict[str, str]:
    return {word.text.strip(".,"): "".join(speech.phones.phones[word.first : word.last]) for word in speech.words}


def test_speech_is_sound_with_phones_of_the_table_and_words(voice: Voice) -> None:
    speech = voice.speak(SENTENCE)
    assert speech.waveform.rate == voice.sample_rate
    assert speech.phones.end == speech.waveform.duration
    assert set(speech.phones.phones) <= PHONES.keys()
    assert speech.phones.phones[0] == speech.phones.phones[-1] == SILENCE
    assert phones_by_word(speech) == {
        "Bob": "bɑb",
        "may": "meɪ",
        "move": "muv",
        "five": "faɪv",
        "big": "bɪɡ",
        "maps": "mæps",
    }
    assert float(np.abs(speech.waveform.samples).max()) > 0.05


def test_the_same_request_gives_the_same_bytes(voice: Voice) -> None:
    first, second = voice.speak(SENTENCE, seed=3), voice.speak(SENTENCE, seed=3)
    assert np.array_equal(first.waveform.samples, second.waveform.samples)
    assert np.array_equal(first.phones.edges, second.phones.edges)


def test_the_rate_acts(voice: Voice) -> None:
    usual, fast = voice.speak(SENTENCE), voice.speak(SENTENCE, rate=1.5)
    spoken = [speech.phones.end - 0.5 for speech in (usual, fast)]  # half a second of it is silence at any rate
    assert spoken[1] < 0.8 * spoken[0]


def test_silences_are_silent_and_phones_are_not(voice: Voice) -> None:
    speech = voice.speak(SENTENCE)
    rate = speech.waveform.rate
    power = {True: 0.0, False: 0.0}
    for phone, start, end in zip(speech.phones.phones, speech.phones.edges, speech.phones.edges[1:], strict=False):
        part = speech.waveform.samples[round(start * rate) : round(end * rate)]
        power[phone == SILENCE] += float((part**2).sum())
    assert power[True] < 0.02 * power[False]


def test_phones_in_instead_of_text(voice: Voice) -> None:
    words = [SpokenWord("map", parse_ipa("mˈæp")), SpokenWord("you", parse_ipa("jˈuː"), ".")]
    assert phones_by_word(voice.speak(words)) == {"map": "mæp", "you": "ju"}


def test_words_with_and_without_phones(voice: Voice) -> None:
    words = [SpokenWord(text, ()) for text in ("Of", "the", "twenty-five")]
    mixed = [*words, SpokenWord("Bob", parse_ipa("ʃˈiː"), ","), SpokenWord("may", ()), SpokenWord("move.", ())]
    found = phones_by_word(voice.speak(mixed))
    assert (found["Bob"], found["may"], found["move"], found["twenty-five"]) == ("ʃi", "meɪ", "muv", "twɛntifaɪv")


@pytest.mark.parametrize("name", ["heart", "espeak"])
def test_words_of_a_user_dictionary_are_combined_with_given_phones(name: str) -> None:
    voice = load_voice(name, "en-us", {"bob": parse_ipa("ʃˈiː")})
    found = phones_by_word(
        voice.speak([SpokenWord("May", parse_ipa("kˈæt")), SpokenWord("Bob", ()), SpokenWord("move.", ())])
    )
    assert (found["May"], found["Bob"]) == ("kæt", "ʃi")


def test_espeak_has_a_female_voice() -> None:
    male, female = (load_voice(name, "de").speak("Guten Morgen.") for name in ("espeak", "espeak-female"))
    assert male.phones.phones == female.phones.phones
    assert pitch_hz(female) > 1.4 * pitch_hz(male)


def test_breath_is_the_same_in_every_second() -> None:
    """espeak-ng draws the noise of its female voices by the time in seconds."""
    voice = load_voice("espeak-female", "de")
    first = voice.speak("Guten Morgen.").waveform.samples
    time.sleep(1.0 - time.time() % 1.0)
    assert np.array_equal(voice.speak("Guten Morgen.").waveform.samples, first)


def pitch_hz(speech: Speech) -> float:
    """Median of the voiced frames, by autocorrelation."""
    samples, rate = speech.waveform.samples, speech.waveform.rate
    found = []
    for start in range(0, len(samples) - 2048, 1024):
        frame = samples[start : start + 2048] - samples[start : start + 2048].mean()
        power = np.correlate(frame, frame, "full")[2047:]
        lag = 50 + int(power[50:350].argmax())
        if power[0] > 0.5 and power[lag] > 0.4 * power[0]:
            found.append(rate / lag)
    return float(np.median(found))


@pytest.mark.parametrize("rate", [16_000, 24_000, 48_000])
def test_speech_at_another_rate_keeps_its_phones_and_pitch(rate: int) -> None:
    samples = 0.5 * np.sin(2 * np.pi * 200 * np.arange(22_050) / 22_050)
    phones = PhoneSequence([SILENCE, "a", SILENCE], [0.0, 0.2, 0.8, 1.0])
    found = resampled_speech(Speech(Waveform(samples, 22_050), phones, ()), rate)
    assert (found.waveform.rate, len(found.waveform.samples)) == (rate, rate)
    assert found.phones.edges.tolist() == pytest.approx([0.0, 0.2, 0.8, 1.0])
    same = 0.5 * np.sin(2 * np.pi * 200 * np.arange(rate) / rate)
    middle = slice(rate // 10, -rate // 10)
    np.testing.assert_allclose(found.waveform.samples[middle], same[middle], atol=1e-3)
    at_home = Speech(Waveform(samples, 22_050), phones, ())
    assert resampled_speech(at_home, 22_050) is at_home


@pytest.mark.parametrize("name", ["heart", "espeak"])
def test_words_of_a_user_dictionary_take_precedence(name: str) -> None:
    voice = load_voice(name, "en-us", {"bob": parse_ipa("ʃˈiː")})
    assert phones_by_word(voice.speak("May Bob move?"))["Bob"] == "ʃi"


@pytest.mark.parametrize(("language", "text", "n_words"), [(code, *case) for code, case in IN_OTHER_LANGUAGES.items()])
def test_espeak_speaks_other_languages(language: str, text: str, n_words: int) -> None:
    speech = load_voice(None, language).speak(text)
    assert len(speech.words) >= n_words
    assert speech.phones.end == speech.waveform.duration
    assert SILENCE not in [phone for word in speech.words for phone in speech.phones.phones[word.first : word.last]]


def test_a_foreign_word_is_spoken_in_its_own_language() -> None:
    """espeak-ng switches to English for "move" and marks it among its phonemes; the marks are not phones."""
    speech = load_voice("espeak", "de").speak("Bob may move.")
    assert {"m", "u", "v"} <= set(speech.phones.phones)


def test_the_closure_of_a_stop_is_part_of_the_phone() -> None:
    """espeak-ng's event is at the burst; the /p/ of "happy" begins where the sound before it ends."""
    speech = load_voice("espeak", "en-us").speak("A happy apple.")
    rate = speech.waveform.rate
    at = speech.phones.phones.index("p")
    start, end = (round(edge * rate) for edge in speech.phones.edges[at : at + 2])
    closure = speech.waveform.samples[start : start + round(0.02 * rate)]
    assert float(np.abs(closure).max()) < 0.02
    assert (end - start) / rate > 0.05


@pytest.mark.parametrize("text", ["", "...", "?!"])
def test_nothing_to_say_is_refused(voice: Voice, text: str) -> None:
    with pytest.raises(InputError, match="nothing to say"):
        voice.speak(text)


def test_text_that_the_neural_voice_cannot_speak_is_refused() -> None:
    with pytest.raises(InputError, match="cannot read 你好"):
        load_voice("heart", "en-us").speak("Hello 你好 there.")


def test_letters_of_another_script_are_refused() -> None:
    with pytest.raises(InputError, match="cannot read"):
        load_voice("espeak", "de").speak("Привет")


@pytest.mark.parametrize("language", ["en-us", "de", "ru"])
def test_the_longest_words_of_a_dictionary_are_spoken(language: str) -> None:
    longest = parse_dictionary(
        "bob /" + "ˈɔu " * MAX_PHONES + "/"
    ).entries  # ɔu takes the most bytes of a stressed phone
    assert len(longest["bob"]) == MAX_PHONES
    spoken = load_voice("espeak", language, longest).speak("bob bob")
    assert len(spoken.words) == 2


def test_a_crash_of_espeak_is_reported() -> None:
    words = [SpokenWord("bob", (IpaPhone("b"),) * 300)]
    with pytest.raises(BackendError, match=r"espeak-ng crashed \(signal 11\) on '\[\[bbb.*change the spelling"):
        load_voice("espeak", "de").speak(words)


def test_a_name_that_espeak_cuts_within_a_character_is_read() -> None:
    """Names of phones have 8 bytes in its events, and ˈaɪʊɹ, its way to report this word's vowels, has 9."""
    speech = load_voice("espeak", "en-us").speak([SpokenWord("tower", parse_ipa("tˈaʊəɹ"))])
    assert phones_by_word(speech) == {"tower": "taʊəɹ"}


@pytest.mark.parametrize("name", ["heart", "espeak"])
def test_very_long_words_are_spoken_in_english(name: str) -> None:
    speech = load_voice(name, "en-us").speak("-".join(["straightforwardness"] * 14) + " may")
    assert len(speech.phones) >= 200
    assert speech.words[-1].text == "may"


@pytest.mark.parametrize(
    ("name", "language", "reason"),
    [
        ("nobody", "en-us", "no voice 'nobody'; give heart, kore"),
        ("heart", "de", "speaks English, not de"),
        ("espeak", "xx", "no language 'xx'"),
        ("missing.onnx", "en-us", r"no Piper voice missing\.onnx"),
    ],
)
def test_unknown_voices_are_refused(name: str, language: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        load_voice(name, language)


def test_a_piper_voice_without_settings_is_refused(tmp_path) -> None:
    path = tmp_path / "voice.onnx"
    path.write_bytes(b"x")
    with pytest.raises(DataError, match=r"put voice\.onnx\.json into the same folder"):
        load_voice(str(path), "en-us")


def test_loud_sound_is_turned_down_as_a_whole() -> None:
    loud = apply_volume(np.array([0.5, -1.0, 0.25]), 2.0)
    assert loud == pytest.approx([0.5, -1.0, 0.25])
    assert apply_volume(np.array([0.25, -0.5]), 2.0) == pytest.approx([0.5, -1.0])


def spoken_of(text: str, language: str) -> list[list[str]]:
    """Words of each sentence of a text that espeak-ng speaks."""
    models = SpeechModels(lambda _, code: load_voice("espeak", code))
    found = speak_sentences(prepare(Request(text=text, language=language, voice="espeak")), models)
    return [[word.text for word in spoken.speech.words] for spoken in (part.spoken for part in found)]


def test_a_part_without_words_for_the_voice_is_left_out() -> None:
    assert spoken_of("Hello. ⳽⮟. ⅙👗 [pause 0.5] there", "th") == [["Hello"], ["there"]]
    with pytest.raises(SilentTextError, match="nothing to say"):
        spoken_of("⅙👗.", "th")


@pytest.mark.parametrize(
    "language",
    [
        "th",
        *(pytest.param(language, marks=pytest.mark.fuzz) for language in ("en-us", "de", "cmn")),
        pytest.param("ja", marks=[pytest.mark.fuzz, pytest.mark.needs("pyopenjtalk")]),
    ],
)
def test_random_texts_fail_before_their_second_sentence_or_not_at_all(language: str) -> None:
    rng = random.Random(5)
    pools = [range(0x20, 0x250), range(0x250, 0x2000), range(0x2000, 0x3400), range(0x4E00, 0x4F00)]
    letters = [[chr(code) for code in pool if unicodedata.category(chr(code)) != "Cn"] for pool in pools]
    for _ in range(6):
        words = ["".join(rng.choice(rng.choice(letters)) for _ in range(rng.randint(1, 6))) for _ in range(4)]
        text = " ".join(words).replace("[", "(").replace("<", "(")
        assert spoken_of(f"A b. {text}", language)


def test_a_missing_voice_of_a_later_sentence_is_refused_before_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    joe = replace(voice_pool.SHIPPED_VOICES["joe"], package="no_such_package")
    monkeypatch.setattr(voice_pool, "SHIPPED_VOICES", {**voice_pool.SHIPPED_VOICES, "joe": joe})
    text = "<speak>Hello. Good bye. <voice name='joe'>Now.</voice></speak>"
    models = SpeechModels(lambda _, code: load_voice("espeak", code))
    with pytest.raises(BackendError, match="the voice joe is not installed"):
        next(speak_sentences(prepare(Request(text=text, voice="espeak")), models))
