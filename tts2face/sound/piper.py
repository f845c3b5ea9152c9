"""Piper voices from files, with phone edges by forced alignment of their sound.

The network of a Piper voice (VITS in ONNX), its alphabet, and piper-tts as reader of other languages.
"""

import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError, import_of_extra
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.ipa import IpaPhone
from lexicon.languages import language_code
from lexicon.normalize import spoken_form
from lexicon.pauses import SIMPLE_MARKS
from lexicon.phones import PHONES, nearest_phones
from lexicon.pronounce import Word, has_dictionary
from lexicon.values.json_text import read_json
from lexicon.written_words import espeak_text
from tts2face.numeric.telemetry import disable_telemetry
from tts2face.sound.aligned_speech import AlignedWord, aligned_speech
from tts2face.sound.alignment import Align, Aligner
from tts2face.sound.onnx_part import onnx_errors
from tts2face.sound.voice import (
    PronunciationMap,
    SpeechInput,
    SpokenWord,
    apply_volume,
    pronounce_content,
    split_spoken_sentences,
    word_segments,
)
from tts2face.types import Speech, Waveform

MODEL_INPUTS = frozenset({"input", "input_lengths", "scales"})
# letters that each Piper voice wants before a sentence, behind each letter, and at the end
START = "^"
PADDING = "_"
END = "$"
STRESS_MARKS = MappingProxyType({1: "ˈ", 2: "ˌ"})
# espeak-ng's letters of English, in which these voices are trained, where they differ from the phone table.
ENGLISH_LETTERS = MappingProxyType({
    "i": "iː", "u": "uː", "ɑ": "ɑː", "ɔ": "ɔː", "ɝ": "ɜː", "ɜ": "ɜː", "ɪə": "iə",
})  # fmt: skip
FLAP, SHORT_SCHWA = "ɾ", "ɐ"
_ARTICLES = frozenset({("ə",), ("ə", "n")})
WORD = re.compile(r"[^\W_]+(?:['’-][^\W_]+)*")
WORD_AND_MARKS = re.compile(rf"({WORD.pattern})([.,;:!?]*)")
ESPEAK_PHONES = "espeak"  # type of the supported voices; others need letters, or models that piper downloads
SAMPLE_RATES_HZ = (8_000, 48_000)


class PiperNetwork:
    """The model of a Piper voice: letters to sound, without noise, so that equal letters give equal bytes."""

    def __init__(self, path: Path, settings: Mapping[str, Any]) -> None:
        self._path, self._ids = path, {str(letter): list(ids) for letter, ids in settings["phoneme_id_map"].items()}
        self.sample_rate = int(settings["audio"]["sample_rate"])
        self.session = _load_session(path)
        self._n_speakers = int(settings["num_speakers"])

    @property
    def letters(self) -> frozenset[str]:
        """The alphabet of the voice."""
        return frozenset(self._ids)

    def run(self, letters: Sequence[str], rate: float) -> NDArray[np.float32]:
        """(n,) samples of a sentence with peak 1.

        Raises
        ------
        DataError
            The model fails or returns no sound.
        """
        ids = [*self._ids[START], *self._ids[PADDING]]
        for letter in letters:
            ids += [*self._ids[letter], *self._ids[PADDING]] if letter in self._ids else []
        ids += self._ids[END]
        inputs = {
            "input": np.array([ids], np.int64),
            "input_lengths": np.array([len(ids)], np.int64),
            "scales": np.array([0.0, 1.0 / rate, 0.0], np.float32),  # noise, length, noise of durations
        }
        if self._n_speakers > 1:
            # the network of several speakers needs the number of one: the first
            inputs["sid"] = np.zeros(1, np.int64)
        text = "".join(letters)
        try:
            samples = np.asarray(self.session.run(None, inputs)[0], np.float32).ravel()
        except onnx_errors() as broken:
            raise DataError(f"{self._path} cannot speak {text!r} ({broken}); download the voice again") from broken
        if not np.isfinite(samples).all() or not samples.any():
            raise DataError(f"{self._path} returned no sound for {text!r}; download the voice again")
        scaled: NDArray[np.float32] = samples / np.abs(samples).max()
        return scaled


class PiperTextReader:
    """piper-tts as reader of a text in the language of a voice: text to letters of each sentence."""

    def __init__(self, network: PiperNetwork, settings: Mapping[str, Any]) -> None:
        with import_of_extra(
            "a Piper voice of another language than English needs piper-tts; run: pip install 'tts2face[piper]'"
        ):
            from piper.config import PiperConfig
            from piper.voice import PiperVoice as Loaded
        try:
            self._reader: Any = Loaded(session=network.session, config=PiperConfig.from_dict(dict(settings)))
        except (TypeError, ValueError, KeyError, AttributeError) as broken:
            raise DataError(f"the settings are not those of a Piper voice ({broken}); download it again") from broken

    def letters(self, text: str) -> list[list[str]]:
        """Letters of each sentence; words in ``[[...]]`` are taken as letters."""
        found: list[list[str]] = self._reader.phonemize(text)
        return found


