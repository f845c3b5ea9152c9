"""Forced alignment of the phones of a known text with a recording of it.

A phone recogniser finds when each phone is heard (`tts2face.sound.spikes`), and a classifier to which phone each frame
of 5 ms belongs. A search over all divisions of the sound (`tts2face.sound.segments`) adds to both how long phones last.
Words that are not said are left out, and sounds that are not written are stepped over.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.phones import look_up_phone
from lexicon.sequence import DOUBTFUL, SILENCE, PhoneSequence, WordSpan, concatenate_phones, enforce_increasing
from tts2face.models.phone_classifier import PhoneClassifier, load_phone_classifier
from tts2face.numeric.arrays import FloatArray, ordered_product, true_runs
from tts2face.sound.pauses import Span
from tts2face.sound.recogniser import ENGLISH, FEATURES, FRAME_S, Heard, PhoneRecogniser, levelled
from tts2face.sound.segments import STEP_S, divide, frame_features
from tts2face.sound.spikes import NEVER, UNSAID, find_spikes
from tts2face.sound.word_lattice import PlacedPhone, PronouncedWords, Pronunciations, place_phones, word_segments
from tts2face.types import Waveform

# seconds around a frame at which the recogniser's output is read: its spikes are late by 35 ms (mean)
CONTEXT_S = (-0.12, -0.08, -0.05, -0.03, -0.015, 0.0, 0.015, 0.03, 0.045, 0.06, 0.08, 0.11, 0.15, 0.19)
LEAST_LOG, LOG_SPREAD = -10.0, 5.0  # log probabilities of the recogniser as features
# Chosen on a voice that the classifier has not heard, in noise; docs/decisions/193-alignment.md
FRAME_WEIGHT = 0.15  # of log probabilities of frames: neighbouring ones are not independent
LEAST_FRAME, PASSED_OVER = -12.0, -6.0  # of a frame; of one of a silence in which something else is heard
OF_ITS_CLASS, SOUNDING = 0.1, 0.01  # shares of a phone in the probability of those like it, and of all sound
SONORANTS = frozenset({"nasal", "lateral", "approximant", "tap", "trill"})
# seconds and level of the noise around a sound: an abrupt start is heard as a stop
PADDING_S, PADDING_LEVEL = 0.1, 3e-4
USUAL_DELAY_S = 0.035  # of spikes behind the middles of phones
LEAST_FIT = 0.6  # of a right text; docs/decisions/193-alignment.md
LEFT_OUT = 0.1  # confidence below which words are left out
LEAST_SAID = 0.8  # mean confidence of all others; in noise it is lower, and no word is left out
N_LEFT_OUT = 6  # phones at least of successive words that are left out
N_UNWRITTEN = 5  # phones heard in a silence
WORDS_SHOWN = 8


@dataclass(frozen=True, slots=True)
class TextMismatch:
    """Words that a recording probably does not contain and the seconds where they would be, or speech without words."""

    begin: float
    end: float
    words: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """Warning for the user, one line."""
        where = f"from {self.begin:.1f} to {self.end:.1f} s"
        if not self.words:
            return f"speech {where} is not in the text; add its words"
        return f"the text does not fit the recording {where} ({_shown(self.words)}); check the words"

    def shift(self, seconds: float) -> "TextMismatch":
        """The same mismatch, later by `seconds`."""
        return replace(self, begin=self.begin + seconds, end=self.end + seconds)


@dataclass(frozen=True, slots=True)
class Fit:
    """Numbers of phones: ``written`` in the text, of which are ``said``; and all ``heard``."""

    written: float = 0.0
    said: float = 0.0
    heard: float = 0.0

    @property
    def share(self) -> float:
        """Of the text that is said, or of what is heard that is written, whichever is more.

        In noise little is heard, and of an incomplete text much is not written; of a wrong one both are low.
        """
        return max(self.said / max(self.written, 1.0), min(self.said / max(self.heard, 1.0), 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Result of a forced alignment.

    Parameters
    ----------
    phones
        Phones from 0 s to the end of the sound.
    words
        Spans of phones of the words that are said, with the probability that they are.
    fit
        How much of the text is said, and of the sound written.
    mismatches
        Words that are not said, and speech that is not written.
    """

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    fit: Fit
    mismatches: tuple[TextMismatch, ...]

    def check(self) -> None:
        """Raise DataError if the recording does not contain the text."""
        if self.fit.share < LEAST_FIT:
            missing = [word for mismatch in self.mismatches for word in mismatch.words]
            raise DataError(
                "the recording does not contain this text: "
                f"{self.fit.said / max(self.fit.written, 1):.0%} of its phones "
                f"are heard (not: {_shown(missing) or 'single words'}); check the words"
            )


