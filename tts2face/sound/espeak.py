"""espeak-ng, a formant synthesiser for all its languages; phone edges follow from its phoneme events.

Labels of the phones that a voice was given, for the times of the sounds that it reports.
"""

import json
import os
import re
import subprocess
import sys
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, SilentTextError
from lexicon.g2p import parse_espeak_word
from lexicon.ipa import IpaPhone
from lexicon.languages import language_code
from lexicon.normalize import spoken_form
from lexicon.pauses import SIMPLE_MARKS
from lexicon.phones import PHONES, nearest_phones, phone_distance
from lexicon.pronounce import Word, has_dictionary
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan, enforce_increasing
from lexicon.vowels import without_vowels
from lexicon.written_words import espeak_text, spaced_words
from tts2face.sound.voice import (
    PronunciationMap,
    SpeechInput,
    SpokenWord,
    apply_volume,
    pronounce_content,
    word_segments,
)
from tts2face.types import Speech, Waveform

CHILD = Path(__file__).with_name("espeak_child.py")
WORD_EVENT, PHONEME_EVENT = 1, 7
ANY_GENDER, FEMALE = 0, 2  # espeak_VOICE.gender; ANY_GENDER selects the male voice if a language has both
LANGUAGE_SWITCH = re.compile(r"\([a-z0-9-]+\)")  # espeak-ng marks where a foreign word begins and ends: (en)...(fr)
DEFAULT_WORDS_PER_MINUTE = 175  # espeak-ng's default; the times of its events are wrong above 400
CHILD_TIMEOUT_S = 60.0  # a sentence takes about 50 ms
MAX_CLOSURE_S = 0.06  # the event of a stop marks its burst; the closure before it lasts 38-46 ms
CLOSED_LEVEL = 0.006  # relative to full scale; closures are digital silence after the decay of the previous phone
QUIET_LEVEL = 0.03  # relative to full scale; residual level of the previous phone in a pause
LEVEL_WINDOW_S = 0.001
# seconds; a shorter start without a phone belongs to the first phone
MIN_EVENT_PAUSE_S = 0.03
MAX_WORD_PHONES = 80  # espeak-ng crashes on words of 300
EDGE_SILENCE_S = 0.25  # silence added at both ends, because lips start to move before the sound does
# espeak-ng's phoneme mnemonics for [[...]] input (docs/phonemes.md of espeak-ng).
MNEMONICS = MappingProxyType({
    "ɑ": "A:", "æ": "a", "ʌ": "V", "ɔ": "O:", "aʊ": "aU", "aɪ": "aI", "ɛ": "E", "ɝ": "3:", "eɪ": "eI", "ɪ": "I",
    "i": "i:", "oʊ": "oU", "ɔɪ": "OI", "ʊ": "U", "u": "u:", "ə": "@", "ɚ": "3", "b": "b", "tʃ": "tS", "d": "d",
    "ð": "D", "f": "f", "ɡ": "g", "h": "h", "dʒ": "dZ", "k": "k", "l": "l", "m": "m", "n": "n", "ŋ": "N", "p": "p",
    "ɹ": "r", "s": "s", "ʃ": "S", "t": "t", "θ": "T", "v": "v", "w": "w", "j": "j", "z": "z", "ʒ": "Z",
})  # fmt: skip
BRITISH_MNEMONICS = MappingProxyType(
    {phone: mnemonic for phone, mnemonic in MNEMONICS.items() if phone not in {"æ", "oʊ", "ɝ", "ɚ"}}
    | {"a": "a", "ɒ": "0", "ɜ": "3:", "əʊ": "oU", "eə": "e@", "ɪə": "i@", "ʊə": "U@"}
)
_MNEMONICS = MappingProxyType({"en-us": MNEMONICS, "en-gb": BRITISH_MNEMONICS})
STRESS_MARKS = MappingProxyType({1: "'", 2: ","})


def match_phones(given: Sequence[str], reported: Sequence[str]) -> tuple[tuple[int, int], ...]:
    """Cheapest monotone matching of given phones with reported ones, each with at least one.

    A formant synthesiser reports its own variants (a flap for /t/), splits phones (ɝ as ɜ ɹ) and joins them (l ɹ).

    Parameters
    ----------
    given, reported
        N and M phones of the table, at least one each.

    Returns
    -------
    pairs of indices
        From (0, 0) to (N - 1, M - 1), neither falling.
    """
    cost = np.array([[_cost(own, other) for other in reported] for own in given])
    total = np.full((len(given) + 1, len(reported) + 1), np.inf)
    total[0, 0] = 0.0
    for i in range(len(given)):
        for k in range(len(reported)):
            total[i + 1, k + 1] = cost[i, k] + min(total[i, k], total[i, k + 1], total[i + 1, k])
    i, k = len(given) - 1, len(reported) - 1
    path = [(i, k)]
    while (i, k) != (0, 0):
        steps = [(total[i, k], i - 1, k - 1), (total[i, k + 1], i - 1, k), (total[i + 1, k], i, k - 1)]
        _, i, k = min(step for step in steps if step[1] >= 0 and step[2] >= 0)
        path.append((i, k))
    return tuple(reversed(path))