def english_letters(segments: Sequence[IpaPhone], phones: Collection[str], letters: Collection[str]) -> str:
    """Letters of an English word as espeak-ng writes them: long vowels, flaps, the article a as ɐ.

    Parameters
    ----------
    phones
        Phones that the voice has; others are replaced by the nearest ones.
    letters
        The alphabet of the voice.
    """
    own = [
        IpaPhone(phone, segment.stress if at == 0 else 0, is_syllabic=segment.is_syllabic)
        for segment in segments
        for at, phone in enumerate(_own_phones(segment.phone, phones, letters))
    ]
    if tuple(segment.phone for segment in own) in _ARTICLES and SHORT_SCHWA in letters and not own[0].stress:
        return SHORT_SCHWA + "".join(segment.phone for segment in own[1:])
    written = ""
    for at, segment in enumerate(own):
        spelled = FLAP if _is_flap(own, at) and FLAP in letters else _english_spelling(segment, at + 1 == len(own))
        is_known = all(letter in letters for letter in spelled)
        written += STRESS_MARKS.get(segment.stress, "") + (spelled if is_known else phone_letters(segment.phone))
    return written


def _own_phones(phone: str, phones: Collection[str], letters: Collection[str]) -> tuple[str, ...]:
    is_spelled = all(letter in letters for letter in ENGLISH_LETTERS.get(phone, "-"))
    return (phone,) if is_spelled else nearest_phones(phone, phones)


def _english_spelling(segment: IpaPhone, is_last: bool) -> str:
    if segment.phone == "i" and not segment.stress and is_last:
        return "i"  # happy
    return ENGLISH_LETTERS.get(segment.phone, phone_letters(segment.phone))


def _is_flap(segments: Sequence[IpaPhone], at: int) -> bool:
    """Whether a /t/ stands between a vowel or /ɹ/ and an unstressed vowel, other than that of -ten (button)."""
    if segments[at].phone != "t" or not 0 < at < len(segments) - 1:
        return False
    before, after = segments[at - 1].phone, segments[at + 1]
    follows = segments[at + 2].phone if at + 2 < len(segments) else ""
    is_between = (PHONES[before].is_vowel or before == "ɹ") and PHONES[after.phone].is_vowel
    return is_between and after.stress == 0 and (after.phone, follows) != ("ə", "n")


def phone_letters(phone: str) -> str:
    """Characters of a phone in the alphabet of Piper, which separates diacritics."""
    # the alphabet of Piper has this letter alone composed
    return unicodedata.normalize("NFD", phone) if phone != "ç" else phone


def _load_session(path: Path) -> Any:
    disable_telemetry()
    import onnxruntime

    options = onnxruntime.SessionOptions()
    # one thread: convolutions give other bits at other numbers of threads
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4  # fatal errors; others are raised
    # an arena keeps up to 100 MB after a sentence (decision 073)
    options.enable_cpu_mem_arena = options.enable_mem_pattern = False
    try:
        session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        inputs = {tensor.name for tensor in session.get_inputs()}
    except onnx_errors() as broken:
        raise DataError(f"{path} is not a Piper voice ({broken}); download it again") from broken
    if not inputs >= MODEL_INPUTS:
        raise DataError(f"{path} is not a Piper voice: its inputs are {', '.join(sorted(inputs))}; download it again")
    return session


