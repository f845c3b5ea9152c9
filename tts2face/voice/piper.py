"""Piper voices from files, with phone edges by forced alignment of their sound."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lexicon.errors import DataError, InputError
from lexicon.g2p import DEFAULT_LANGUAGE, parse_espeak_word, phonemize
from lexicon.inputs import read_json
from lexicon.languages import language_code
from lexicon.nominal_durations import NOMINAL_S
from lexicon.phones import PHONES, nearest_phones
from lexicon.pronounce import Word
from lexicon.sequence import PhoneSequence, WordSpan
from lexicon.writing_systems import check_script
from tts2face.speech.forced_alignment import Aligner, SpeechAligner
from tts2face.types import Speech, Waveform
from tts2face.voice.content import pronounce_content, split_spoken_sentences, word_segments
from tts2face.voice.engine import PronunciationMap, SpeechInput, SpokenWord, apply_volume
from tts2face.voice.piper_network import STRESS_MARKS, PiperNetwork, PiperTextReader, english_letters, phone_letters

WORD = re.compile(r"[^\W_]+(?:['’-][^\W_]+)*")
WORD_AND_MARKS = re.compile(rf"({WORD.pattern})([.,;:!?]*)")
ESPEAK_PHONES = "espeak"  # type of the supported voices; others need letters, or models that piper downloads
AlignedWord = tuple[str, list[tuple[str, ...]]]  # a written word with its phones, for the aligner
SAMPLE_RATES_HZ = (8_000, 48_000)


class PiperVoice:
    """A Piper voice (VITS in ONNX) with its settings file ``NAME.onnx.json`` in the same folder.

    American English is spoken by the phones of `lexicon`; in other languages the text is spoken by piper-tts, whose
    phones are those of espeak-ng.

    Raises
    ------
    InputError
        The voice does not exist, speaks another language, or does not use the phones of espeak-ng.
    DataError
        The settings are missing, or a file is damaged.
    BackendError
        The voice speaks another language than English, and piper-tts is not installed.
    """

    def __init__(
        self, path: Path, language: str, own_words: PronunciationMap, aligner: SpeechAligner | None = None
    ) -> None:
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
        self._text_reader = None if self._language == DEFAULT_LANGUAGE else PiperTextReader(self._network, content)
        self._phones = tuple(phone for phone in PHONES if self._network.letters.issuperset(phone_letters(phone)))
        self._own_words = own_words
        self._aligner: SpeechAligner = aligner or Aligner()

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return self._network.sample_rate

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.voice.engine.Voice`. The model runs without noise: `seed` is unused."""
        words, sentences = self._spoken(content)
        sound = self._synthesise(sentences, rate)
        try:
            found = self._aligner.align(sound, words)
        except DataError:
            return Speech(sound, *nominal_phones_in(words, sound.duration))
        return Speech(sound, found.phones, found.words)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound without the alignment of its phones."""
        return self._synthesise(self._spoken(content)[1], rate)

    def _spoken(self, content: SpeechInput) -> tuple[list[AlignedWord], list[list[str]]]:
        """Words with their phones, and the letters of each sentence in Piper's alphabet."""
        if self._text_reader is None:
            words = pronounce_content(content, self._language, self._own_words)
            sentences = [self._sentence_letters(sentence) for sentence in split_spoken_sentences(words)]
            return [(word.text, [tuple(word.phones)]) for word in words], sentences
        spoken = self._words(content)
        if not spoken:
            raise InputError("there is nothing to say in the text; give at least one word")
        if isinstance(content, str):
            text = self._insert_own_words(content)
        else:
            text = " ".join(map(self._bracketed_ipa, spoken))
        aligned = [(word.text, [tuple(segment.phone for segment in word.segments)]) for word in spoken]
        return aligned, self._text_reader.letters(text)

    def _synthesise(self, sentences: Sequence[Sequence[str]], rate: float) -> Waveform:
        parts = [self._network.run(letters, rate) for letters in sentences if letters]
        return Waveform(apply_volume(np.concatenate(parts)), self.sample_rate)

    def _sentence_letters(self, words: Sequence[Word]) -> list[str]:
        """Letters of a sentence; phones that the voice does not have are replaced by the nearest ones."""
        spoken = (english_letters(word_segments(word), self._phones, self._network.letters) for word in words)
        marks = ("".join(mark for mark in word.mark if mark in self._network.letters) for word in words)
        return list(" ".join(letters + mark for letters, mark in zip(spoken, marks, strict=True)))

    def _words(self, content: SpeechInput) -> list[SpokenWord]:
        """Words with phones: those given, of the user's dictionary, or of espeak-ng."""
        if not isinstance(content, str):
            return [part for word in content for part in ([word] if word.segments else self._pronounce(word))]
        check_script(content, self._language)
        written = WORD.findall(content)
        own = {word: self._own_words.get(word.lower()) for word in written}
        words = []
        for text, parts in zip(written, phonemize(written, self._language), strict=True):
            segments = [segment for part in parts for segment in parse_espeak_word(part, self._language)]
            words.append(SpokenWord(text, own[text] or tuple(segments)))
        return [word for word in words if word.segments]

    def _pronounce(self, word: SpokenWord) -> list[SpokenWord]:
        """The spoken words of a written one without given phones."""
        *others, last = self._words(word.text) or [SpokenWord("", ())]
        after = "".join(re.findall("[.,;:!?]+$", word.text)) + word.after
        return [*others, SpokenWord(last.text, last.segments, after)] if last.segments else []

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
        marks = "".join(mark for mark in word.after if mark in self._network.letters)
        return f"[[{written}{marks}]]"  # Piper omits punctuation that follows the brackets


def nominal_phones_in(words: Sequence[AlignedWord], seconds: float) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones with nominal durations scaled to a sound, for sound that cannot be aligned (hundreds of equal words)."""
    labels = [phone for _, (phones,) in words for phone in phones]
    shares = np.cumsum([0.0, *(NOMINAL_S[PHONES[phone].kind] for phone in labels)])
    spans, first = [], 0
    for text, (phones,) in words:
        spans.append(WordSpan(text, first, first + len(phones)))
        first += len(phones)
    return PhoneSequence(labels, seconds * shares / shares[-1]), tuple(spans)


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