def _cost(given: str, reported: str) -> float:
    """Distance of two phones; none between a rhotic vowel and the ɹ that is reported as its second half."""
    return 0.0 if given in {"ɝ", "ɚ"} and reported == "ɹ" else phone_distance(given, reported)


def given_starts(given: Sequence[str], reported: Sequence[str], starts: Sequence[float], end: float) -> list[float]:
    """Start in seconds of each given phone, from the starts of the reported phones and the end of the last.

    Given phones that share a reported one divide its time equally.
    """
    path = match_phones(given, reported)
    ends = [*starts[1:], end]
    found = []
    for number in range(len(given)):
        first = next(k for i, k in path if i == number)
        sharers = [i for i, k in path if k == first]
        share = sharers.index(number) / len(sharers)
        found.append(starts[first] + share * (ends[first] - starts[first]))
    for number in reversed(range(1, len(found))):
        following = found[number + 1] if number + 1 < len(found) else end
        if found[number] >= following:  # reported without duration (the l of bottle): half of the phone before it
            found[number] = (found[number - 1] + following) / 2
    return found


@dataclass(frozen=True, slots=True)
class _SpokenWord:
    """A word and its phones."""

    text: str
    phones: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _PhonemeEvent:
    """A phoneme event: its phones, its start in seconds, and the index of its word (-1 for none)."""

    phones: tuple[str, ...]
    start: float
    word: int