class PiperVoice:
    """A Piper voice (VITS in ONNX) with its settings file ``NAME.onnx.json`` in the same folder.

    English is spoken by the phones of `lexicon`; in other languages the text is spoken by piper-tts, whose
    phones are those of espeak-ng.
    """

    def __init__(self, path: Path, language: str, own_words: PronunciationMap, align: Align | None = None) -> None:
        if not path.is_file():
            raise InputError(f"there is no Piper voice {path}; check the path")
        settings = path.with_name(path.name + ".json")
        if not settings.is_file():
            raise DataError(f"the Piper voice {path} lacks its settings; put {settings.name} into the same folder")
        try:
            content = read_json(settings)  # checks size and nesting, which piper does not limit
        except OSError as refused:
            raise DataError(f"{settings} cannot be read ({refused.strerror}); check the file") from refused
        _check_settings(settings, content)
        _check_language(path, content["espeak"]["voice"], language)
        self._language = language_code(content["espeak"]["voice"])
        self._network = PiperNetwork(path, content)
        self._text_reader = None if has_dictionary(self._language) else PiperTextReader(self._network, content)
        self._phones = tuple(phone for phone in PHONES if self._network.letters.issuperset(phone_letters(phone)))
        self._own_words = own_words
        self._align: Align = align or Aligner().align

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return self._network.sample_rate

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.sound.voice.Voice`. The model runs without noise: `seed` is unused."""
        words, sentences = self._spoken(content)
        return aligned_speech(self._synthesise(sentences, rate), words, self._align)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound without the alignment of its phones."""
        return self._synthesise(self._spoken(content)[1], rate)

    def _spoken(self, content: SpeechInput) -> tuple[list[AlignedWord], list[list[str]]]:
        """Words with their phones, and the letters of each sentence in Piper's alphabet."""
        words = pronounce_content(content, self._language, self._own_words)
        if self._text_reader is None:
            sentences = [self._sentence_letters(sentence) for sentence in split_spoken_sentences(words)]
            return [(word.text, [tuple(word.phones)]) for word in words], sentences
        spoken = [SpokenWord(word.text, word_segments(word), word.mark) for word in words]
        if isinstance(content, str):
            text = self._insert_own_words(espeak_text(spoken_form(content, self._language), self._language))
        else:
            text = " ".join(map(self._bracketed_ipa, spoken))
        aligned = [(word.text, [tuple(segment.phone for segment in word.segments)]) for word in spoken]
        return aligned, self._text_reader.letters(text)

    def _synthesise(self, sentences: Sequence[Sequence[str]], rate: float) -> Waveform:
        parts = [self._network.run(letters, rate) for letters in sentences if letters]
        return Waveform(apply_volume(np.concatenate(parts)), self.sample_rate)

    def _sentence_letters(self, words: Sequence[Word]) -> list[str]:
        """Letters of a sentence; phones that the voice does not have are replaced by the nearest ones."""
        # flaps are American
        letters = self._network.letters if self._language == DEFAULT_LANGUAGE else self._network.letters - {FLAP}
        spoken = (english_letters(word_segments(word), self._phones, letters) for word in words)
        marks = (self._known_marks(word.mark) for word in words)
        return list(" ".join(letters + mark for letters, mark in zip(spoken, marks, strict=True)))

    def _insert_own_words(self, text: str) -> str:
        """Replace a user's words by ``[[IPA]]``, Piper's notation for given pronunciations."""

        def replace_with_ipa(match: "re.Match[str]") -> str:
            segments = self._own_words.get(match[1].lower())
            return match[0] if segments is None else self._bracketed_ipa(SpokenWord(match[1], segments, match[2]))

        return WORD_AND_MARKS.sub(replace_with_ipa, text.replace("[[", " "))  # its own brackets are not read

    def _bracketed_ipa(self, word: SpokenWord) -> str:
        """A word in Piper's notation; phones that the voice does not have are replaced by the nearest ones."""
        written = "".join(
            STRESS_MARKS.get(segment.stress, "")
            + "".join(map(phone_letters, nearest_phones(segment.phone, self._phones)))
            for segment in word.segments
        )
        # Piper omits punctuation that follows the brackets
        return f"[[{written}{self._known_marks(word.after)}]]"

    def _known_marks(self, marks: str) -> str:
        simple = (SIMPLE_MARKS.get(mark, mark) for mark in marks)
        return "".join(mark for mark in simple if mark in self._network.letters)


def _check_settings(path: Path, content: Any) -> None:
    """Check the entries of a settings file from which a voice is loaded."""
    content = content if isinstance(content, dict) else {}
    low, high = SAMPLE_RATES_HZ
    audio, espeak, ids = (content.get(name) for name in ("audio", "espeak", "phoneme_id_map"))
    rate = audio.get("sample_rate") if isinstance(audio, dict) else None
    language = espeak.get("voice") if isinstance(espeak, dict) else None
    faults = {
        f"audio.sample_rate, {low} to {high}": not isinstance(rate, int) or not low <= rate <= high,
        "espeak.voice, a language of espeak-ng": not isinstance(language, str) or not language,
        "phoneme_id_map, lists of indices by letter": not _is_id_map(ids),
        "num_speakers, a number": not isinstance(content.get("num_speakers"), int),
        "num_symbols, a number": not isinstance(content.get("num_symbols"), int),
    }
    for entry, is_wrong in faults.items():
        if is_wrong:
            raise DataError(f"{path} lacks {entry}; download the voice again")
    if (kind := content.get("phoneme_type", ESPEAK_PHONES)) != ESPEAK_PHONES:
        raise InputError(f"{path} is a voice of the type {kind!r}; choose a voice of the type {ESPEAK_PHONES!r}")


def _is_id_map(ids: Any) -> bool:
    return (
        isinstance(ids, dict)
        and {"^", "_", "$"} <= ids.keys()  # begin, padding and end of a sentence
        and all(isinstance(value, list) and all(isinstance(index, int) for index in value) for value in ids.values())
    )


def _check_language(path: Path, spoken: str, wanted: str) -> None:
    try:
        code = language_code(spoken)
    except InputError as unknown:
        raise DataError(f"the Piper voice {path} names no language of espeak-ng ({unknown})") from unknown
    if code.partition("-")[0] != wanted.partition("-")[0]:
        raise InputError(f"the Piper voice {path} speaks {code}, not {wanted}; use --language {code} or another voice")
