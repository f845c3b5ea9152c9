"""Protocol of all voices, and the types of their input.

Pronunciation of what a voice is given: text, or words some of which have phones.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from lexicon.dictionary import Dictionary
from lexicon.given_phones import TextWord, pronounce_words
from lexicon.ipa import IpaPhone
from lexicon.phones import PHONES
from lexicon.pronounce import Word, pronounce
from lexicon.tones import EVEN, Tone
from tts2face.types import Speech, Waveform

if TYPE_CHECKING:
    from tts2face.sound.alignment import Align

SENTENCE_MARKS = frozenset(".!?")


@dataclass(frozen=True, slots=True)
class SpokenWord:
    """A written word with its phones; `after` is the punctuation that follows it, `tone` how it is said.

    If `segments` is empty, the voice determines the pronunciation.
    """

    text: str
    segments: tuple[IpaPhone, ...]
    after: str = ""
    tone: Tone = EVEN


SpeechInput = str | Sequence[SpokenWord]  # text, or phones word by word
PronunciationMap = Mapping[str, tuple[IpaPhone, ...]]  # pronunciations of a user's words, by lower-case spelling


# Waits for the result of another thread.
Wait = Callable[[Future[Any]], Any]
# Runs a long computation of native code and returns its result; the second function ends it early, from another thread.
NativeRun = Callable[[Callable[[], Any], Callable[[], None]], Any]


class Voice(Protocol):
    """A voice that synthesises text or phones.

    A new voice:

    1. A class with the members of this one in a module of `tts2face.sound`; `VoiceSetting` gives it language, words of
       the user, and the finder of phone edges for voices that report none.
    2. A function that makes it of a `VoiceSetting`, and a row of `tts2face.sound.shipped_voices.SHIPPED_VOICES` with
       its `VoiceInfo`: languages, package, sex and licence. Flags, lists and HTTP follow.
    3. A sentence of it in `tests/sound/test_voices.py`: equal arguments give equal bytes, edges lie at its sounds.

    A voice of another package is an entry point (docs/plugins.md) and needs no row.
    """

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence.

        Parameters
        ----------
        content
            Text, or words with their phones.
        rate
            Factor of the speaking rate.
        seed
            Seed of random numbers, for voices that use any.

        Returns
        -------
        Speech
            Sound, phones and words; the last phone ends with the last sample. Equal arguments give equal bytes.

        Raises
        ------
        InputError
            The content has no word, or characters that this voice cannot speak.
        """

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound of `speak` alone, which some voices compute sooner; arguments and errors as `speak`."""


@runtime_checkable
class ExpectingVoice(Protocol):
    """A voice that takes its time without work of this machine, and may be asked ahead."""

    def expect(self, content: SpeechInput) -> None:
        """Begin with a sentence that will be spoken soon, at rate 1."""


@dataclass(frozen=True, slots=True)
class VoiceSetting:
    """Language and text for which a voice is made.

    Parameters
    ----------
    language
        Code of `lexicon.languages`.
    own_words
        A user's pronunciations, which take precedence over those of the voice.
    align
        Finds the phone edges of sound, for voices that report none; None: the voice makes its own
        (`tts2face.sound.alignment.Aligner`).
    run
        Runs the model of the voice, during which other requests have their turns; None: within the call.
    wait
        Waits for another machine, during which they have their turns, too.
    """

    language: str
    own_words: PronunciationMap = field(default_factory=dict)
    align: "Align | None" = None
    run: NativeRun | None = None
    wait: Wait = Future.result


@dataclass(frozen=True, slots=True)
class VoiceInfo:
    """A voice before it is loaded.

    Parameters
    ----------
    make
        Makes the voice; imports what it needs when it is called.
    package
        Module that must be installed for it.
    sex
        As listed: female, male, or "-".
    languages
        Codes that it speaks; empty: all of espeak-ng.
    accent
        Code of the language whose accent it has; empty: that of each.
    has_files
        Whether the files that it needs beside its package are there; None: it needs none.
    pitch_hz
        Median of its F0 in read sentences, by which pitches in Hz become semitones; None: not known.
    """

    summary: str
    make: Callable[[VoiceSetting], Voice]
    engine: str
    package: str
    sex: str
    licence: str
    languages: tuple[str, ...] = ()
    accent: str = ""
    has_files: Callable[[], bool] | None = None
    pitch_hz: float | None = None


def apply_volume(samples: NDArray[np.floating], volume: float = 1.0) -> NDArray[np.float32]:
    """Samples (n,) times a factor, scaled as a whole to [-1, 1] if they exceed full scale."""
    amplified = np.asarray(samples, np.float32) * np.float32(volume)
    peak = float(np.abs(amplified).max(initial=0.0))
    scaled: NDArray[np.float32] = amplified / np.float32(max(peak, 1.0))
    return np.clip(scaled, -1.0, 1.0)


def pronounce_content(content: SpeechInput, language: str, own_words: PronunciationMap) -> tuple[Word, ...]:
    """Words with phones, stress and punctuation, as `tts2face phones` prints them.

    Raises
    ------
    InputError
        The content has no word, or characters that the language does not read.
    BackendError
        A word needs espeak-ng, which is not installed.
    """
    own = Dictionary(MappingProxyType(dict(own_words)))
    if isinstance(content, str):
        return pronounce(content, language, own).words
    words = [TextWord(word.text, word.segments, word.after, word.tone) for word in content]
    return pronounce_words(words, language, own)


def word_segments(word: Word) -> tuple[IpaPhone, ...]:
    """Phones of a word with their stress."""
    return tuple(
        IpaPhone(phone, stress, is_syllabic=PHONES[phone].is_vowel)
        for phone, stress in zip(word.phones, word.stress, strict=True)
    )


def split_spoken_sentences(words: Sequence[Word]) -> Iterator[Sequence[Word]]:
    """Words of each sentence: after a full stop, question or exclamation mark, unless a small letter follows."""
    first = 0
    for at, (word, following) in enumerate(zip(words, [*words[1:], None], strict=True), start=1):
        if following is None or (word.mark in SENTENCE_MARKS and not following.text[:1].islower()):
            yield words[first:at]
            first = at