Align = Callable[..., Alignment]  # of a sound, its words and, where they are known, their times: `Aligner.align`


def join_alignments(parts: Sequence[Alignment]) -> Alignment:
    """Alignment of a sound from those of its parts, one after another."""
    phones, words = concatenate_phones([part.phones for part in parts], [part.words for part in parts])
    starts = np.cumsum([0.0, *(part.phones.end for part in parts)])
    fit = Fit(*(sum(getattr(part.fit, field.name) for part in parts) for field in fields(Fit)))
    mismatches = [
        mismatch.shift(float(start)) for part, start in zip(parts, starts, strict=False) for mismatch in part.mismatches
    ]
    return Alignment(phones, words, fit, tuple(mismatches))


def unwritten_part(sound: Waveform, n_heard: int) -> Alignment:
    """Alignment of a sound of which no word is written, in which a number of phones are heard."""
    mismatches = (TextMismatch(0.0, sound.duration, ()),) if n_heard >= N_UNWRITTEN else ()
    return Alignment(PhoneSequence([SILENCE], [0.0, sound.duration]), (), Fit(heard=float(n_heard)), mismatches)


@dataclass(frozen=True, slots=True, eq=False)
class HeardSound:
    """A sound, and what the recogniser hears in it after `_padded`."""

    sound: Waveform
    heard: Heard

    def words(self) -> tuple[tuple[str, ...], ...]:
        """The most probable phones of each word."""
        return self.heard.words()


class Aligner:
    """Forced aligner, whose models are loaded when they are first used; thread-safe.

    Parameters
    ----------
    classifier
        None: the shipped one.
    """

    def __init__(self, classifier: PhoneClassifier | None = None) -> None:
        self._given = classifier

    def load(self) -> None:
        """Load the models, for instance before a process forks."""
        _ = self.recogniser, self._classifier

    @cached_property
    def recogniser(self) -> PhoneRecogniser:
        """Recogniser of phones."""
        return PhoneRecogniser()

    @cached_property
    def _classifier(self) -> PhoneClassifier:
        return self._given or load_phone_classifier("recordings")

    def hear(self, sound: Waveform) -> HeardSound:
        """Phones that are heard in a sound, which is aligned without being heard again."""
        return HeardSound(sound, self.recogniser.hear(_padded(sound)))

    def align(
        self,
        sound: Waveform | HeardSound,
        words: PronouncedWords | None,
        times: Sequence[Span] | None = None,
        *,
        may_lack: bool = False,
    ) -> Alignment:
        """Align the phones of words with a sound.

        Parameters
        ----------
        words
            Each written word with its alternative pronunciations, of which the best fitting one is chosen; None: what
            is heard, as phones between slashes.
        times
            Begins and ends of the words in seconds, if they are known.
        may_lack
            Whether the sound may lack words, which are then left out; a voice says all of them.

        Raises
        ------
        DataError
            There is no word, the sound is too short for them, or no speech is heard.
        """
        if words is not None and not words:
            raise DataError("there is no word to align; give a transcript")
        known = sound if isinstance(sound, HeardSound) else self.hear(sound)
        duration = known.sound.duration
        if words is None:
            # without a transcript the heard phones are placed as those of a text (decision 194)
            words = [(f"/{''.join(word)}/", [word]) for word in known.words()]
        if not words:
            raise DataError("the sound contains no speech; give a recording of a person who speaks")
        labels = (*FEATURES, *sorted(_phones_in(words) - ENGLISH))
        heard = known.heard.log_probabilities(labels)
        english = heard[:, [*range(len(FEATURES)), len(labels)]]
        # the last frame has its middle at the end of the sound
        frames = self._classifier.log_probabilities(recording_features(_padded(known.sound), english))[:-1]
        number = {label: at for at, label in enumerate(labels)}
        columns = [[[number[phone] for phone in phones] for phones in alternatives] for _, alternatives in words]
        confidence = _confidence(find_spikes(heard, columns, UNSAID), words)
        kept = _is_kept(confidence, words) if may_lack else np.ones(len(words), bool)
        said = [word for word, is_said in zip(words, kept, strict=True) if is_said]
        spikes = find_spikes(heard, [column for column, is_said in zip(columns, kept, strict=True) if is_said], NEVER)
        chosen = self._choose(frames, [alternatives for _, alternatives in said], spikes, times)
        if not chosen:
            raise DataError(f"the sound of {duration:.2f} s is too short for {len(words)} words; check the words")
        phones, spans = _sequence(chosen, [text for text, _ in said], confidence[kept], duration)
        # times count from the sound, which begins after the padding
        places = spike_times(heard) - PADDING_S
        lengths = np.array([len(alternatives[0]) for _, alternatives in words])
        fit = Fit(float(lengths.sum()), float(lengths @ confidence), float(len(places)))
        found = (*_unheard(words, confidence, kept, phones, spans), *_unwritten(phones, places))
        return Alignment(phones, spans, fit, tuple(sorted(found, key=lambda mismatch: mismatch.begin)))

    def _choose(
        self, frames: FloatArray, words: Sequence[Pronunciations], spikes: FloatArray, times: Sequence[Span] | None
    ) -> list[tuple[PlacedPhone | None, float, float]]:
        """Phones of the best division of a sound, None for silences, each with its start and end in seconds."""
        silence = self._classifier.inventory.index(SILENCE)
        frames = np.maximum(_lenient(frames, self._classifier.inventory), LEAST_FRAME)
        frames[:, silence] = np.maximum(frames[:, silence], PASSED_OVER)
        placed, padding = place_phones(self._classifier, words, spikes), PADDING_S
        known = times and [(start + padding, end + padding) for start, end in times]
        segments, phones = word_segments(self._classifier, placed, len(frames), known)
        found = divide(FRAME_WEIGHT * frames, segments)
        end = len(frames) * STEP_S - 2 * padding
        seconds = [(phones[at], _seconds(start), _seconds(last)) for at, start, last in found]
        return [span for span in seconds if span[0] is not None or (span[2] > STEP_S and span[1] < end - STEP_S)]


