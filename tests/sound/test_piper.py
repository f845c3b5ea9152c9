"""Piper voices, tested by a generated voice whose sound encodes its letters."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import BackendError, DataError, InputError
from lexicon.ipa import parse_ipa
from lexicon.phones import PHONES
from tests.packages import needs, package
from tts2face.sound.piper import PiperVoice, english_letters
from tts2face.sound.voice import SpokenWord
from tts2face.sound.voice_pool import load_voice

onnx = package("onnx")

RATE = 22_050
LETTER_SAMPLES = 1_000  # samples of each letter at the rate 1
LETTERS = tuple("_^$ ',.!?abdefhijklmnopstuvwzæðŋɑɐɔəɚɛɜɡɪɹɾʃʊʌʒˈˌːθᵻ̃")  # without ɝ and ç
SOUNDS = np.random.default_rng(3).uniform(-0.5, 0.5, (len(LETTERS), LETTER_SAMPLES)).astype(np.float32)


def settings() -> dict[str, object]:
    return {
        "audio": {"sample_rate": RATE},
        "espeak": {"voice": "en-us"},
        "phoneme_type": "espeak",
        "num_symbols": len(LETTERS),
        "num_speakers": 1,
        "phoneme_id_map": {letter: [at] for at, letter in enumerate(LETTERS)},
    }


def write_model(path: Path, sounds: np.ndarray = SOUNDS, input_name: str = "input") -> None:
    """Write a model that joins the sound of each letter, cut to a share of `LETTER_SAMPLES` by the length scale."""
    from onnx import TensorProto, helper, numpy_helper

    constants = {
        "sounds": sounds,
        "zero": np.array([0], np.int64),
        "one": np.array([1], np.int64),
        "two": np.array([2], np.int64),
        "width": np.array([LETTER_SAMPLES], np.float32),
        "shape": np.array([1, 1, 1, -1], np.int64),
        "flat": np.array([-1], np.int64),
    }
    nodes = [
        helper.make_node("Slice", ["scales", "one", "two"], ["length"]),
        helper.make_node("Mul", ["length", "width"], ["wanted"]),
        helper.make_node("Cast", ["wanted"], ["end"], to=TensorProto.INT64),
        helper.make_node("Slice", ["sounds", "zero", "end", "one"], ["cut"]),
        helper.make_node("Reshape", [input_name, "flat"], ["letters"]),
        helper.make_node("Gather", ["cut", "letters"], ["rows"]),
        helper.make_node("Reshape", ["rows", "shape"], ["output"]),
    ]
    inputs = [
        helper.make_tensor_value_info(input_name, TensorProto.INT64, [1, None]),
        helper.make_tensor_value_info("input_lengths", TensorProto.INT64, [1]),
        helper.make_tensor_value_info("scales", TensorProto.FLOAT, [3]),
    ]
    output = helper.make_tensor_value_info("output", TensorProto.FLOAT, [1, 1, 1, None])
    tensors = [numpy_helper.from_array(value, name) for name, value in constants.items()]
    graph = helper.make_graph(nodes, "letters", inputs, [output], tensors)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)


@pytest.fixture
def voice_file(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.onnx"
    write_model(path)
    path.with_name("tiny.onnx.json").write_text(json.dumps(settings()))
    return path


def synthesised_letters(voice: PiperVoice, content: str | list[SpokenWord]) -> str:
    """Letters whose sounds make up the voice's answer, without padding and the ends of sentences."""
    samples = voice.speak(content).waveform.samples
    parts = samples.reshape(-1, LETTER_SAMPLES)
    found = [LETTERS[int((SOUNDS @ part).argmax())] for part in parts]
    return "".join(letter for letter in found if letter not in "_^$")


def test_a_text_is_spoken_with_the_phones_of_espeak(voice_file: Path) -> None:
    voice = load_voice(str(voice_file), "en-us")
    assert isinstance(voice, PiperVoice)
    assert voice.sample_rate == RATE
    assert synthesised_letters(voice, "Bob may.") == "bˈɑːb mˈeɪ."
    speech = voice.speak("Bob may.")
    assert [word.text for word in speech.words] == ["Bob", "may"]
    spoken = ["".join(speech.phones.phones[word.first : word.last]) for word in speech.words]
    assert spoken == ["bɑb", "meɪ"]
    assert speech.phones.end == speech.waveform.duration