class EspeakVoice:
    """A voice of espeak-ng at 22.05 kHz; each call of `speak` starts a child process."""

    def __init__(self, language: str, own_words: PronunciationMap, *, is_female: bool = False) -> None:
        self._language, self._own_words = language_code(language), own_words
        self._gender = FEMALE if is_female else ANY_GENDER
        self._rate = 22050

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return self._rate

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.sound.voice.Voice`. The voice is deterministic: `seed` is unused."""
        text, words = self._espeak_text(content)
        header, samples = _run_child({
            "text": text, "language": self._language, "gender": self._gender, "has_phonemes": "[[" in text,
            "words_per_minute": round(DEFAULT_WORDS_PER_MINUTE * rate), "parent": os.getpid(),
        })  # fmt: skip
        sound = np.pad(samples / np.float32(32768), round(EDGE_SILENCE_S * self._rate)).astype(np.float32)
        events = self._phoneme_events(header, sound)
        if not any(phone != SILENCE for event in events for phone in event.phones):
            raise SilentTextError(f"there is nothing to say in {text[:40]!r}; give at least one word")
        if has_dictionary(self._language):
            events = _assign_words_by_place(events, header, text)
        else:
            events = _assign_words_by_phones(events, [word.phones for word in words])
        events = _relabel_events(events, [word.phones for word in words], len(sound) / self._rate)
        phones, spans = _phone_sequence(events, [word.text for word in words], len(sound) / self._rate)
        return Speech(Waveform(apply_volume(sound), self._rate), phones, spans)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound of `speak`; see `tts2face.sound.voice.Voice`."""
        return self.speak(content, rate=rate, seed=seed).waveform

    def _espeak_text(self, content: SpeechInput) -> tuple[str, list[_SpokenWord]]:
        """Input text for espeak-ng, and its words with their phones.

        English is spoken by the phones of `lexicon`, other languages by those of espeak-ng, but for words with given
        phones.
        """
        spoken = pronounce_content(content, self._language, self._own_words)
        if has_dictionary(self._language):
            parts = [part for word in spoken for part in _short_words(word)]
            given = [tuple(segment.phone for segment in part.segments) for part in parts]
            words = [_SpokenWord(part.text, phones) for part, phones in zip(parts, given, strict=True)]
            return " ".join(_word_mnemonic(part, _MNEMONICS[self._language]) for part in parts), words
        words = [_SpokenWord(word.text, word.phones) for word in spoken]
        if isinstance(content, str):
            plain = _without_brackets(spoken_form(content, self._language))
            pieces = spaced_words(plain, self._language)
            if not any(map(self._look_up, pieces)):
                return espeak_text(plain, self._language), words
            content = [SpokenWord(word, ()) for word in pieces]
        written = [word if word.segments else self._pronounce(word) for word in content]
        return " ".join(map(_word_mnemonic, written)), words

    def _look_up(self, word: str) -> tuple[IpaPhone, ...] | None:
        return self._own_words.get(without_vowels(word.strip(".,;:!?\"'()"), self._language).lower())

    def _pronounce(self, word: SpokenWord) -> SpokenWord:
        """A word with its phones in the user's dictionary, or without phones."""
        text = "".join(_without_brackets(word.text).split())
        own = self._look_up(text)
        return (
            SpokenWord(text, own, word.after) if own else SpokenWord(espeak_text(text, self._language), (), word.after)
        )

    def _phoneme_events(self, header: Mapping[str, Any], sound: NDArray[np.float32]) -> list[_PhonemeEvent]:
        found: list[_PhonemeEvent] = []
        n_words = 0
        for kind, sample, value in header["events"]:
            if kind == WORD_EVENT:
                n_words += 1
                continue
            ipa = LANGUAGE_SWITCH.sub("", value)
            phones = tuple(segment.phone for segment in parse_espeak_word(ipa, self._language)) if ipa else ()
            at = sample + round(EDGE_SILENCE_S * self._rate)
            start = at / self._rate
            if phones and PHONES[phones[0]].kind in {"stop", "affricate"}:
                start = _closure_start(sound, at, self._rate)
            found.append(_PhonemeEvent(phones or (SILENCE,), start, n_words - 1))
        return _drop_false_silences(found, sound, self._rate)


def _assign_words_by_place(found: Sequence[_PhonemeEvent], header: Mapping[str, Any], text: str) -> list[_PhonemeEvent]:
    """Events with indices of the space-separated words instead of espeak-ng's own, which splits and joins words."""
    starts = [0, *(match.end() for match in re.finditer(" ", text))]
    owners = [bisect_right(starts, value[0]) - 1 for kind, _, value in header["events"] if kind == WORD_EVENT]
    return [replace(event, word=owners[event.word] if event.word >= 0 else -1) for event in found]


def _assign_words_by_phones(found: Sequence[_PhonemeEvent], given: Sequence[Sequence[str]]) -> list[_PhonemeEvent]:
    """Events with indices of the words to which their phones belong, since espeak-ng's places are wrong in numbers."""
    owners = [word for word, phones in enumerate(given) for _ in phones]
    expected = [phone for phones in given for phone in phones]
    reported = [phone for event in found for phone in event.phones if phone != SILENCE]
    pairs = enumerate(range(len(expected))) if expected == reported else reversed(match_phones(expected, reported))
    matched = {k: owners[i] for i, k in pairs}
    found_words: list[int] = []
    at = 0
    for event in found:  # a silence belongs to the word before it, which may go on behind it
        is_silent = event.phones == (SILENCE,)
        found_words.append((found_words or [-1])[-1] if is_silent else matched[at])
        at += 0 if is_silent else len(event.phones)
    return [replace(event, word=word) for event, word in zip(found, found_words, strict=True)]


def _relabel_events(
    events: Sequence[_PhonemeEvent], given: Sequence[tuple[str, ...]], duration: float
) -> list[_PhonemeEvent]:
    """Events with the phones that their words were given, where espeak-ng reports its own variants of them."""
    if not any(given):
        return list(events)
    found: list[_PhonemeEvent] = []
    ends = [*(event.start for event in events[1:]), duration]
    for word, group in groupby(zip(events, ends, strict=True), key=lambda pair: pair[0].word):
        parts = [(event, end) for event, end in group if event.phones != (SILENCE,)]
        phones = given[word] if 0 <= word < len(given) else ()
        if not phones or not parts:
            found += [event for event, _ in parts]
            continue
        reported = [phone for event, _ in parts for phone in event.phones]
        starts = [
            event.start + at * (end - event.start) / len(event.phones)
            for event, end in parts
            for at in range(len(event.phones))
        ]
        own = given_starts(phones, reported, starts, parts[-1][1])
        found += [_PhonemeEvent((phone,), start, word) for phone, start in zip(phones, own, strict=True)]
    # one without duration comes before a closure that begins earlier than it
    silences = [
        event for event, end in zip(events, ends, strict=True) if event.phones == (SILENCE,) and end > event.start
    ]
    return sorted([*silences, *found], key=lambda event: event.start)


def _drop_false_silences(found: Sequence[_PhonemeEvent], sound: NDArray[np.float32], rate: int) -> list[_PhonemeEvent]:
    """Remove events without a phone during which the sound is not quiet (modifiers of the last phone, such as ʲ)."""
    ends = [event.start for event in found[1:]] + [len(sound) / rate]
    return [
        event
        for event, end in zip(found, ends, strict=True)
        if event.phones != (SILENCE,)
        or float(np.abs(sound[round(event.start * rate) : round(end * rate)]).max(initial=0.0)) < QUIET_LEVEL
    ]


def _short_words(word: Word) -> list[SpokenWord]:
    """A word, or its parts if espeak-ng cannot store it."""
    segments = word_segments(word)
    starts = range(0, len(segments), MAX_WORD_PHONES)
    parts = [SpokenWord(word.text, segments[start : start + MAX_WORD_PHONES]) for start in starts]
    return [*parts[:-1], replace(parts[-1], after=SIMPLE_MARKS.get(word.mark, word.mark))]


def _without_brackets(text: str) -> str:
    return text.replace("[[", " ").replace("]]", " ")


def _word_mnemonic(word: SpokenWord, mnemonics: Mapping[str, str] = MNEMONICS) -> str:
    if not word.segments:
        return word.text + word.after
    return f"[[{''.join(_segment_mnemonic(segment, mnemonics) for segment in word.segments)}]]{word.after}"


def _segment_mnemonic(segment: IpaPhone, mnemonics: Mapping[str, str]) -> str:
    phones = nearest_phones(segment.phone, mnemonics.keys())
    return STRESS_MARKS.get(segment.stress, "") + "".join(mnemonics[phone] for phone in phones)


def _run_child(request: Mapping[str, Any]) -> tuple[dict[str, Any], NDArray[np.int16]]:
    try:
        answer = subprocess.run(
            # a process for each sentence: the library is not repeatable within one (decision 005)
            [sys.executable, "-I", str(CHILD)],
            input=json.dumps(request).encode(),
            capture_output=True,
            timeout=CHILD_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as late:
        raise BackendError(f"espeak-ng did not answer within {CHILD_TIMEOUT_S:.0f} s; try a shorter text") from late
    # a crash of the library ends the child alone
    if answer.returncode < 0:
        raise BackendError(
            f"espeak-ng crashed (signal {-answer.returncode}) on {str(request['text'])[:40]!r}; "
            "change the spelling, or choose another voice"
        )
    if answer.returncode != 0:
        reason = answer.stderr.decode("utf-8", "replace").strip().splitlines()[-1:] or [f"exit {answer.returncode}"]
        raise BackendError(f"espeak-ng failed ({reason[0]}); reinstall espeakng-loader")
    head, _, content = answer.stdout.partition(b"\n")
    header: dict[str, Any] = json.loads(head)
    if "error" in header:
        raise BackendError(f"{header['error']}; reinstall espeakng-loader")
    return header, np.frombuffer(content, "<i2")


def _closure_start(sound: NDArray[np.float32], burst: int, rate: int) -> float:
    """Start in seconds of the silence before a stop's burst, at most `MAX_CLOSURE_S` before it."""
    window = max(1, round(LEVEL_WINDOW_S * rate))
    earliest = max(0, burst - round(MAX_CLOSURE_S * rate))
    at = burst
    # the event marks the burst, and the closure belongs to the stop (decision 005)
    while at - window >= earliest and float(np.abs(sound[at - window : at]).max()) < CLOSED_LEVEL:
        at -= window
    return at / rate


def _phone_sequence(
    events: Sequence[_PhonemeEvent], words: Sequence[str], duration: float
) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Convert events to contiguous phones; the phones of one event have equal durations."""
    ends = [event.start for event in events[1:]] + [duration]
    labels: list[str] = []
    starts: list[float] = []
    owners: list[int] = []
    if events[0].start > MIN_EVENT_PAUSE_S and events[0].phones != (SILENCE,):
        labels = [SILENCE]
        starts = [0.0]
        owners = [-1]
    for event, end in zip(events, ends, strict=True):
        # marks without duration join the phone before them (decision 005)
        if end <= event.start or (event.phones == (SILENCE,) and labels[-1:] == [SILENCE]):
            continue
        length = (end - event.start) / len(event.phones)
        for number, phone in enumerate(event.phones):
            labels.append(phone)
            starts.append(event.start + number * length)
            owners.append(event.word if phone != SILENCE else -1)
    edges = np.array([*starts, duration])
    # a first phone within `MIN_EVENT_PAUSE_S` starts with the sound
    edges[0] = 0.0
    spans = []
    for word in sorted(set(owners) - {-1}):
        indices = [at for at, owner in enumerate(owners) if owner == word]
        spans.append(WordSpan(words[min(word, len(words) - 1)], indices[0], indices[-1] + 1))
    return PhoneSequence(labels, enforce_increasing(edges)), tuple(spans)