def _lenient(frames: FloatArray, inventory: Sequence[str]) -> FloatArray:
    """Log probabilities (T, P) of frames, in which a phone may also be heard as another vowel, sonorant or obstruent.

    The end of a diphthong is a vowel of its own, and a voice that the classifier has not learnt is often misheard;
    then a phone differs from a pause only in that there is a sound.
    """
    classes = np.array([_class_of(label) for label in inventory])
    sounds = classes != SILENCE
    alike = (classes[:, None] == classes) & sounds
    shares = OF_ITS_CLASS * alike + SOUNDING * (sounds[:, None] & sounds)
    # a phone counts whole; others of its class and all sound by their shares (decision 197)
    np.fill_diagonal(shares, 1.0)
    # `@` would add in an order that depends on the threads of BLAS (decision 022)
    found: FloatArray = np.log(ordered_product(np.exp(frames), shares) + np.finfo(np.float64).tiny)
    return found


def _class_of(label: str) -> str:
    """Of phones that are taken for each other."""
    if label == SILENCE:
        return SILENCE
    phone = look_up_phone(label)
    return "vowel" if phone.is_vowel else "sonorant" if phone.kind in SONORANTS else "obstruent"


def _phones_in(words: PronouncedWords) -> set[str]:
    return {phone for _, alternatives in words for phones in alternatives for phone in phones}


def _padded(sound: Waveform) -> Waveform:
    """The sound at its level, with quiet noise before and after it: an abrupt start is heard as a stop."""
    sound = levelled(sound)
    quiet = np.random.default_rng(0).normal(0.0, PADDING_LEVEL, round(PADDING_S * sound.rate)).astype(np.float32)
    return Waveform(np.concatenate([quiet, sound.samples, quiet]), sound.rate)


def recording_features(sound: Waveform, heard: NDArray[np.float32]) -> NDArray[np.float32]:
    """Features (T, K) of frames of `STEP_S`: the spectrum, and what the recogniser hears (T', P + 1) around them."""
    spectrum = frame_features(sound, is_recording=True)
    places = np.arange(len(spectrum))[:, None] * (STEP_S / FRAME_S) + np.array(CONTEXT_S) / FRAME_S - 0.5
    lows = np.clip(np.floor(places).astype(np.int64), 0, len(heard) - 1)
    shares = np.clip(places - lows, 0.0, 1.0)[..., None].astype(np.float32)
    scaled = np.maximum(heard, LEAST_LOG) / np.float32(LOG_SPREAD) + 1.0
    around = scaled[lows] * (1.0 - shares) + scaled[np.minimum(lows + 1, len(heard) - 1)] * shares
    return np.concatenate([spectrum, around.reshape(len(spectrum), -1)], axis=1, dtype=np.float32)