@pytest.fixture
def german_voice_file(voice_file: Path) -> Path:
    voice_file.with_name("tiny.onnx.json").write_text(json.dumps(settings() | {"espeak": {"voice": "de"}}))
    return voice_file


def test_other_languages_are_read_by_piper(german_voice_file: Path) -> None:
    needs("piper")
    voice = load_voice(str(german_voice_file), "de", {"tag": parse_ipa("ʃˈiː")})
    assert synthesised_letters(voice, "Guten Abend.") == "ɡˈuːtən ˈɑːbənt."
    assert synthesised_letters(voice, "Guten Tag.") == "ɡˈuːtən ʃˈi."
    words = [SpokenWord("guten", parse_ipa("kˈæt"), ","), SpokenWord("Abend", ())]
    assert synthesised_letters(voice, words).split()[0] == "kˈæt,"
    assert [word.text for word in voice.speak("Guten Abend.").words] == ["Guten", "Abend"]


def test_damaged_settings_of_another_language_are_refused(german_voice_file: Path) -> None:
    needs("piper")
    content = settings() | {"espeak": {"voice": "de"}, "vowel_clusters": 1}
    german_voice_file.with_name("tiny.onnx.json").write_text(json.dumps(content))
    with pytest.raises(DataError, match="not those of a Piper voice"):
        load_voice(str(german_voice_file), "de")


def test_another_language_needs_piper_tts(german_voice_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "piper.config", None)
    with pytest.raises(BackendError, match=r"needs piper-tts; run: pip install 'tts2face\[piper\]'"):
        load_voice(str(german_voice_file), "de")


def test_american_english_needs_no_piper_tts(voice_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "piper", None)
    voice = load_voice(str(voice_file), "en-us")
    assert synthesised_letters(voice, "Bob may.") == "bˈɑːb mˈeɪ."


@pytest.mark.parametrize(
    ("ipa", "written"),
    [("sˈɪti", "sˈɪɾi"), ("bˈʌtən", "bˈʌtən"), ("ə", "ɐ"), ("ən", "ɐn"), ("əɡˈoʊ", "əɡˈoʊ"), ("bˈɝd", "bˈɜːd")],
)
def test_english_is_written_as_espeak_writes_it(ipa: str, written: str) -> None:
    assert english_letters(parse_ipa(ipa), PHONES, "".join(LETTERS)) == written


def test_sound_that_cannot_be_aligned_gets_nominal_durations(voice_file: Path) -> None:
    speech = load_voice(str(voice_file), "en-us").speak("x " * 20, rate=20.0)  # too short for 20 words
    assert [word.text for word in speech.words] == ["x"] * 20
    assert speech.phones.end == pytest.approx(speech.waveform.duration)
    assert [phone for phone in speech.phones.phones if phone != "sil"][:3] == ["ɛ", "k", "s"]
    lengths = [speech.phones.edges[word.last] - speech.phones.edges[word.first] for word in speech.words]
    assert lengths == pytest.approx([lengths[0]] * 20)


def test_rate_acts_and_seed_does_not(voice_file: Path) -> None:
    voice = load_voice(str(voice_file), "en-us")
    usual, fast = voice.speak("Bob."), voice.speak("Bob.", rate=2.0)
    assert len(fast.waveform.samples) * 2 == len(usual.waveform.samples)
    again = voice.speak("Bob.", seed=7)
    assert np.array_equal(again.waveform.samples, usual.waveform.samples)


def test_given_phones_and_a_dictionary_are_spoken(voice_file: Path) -> None:
    voice = load_voice(str(voice_file), "en-us", {"bob": parse_ipa("ʃˈiː")})
    assert synthesised_letters(voice, "May Bob now.") == "mˈeɪ ʃˈiː nˈaʊ."
    assert synthesised_letters(voice, "Bob, may Bob?") == "ʃˈiː, mˈeɪ ʃˈiː?"
    words = [SpokenWord("may", parse_ipa("kˈæt"), ","), SpokenWord("Bob", ()), SpokenWord("may", ())]
    assert synthesised_letters(voice, words).split() == ["kˈæt,", "ʃˈiː", "mˈeɪ"]
    unknown_mark = [SpokenWord("may", parse_ipa("kˈæt"), "…")]
    assert synthesised_letters(voice, unknown_mark) == "kˈæt."


