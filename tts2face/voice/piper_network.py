"""The network of a Piper voice (VITS in ONNX), its alphabet, and piper-tts as reader of other languages."""

import unicodedata
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError
from lexicon.ipa import Segment
from lexicon.phones import PHONES, nearest_phones
from tts2face.telemetry import disable_telemetry

MODEL_INPUTS = frozenset({"input", "input_lengths", "scales"})
BEGIN, PADDING, END = "^", "_", "$"
STRESS_MARKS = MappingProxyType({1: "ˈ", 2: "ˌ"})
# espeak-ng's letters of American English, in which these voices are trained, where they differ from the phone table.
ENGLISH_LETTERS = MappingProxyType({"i": "iː", "u": "uː", "ɑ": "ɑː", "ɔ": "ɔː", "ɝ": "ɜː"})
FLAP, SHORT_SCHWA = "ɾ", "ɐ"
_ARTICLES = frozenset({("ə",), ("ə", "n")})


class PiperNetwork:
    """The model of a Piper voice: letters to sound, without noise, so that equal letters give equal bytes.

    Raises
    ------
    DataError
        The file is damaged or is another model.
    """

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
        ids = [*self._ids[BEGIN], *self._ids[PADDING]]
        for letter in letters:
            ids += [*self._ids[letter], *self._ids[PADDING]] if letter in self._ids else []
        ids += self._ids[END]
        inputs = {
            "input": np.array([ids], np.int64),
            "input_lengths": np.array([len(ids)], np.int64),
            "scales": np.array([0.0, 1.0 / rate, 0.0], np.float32),  # noise, length, noise of durations
        }
        if self._n_speakers > 1:
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
    """piper-tts as reader of a text in the language of a voice: text to letters of each sentence.

    Raises
    ------
    DataError
        The settings are damaged.
    BackendError
        piper-tts is not installed.
    """

    def __init__(self, network: PiperNetwork, settings: Mapping[str, Any]) -> None:
        try:
            from piper.config import PiperConfig
            from piper.voice import PiperVoice as Loaded
        except ImportError as missing:
            raise BackendError(
                "a Piper voice of another language than English needs piper-tts; run: pip install 'tts2face[piper]'"
            ) from missing
        try:
            self._reader: Any = Loaded(session=network.session, config=PiperConfig.from_dict(dict(settings)))
        except (TypeError, ValueError, KeyError, AttributeError) as broken:
            raise DataError(f"the settings are not those of a Piper voice ({broken}); download it again") from broken

    def letters(self, text: str) -> list[list[str]]:
        """Letters of each sentence; words in ``[[...]]`` are taken as letters."""
        found: list[list[str]] = self._reader.phonemize(text)
        return found


def english_letters(segments: Sequence[Segment], phones: Collection[str], letters: Collection[str]) -> str:
    """Letters of an American English word as espeak-ng writes them: long vowels, flaps, the article a as ɐ.

    Parameters
    ----------
    phones
        Phones that the voice has; others are replaced by the nearest ones.
    letters
        The alphabet of the voice.
    """
    own = [
        Segment(phone, segment.stress if at == 0 else 0, is_syllabic=segment.is_syllabic)
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


def _english_spelling(segment: Segment, is_last: bool) -> str:
    if segment.phone == "i" and not segment.stress and is_last:
        return "i"  # happy
    return ENGLISH_LETTERS.get(segment.phone, phone_letters(segment.phone))


def _is_flap(segments: Sequence[Segment], at: int) -> bool:
    """Whether a /t/ stands between a vowel or /ɹ/ and an unstressed vowel, other than that of -ten (button)."""
    if segments[at].phone != "t" or not 0 < at < len(segments) - 1:
        return False
    before, after = segments[at - 1].phone, segments[at + 1]
    follows = segments[at + 2].phone if at + 2 < len(segments) else ""
    is_between = (PHONES[before].is_vowel or before == "ɹ") and PHONES[after.phone].is_vowel
    return is_between and after.stress == 0 and (after.phone, follows) != ("ə", "n")


def phone_letters(phone: str) -> str:
    """Characters of a phone in the alphabet of Piper, which separates diacritics."""
    return unicodedata.normalize("NFD", phone) if phone != "ç" else phone


def _load_session(path: Path) -> Any:
    disable_telemetry()
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4  # fatal errors; others are raised
    options.enable_cpu_mem_arena = options.enable_mem_pattern = False
    try:
        session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        inputs = {tensor.name for tensor in session.get_inputs()}
    except onnx_errors() as broken:
        raise DataError(f"{path} is not a Piper voice ({broken}); download it again") from broken
    if not inputs >= MODEL_INPUTS:
        raise DataError(f"{path} is not a Piper voice: its inputs are {', '.join(sorted(inputs))}; download it again")
    return session


def onnx_errors() -> tuple[type[Exception], ...]:
    """Exceptions for damaged files of ONNX Runtime, which have no common base but Exception."""
    from onnxruntime.capi import onnxruntime_pybind11_state as state

    runtime = [error for error in vars(state).values() if isinstance(error, type) and issubclass(error, Exception)]
    return TypeError, ValueError, KeyError, AttributeError, *runtime