def spike_times(heard: NDArray[np.float32]) -> FloatArray:
    """Seconds at which the most probable phones begin in log probabilities (T, P + 1)."""
    best = heard.argmax(axis=1)
    is_new = (best != heard.shape[1] - 1) & (best != np.concatenate([[-1], best[:-1]]))
    return np.flatnonzero(is_new).astype(np.float64) * FRAME_S + FRAME_S / 2 - USUAL_DELAY_S


def _confidence(spikes: FloatArray, words: PronouncedWords) -> FloatArray:
    """Probabilities (W,) that words are said: the sums of those of their pronunciations."""
    totals, at = spikes.sum(axis=0), 0
    found: FloatArray = np.zeros(len(words))
    for word, (_, alternatives) in enumerate(words):
        for phones in alternatives:
            found[word] += totals[at]
            at += len(phones)
    sure: FloatArray = np.minimum(found, 1.0)
    return sure


def _runs(chosen: NDArray[np.bool_], words: PronouncedWords, least: int) -> list[tuple[int, int]]:
    """Ranges of successive chosen words that have at least so many phones together."""
    lengths = [len(alternatives[0]) for _, alternatives in words]
    return [(int(first), int(last)) for first, last in true_runs(chosen) if sum(lengths[first:last]) >= least]


def _is_kept(confidence: FloatArray, words: PronouncedWords) -> NDArray[np.bool_]:
    """Whether words (W,) are said; a short word alone is easily misheard, and so are all words in noise."""
    kept = np.ones(len(words), bool)
    for first, last in _runs(confidence < LEFT_OUT, words, N_LEFT_OUT):
        kept[first:last] = False
    if not kept.any() or confidence[kept].mean() < LEAST_SAID:
        kept[:] = True
    return kept


def _sequence(
    chosen: "Sequence[tuple[PlacedPhone | None, float, float]]",
    texts: Sequence[str],
    confidence: FloatArray,
    duration: float,
) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones from 0 s to the end, and the words of them."""
    labels = [SILENCE if phone is None else phone.label for phone, *_ in chosen]
    # a silence of a step before the first phone is left out: that phone begins with the sound
    edges = np.array([0.0, *(max(start, 0.0) for _, start, _ in chosen[1:]), duration])
    of_word: list[list[int]] = [[] for _ in texts]
    for at, (phone, *_) in enumerate(chosen):
        if phone is not None:
            of_word[phone.word].append(at)
    spans = (
        WordSpan(text, places[0], places[-1] + 1, float(value))
        for text, places, value in zip(texts, of_word, confidence, strict=True)
    )
    return PhoneSequence(labels, enforce_increasing(edges)), tuple(spans)


def _unheard(
    words: PronouncedWords,
    confidence: FloatArray,
    kept: NDArray[np.bool_],
    phones: PhoneSequence,
    spans: Sequence[WordSpan],
) -> list[TextMismatch]:
    """Successive words that are probably not said, and where they would be."""
    places = np.concatenate([[0], np.cumsum(kept)])  # of the said words before each word
    found = []
    for first, last in _runs(confidence < DOUBTFUL, words, N_LEFT_OUT):
        before, behind = int(places[first]), int(places[last])
        if before < behind:  # some of them have been placed
            start, end = phones.edges[spans[before].first], phones.edges[spans[behind - 1].last]
        else:
            start = phones.edges[spans[before - 1].last] if before else phones.start
            end = phones.edges[spans[behind].first] if behind < len(spans) else phones.end
        found.append(TextMismatch(float(start), float(end), tuple(text for text, _ in words[first:last])))
    return found


def _unwritten(phones: PhoneSequence, heard: FloatArray) -> list[TextMismatch]:
    """Silences of an alignment in which speech is heard."""
    counts = np.histogram(heard, phones.edges)[0]
    return [
        TextMismatch(float(phones.edges[at]), float(phones.edges[at + 1]), ())
        for at, label in enumerate(phones.phones)
        if label == SILENCE and counts[at] >= N_UNWRITTEN
    ]


def _seconds(frame: int) -> float:
    return (frame - 0.5) * STEP_S - PADDING_S


def _shown(words: Sequence[str]) -> str:
    return " ".join(words if len(words) <= WORDS_SHOWN else (*words[:4], "...", *words[-3:]))