def test_a_given_phone_that_the_voice_lacks_is_replaced_by_the_nearest(voice_file: Path) -> None:
    """The model has no letters for others: without a replacement "an" would lose its vowel."""
    voice = load_voice(str(voice_file), "en-us")
    assert synthesised_letters(voice, [SpokenWord("bird", parse_ipa("bˈɝd"))]) == "bˈɜːd"
    assert synthesised_letters(voice, [SpokenWord("an", parse_ipa("ˈɔ̃"))]) == "ˈɔ̃"


def test_brackets_of_a_text_are_not_phones(voice_file: Path) -> None:
    voice = load_voice(str(voice_file), "en-us")
    assert synthesised_letters(voice, "May [[Bob]].").replace(",", "").split()[:2] == ["mˈeɪ", "bˈɑːb."]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda content: [], "lacks audio.sample_rate, 8000 to 48000"),
        (lambda content: content | {"audio": {"sample_rate": "22050"}}, "lacks audio.sample_rate"),
        (lambda content: content | {"audio": {"sample_rate": 0}}, "lacks audio.sample_rate"),
        (lambda content: content | {"espeak": 3}, "lacks espeak.voice, a language"),
        (lambda content: content | {"espeak": {"voice": "xx"}}, "names no language of espeak-ng"),
        (lambda content: content | {"phoneme_id_map": {"a": [1]}}, "lacks phoneme_id_map"),
        (lambda content: content | {"phoneme_id_map": dict.fromkeys("^_$", "1")}, "lacks phoneme_id_map"),
        (lambda content: content | {"num_speakers": None}, "lacks num_speakers"),
        (lambda content: content | {"num_symbols": None}, "lacks num_symbols"),
    ],
)
def test_wrong_settings_are_refused(
    change: Callable[[dict[str, object]], object], reason: str, voice_file: Path
) -> None:
    voice_file.with_name("tiny.onnx.json").write_text(json.dumps(change(settings())))
    with pytest.raises(DataError, match=reason):
        load_voice(str(voice_file), "en-us")


def test_a_voice_of_another_kind_is_refused(voice_file: Path) -> None:
    voice_file.with_name("tiny.onnx.json").write_text(json.dumps(settings() | {"phoneme_type": "pinyin"}))
    with pytest.raises(InputError, match="of the type 'pinyin'; choose a voice of the type 'espeak'"):
        load_voice(str(voice_file), "en-us")


def test_a_voice_of_another_language_is_refused(voice_file: Path) -> None:
    with pytest.raises(InputError, match=r"speaks en-us, not de; use --language en-us or another voice"):
        load_voice(str(voice_file), "de")
    assert load_voice(str(voice_file), "en-gb").sample_rate == RATE


@pytest.mark.parametrize("damage", [lambda content: content[:2_000], lambda content: b"no model"])
def test_a_damaged_model_is_refused(damage: Callable[[bytes], bytes], voice_file: Path) -> None:
    voice_file.write_bytes(damage(voice_file.read_bytes()))
    with pytest.raises(DataError, match=r"tiny\.onnx is not a Piper voice .*; download it again"):
        load_voice(str(voice_file), "en-us")


def test_another_model_is_refused(voice_file: Path) -> None:
    write_model(voice_file, input_name="pixels")
    with pytest.raises(DataError, match="is not a Piper voice: its inputs are input_lengths, pixels, scales"):
        load_voice(str(voice_file), "en-us")


@pytest.mark.parametrize(
    ("sounds", "reason"),
    [
        (SOUNDS[:5], "cannot speak 'bˈɑːb.' .*download the voice again"),  # an index without a row
        (SOUNDS * 0, "returned no sound for 'bˈɑːb.'"),
        (SOUNDS * np.nan, "returned no sound for 'bˈɑːb.'"),
    ],
    ids=["index", "silence", "NaN"],
)
def test_a_model_that_returns_no_sound_is_refused(sounds: np.ndarray, reason: str, voice_file: Path) -> None:
    write_model(voice_file, sounds)
    with pytest.raises(DataError, match=reason):
        load_voice(str(voice_file), "en-us").speak("Bob.")
