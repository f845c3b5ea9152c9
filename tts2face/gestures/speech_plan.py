"""Speech of a piece of a clip, for gestures: its sentences, phrases, accents, questions, lists and contrasts.

Where words are known, they and their punctuation decide; in other sound its pauses, loudness and pitch do.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from lexicon.given_phones import TextWord
from lexicon.intonation import WORDS, Movement, movements
from lexicon.pauses import last_mark
from lexicon.phones import PHONES
from lexicon.sequence import SILENCE, WordSpan
from lexicon.text_language import common_words
from tts2face.gestures.prosody import PAUSE_DB, SpeechIntensity, prosody_features, speech_intensity
from tts2face.numeric.arrays import FloatArray, smooth_gaussian
from tts2face.sound.quick_pitch import semitones
from tts2face.sound.retuned import matched_words
from tts2face.types import Speech, Waveform

STEP_S, SMOOTHING_S = 0.025, 0.04  # of loudness and pitch
PHRASE_PAUSE_S, SENTENCE_PAUSE_S = 0.12, 0.45  # silence that ends a phrase, and a sentence whose words are not known
LEAST_PHRASE_S = 0.25  # of sound: shorter ones are noises
LEAST_WORDS = 3  # on either side of a word that begins a clause
CLAUSE_WORDS = frozenset({
    "and", "but", "or", "because", "that", "who", "which", "when", "where", "if", "so", "while", "although", "since",
})  # fmt: skip
# Common words that carry an accent like others.
SPOKEN_OUT = frozenset({"hello", "hi", "yes", "no", "not", "never", "please", "thanks", "good", "why"})
PEAK_GAP_S = 0.35  # of accents that are found in sound
PEAK_DB, PEAK_RANGE_DB = -8.0, 6.0
MEAN_PROMINENCE, PROMINENCE_SPREAD = 0.5, 0.6  # of the vowels of a sentence
MOST_PROMINENT = 1.6
LEAST_PROMINENCE, LEAST_GAP_S = 0.15, 0.25  # of an accent, and between two
# Sound whose pitch rises so far in its last instants, compared with that before them (seconds from its end), asks.
RISE_SEMITONES, RISE_S = 3.5, ((0.2, 0.0), (0.7, 0.25))
ASKED_S = 1.6  # at the end of a sentence, in which a question is shown at least
LEAD_S = 0.25  # before its stressed word, from which on it is shown


@dataclass(frozen=True, slots=True)
class Accent:
    """A word on which weight lies: the middle of its vowel in seconds, its prominence (.15 to 1.6) and emphasis."""

    time: float
    prominence: float
    emphasis: float = 0.0


@dataclass(frozen=True, slots=True)
class Span:
    """Seconds from and to."""

    start: float
    end: float

    def shift(self, seconds: float) -> "Span":
        """The same span, later."""
        return Span(self.start + seconds, self.end + seconds)


@dataclass(frozen=True, slots=True)
class SpokenSentence:
    """A sentence in seconds.

    Parameters
    ----------
    phrases
        Adjacent: each ends at a mark, a pause, or before a word that begins a clause.
    accents
        Of its content words.
    question
        In which a question is asked: from its stressed word, or its last words, on.
    rises
        Whether its tune rises at the end.
    items
        Accents of the items of a list.
    sides
        Two things that are set against each other, in pairs.
    is_open
        Whether it goes on in a sound that still arrives: later plans have the same sentence with more of its accents,
        and at last its end.
    """

    span: Span
    phrases: tuple[Span, ...]
    accents: tuple[Accent, ...]
    question: Span | None = None
    rises: bool = False
    items: tuple[float, ...] = ()
    sides: tuple[tuple[Span, Span], ...] = ()
    is_open: bool = False

    def shift(self, seconds: float) -> "SpokenSentence":
        """The same sentence, later."""
        return SpokenSentence(
            self.span.shift(seconds),
            tuple(phrase.shift(seconds) for phrase in self.phrases),
            tuple(replace(accent, time=accent.time + seconds) for accent in self.accents),
            None if self.question is None else self.question.shift(seconds),
            self.rises,
            tuple(item + seconds for item in self.items),
            tuple((denied.shift(seconds), said.shift(seconds)) for denied, said in self.sides),
            self.is_open,
        )


@dataclass(frozen=True, slots=True)
class SpeechPlan:
    """Speech of a piece of a clip, in seconds of it; `is_last` where the clip ends with it.

    `sound` is that from which it was made, in seconds of the piece.
    """

    sentences: tuple[SpokenSentence, ...] = ()
    is_last: bool = False
    sound: "SoundFeatures | None" = field(default=None, repr=False)

    def shift(self, seconds: float) -> "SpeechPlan":
        """The same plan, later."""
        return replace(self, sentences=tuple(sentence.shift(seconds) for sentence in self.sentences))

    @property
    def edges(self) -> tuple[float, ...]:
        """Seconds at which phrases begin or end."""
        phrases = [phrase for sentence in self.sentences for phrase in sentence.phrases]
        return tuple(sorted({edge for phrase in phrases for edge in (phrase.start, phrase.end)}))


NO_PLAN = SpeechPlan()


@dataclass(frozen=True, slots=True, eq=False)
class SoundFeatures:
    """Level (n,) in dB relative to the mean level of speech, and pitch (n,) in semitones, at times (n,) in seconds.

    `intensity` is that from which the level was taken.
    """

    times: FloatArray
    level: FloatArray
    pitch: FloatArray
    intensity: SpeechIntensity | None = None

    @classmethod
    def of(cls, sound: Waveform, intensity: SpeechIntensity | None = None) -> "SoundFeatures":
        """Smoothed features of a sound with its intensity, if it is known; pitch goes on between voiced frames."""
        times = np.arange(0.0, max(sound.duration, STEP_S), STEP_S)
        intensity = intensity or speech_intensity(sound)
        level = prosody_features(sound, times, intensity, with_pitch=False)[:, 0].astype(np.float64)
        return replace(cls.smoothed(times, level, semitones(sound, times)), intensity=intensity)

    @classmethod
    def smoothed(cls, times: FloatArray, level: FloatArray, pitch: FloatArray) -> "SoundFeatures":
        """Features of equal steps of time, smoothed; `pitch` is NaN where there is no voice."""
        voiced = np.isfinite(pitch)
        pitch = np.interp(times, times[voiced], pitch[voiced]) if voiced.any() else np.zeros(len(times))
        spread = SMOOTHING_S / STEP_S if len(times) < 2 else SMOOTHING_S / float(times[1] - times[0])
        level, pitch = (smooth_gaussian(values, spread, round(3 * spread)) for values in (level, pitch))
        return cls(times, level, pitch)

    @property
    def step_s(self) -> float:
        """Seconds between two times."""
        return float(self.times[1] - self.times[0]) if len(self.times) > 1 else STEP_S

    def highest(self, start: float, end: float) -> tuple[float, float]:
        """Greatest level and pitch within a span."""
        inside = slice(*np.searchsorted(self.times, [start, end - 1e-9]).tolist())
        inside = inside if inside.start < inside.stop else slice(max(inside.start - 1, 0), max(inside.start, 1))
        return float(self.level[inside].max()), float(self.pitch[inside].max())


def plan_speech(speech: Speech, script: Sequence[TextWord], language: str, *, is_last: bool = False) -> SpeechPlan:
    """Plan of a piece of speech.

    Parameters
    ----------
    script
        Words that are said, with their punctuation; empty where they are not known.
    is_last
        Whether the clip ends with it.
    """
    if speech.phones.phones == (SILENCE,) and not np.any(speech.waveform.samples):
        return SpeechPlan(is_last=is_last)
    sound = SoundFeatures.of(speech.waveform)
    if not speech.words or not script:
        return SpeechPlan(tuple(heard_sentences(sound)), is_last, sound)
    return SpeechPlan(tuple(_written_sentences(_words(speech, script, sound, language), language)), is_last, sound)


@dataclass(frozen=True, slots=True)
class _Word:
    """A word of the sound: its text in small letters, mark behind it, seconds, its vowel and how prominent it is."""

    text: str
    mark: str
    span: Span
    vowel: float
    prominence: float
    is_content: bool
    emphasis: float


def vowel_scores(speech: Speech, sound: SoundFeatures) -> list[list[tuple[float, float]]]:
    """Prominence and middle in seconds of the vowels of each word, or of the whole word if it has none.

    The prominence is the mean of level, pitch and logarithm of the length in standard deviations from the mean vowel.
    """
    vowels = [_vowels(speech, word) for word in speech.words]
    spans = [span for of_word in vowels for span in of_word]
    features = np.array([[*sound.highest(start, end), np.log(end - start)] for start, end in spans])
    spread = np.maximum(features.std(axis=0), 1e-6)
    scores = iter(((features - features.mean(axis=0)) / spread).mean(axis=1).tolist())
    return [[(next(scores), (start + end) / 2) for start, end in of_word] for of_word in vowels]


def _words(speech: Speech, script: Sequence[TextWord], sound: SoundFeatures, language: str) -> list[_Word]:
    places = matched_words([_letters(word.text) for word in script], [word.text for word in speech.words])
    last_of = {place: at for at, place in enumerate(places) if place is not None}
    is_content, found = content_finder(language), []
    for at, (word, place, vowels) in enumerate(zip(speech.words, places, vowel_scores(speech, sound), strict=True)):
        said = TextWord(word.text) if place is None else script[place]
        score, vowel = max(vowels)
        text, emphasis = _letters(said.text), said.tone.emphasis
        mark = last_mark(said.text + said.after) if place is None or last_of[place] == at else ""
        start, end = speech.phones.edges[[word.first, word.last]].tolist()
        prominence = float(np.clip(MEAN_PROMINENCE + PROMINENCE_SPREAD * score, 0.0, MOST_PROMINENT))
        prominence = MOST_PROMINENT if emphasis > 0.0 else prominence
        has_accent = (is_content(text) or emphasis > 0.0) and emphasis >= 0.0
        found.append(_Word(text, mark, Span(start, end), vowel, prominence, has_accent, emphasis))
    return found


def _letters(written: str) -> str:
    return "".join(letter for letter in written.lower().replace("’", "'") if letter.isalnum() or letter == "'")


def _vowels(speech: Speech, word: WordSpan) -> list[tuple[float, float]]:
    """Seconds of the vowels of a word, or of the whole word if it has none."""
    edges = speech.phones.edges
    labels = speech.phones.phones[word.first : word.last]
    found = [word.first + at for at, label in enumerate(labels) if label in PHONES and PHONES[label].is_vowel]
    whole = [(float(edges[word.first]), float(edges[word.last]))]
    return [(float(edges[at]), float(edges[at + 1])) for at in found] or whole


@cache
def content_finder(language: str) -> Callable[[str], bool]:
    """Function that returns whether a word in small letters carries meaning of its own in a language."""
    common = common_words(language)
    if language.startswith("en"):
        common = common.union(WORDS["auxiliary"], WORDS["pronoun"], WORDS["preposition"], WORDS["unstressed"])
    common -= SPOKEN_OUT
    return lambda word: word not in common


def _written_sentences(words: Sequence[_Word], language: str) -> Iterator[SpokenSentence]:
    texts, marks = [word.text for word in words], [word.mark for word in words]
    tunes = movements(texts, marks) if language.startswith("en") else ()
    first = 0
    for at, word in enumerate(words):
        if word.mark in {".", "!", "?", "…"} or at + 1 == len(words):
            yield _sentence(words, range(first, at + 1), [tune for tune in tunes if first <= tune.at <= at])
            first = at + 1


def _sentence(words: Sequence[_Word], places: range, tunes: Sequence[Movement]) -> SpokenSentence:
    inside = [words[at] for at in places]
    accents = _apart([
        Accent(word.vowel, word.prominence, word.emphasis)
        for word in inside
        if word.is_content and word.prominence > LEAST_PROMINENCE
    ])  # fmt: skip
    span = Span(inside[0].span.start, inside[-1].span.end)
    rises = [tune for tune in tunes if tune.tune == "rise"]
    question = None
    if inside[-1].mark == "?":
        stressed = words[rises[-1].at].vowel - LEAD_S if rises else span.end
        question = Span(max(min(stressed, span.end - ASKED_S), span.start), span.end)
    items = [words[tune.at].vowel for tune in tunes if tune.tune == "item"]
    if items:
        items.append(accents[-1].time if accents else span.end)
    alternatives = [words[tune.at].span for tune in tunes if tune.tune == "rise"]
    falls = [words[tune.at].span for tune in tunes if tune.tune == "fall"]
    sides = [*_contrasts(inside), *(((alternatives[-1], falls[-1]),) if alternatives and falls else ())]
    is_rising = bool(rises) and not falls
    return SpokenSentence(
        span, tuple(_phrases(inside)), accents, question, is_rising, tuple(sorted(set(items))), tuple(sides)
    )


def _apart(accents: Sequence[Accent]) -> tuple[Accent, ...]:
    """Accents of which each is the most prominent within `LEAST_GAP_S`."""
    return tuple(
        found
        for found in accents
        if all(abs(found.time - other.time) >= LEAST_GAP_S or found.prominence >= other.prominence for other in accents)
    )


def _phrases(words: Sequence[_Word]) -> Iterator[Span]:
    first = 0
    for at in range(len(words)):
        following = words[at + 1] if at + 1 < len(words) else None
        is_clause = (
            following is not None
            and following.text in CLAUSE_WORDS
            and at + 1 - first >= LEAST_WORDS
            and len(words) - at - 1 > LEAST_WORDS
        )
        pause = 0.0 if following is None else following.span.start - words[at].span.end
        if following is None or words[at].mark or pause > PHRASE_PAUSE_S or is_clause:
            yield Span(words[first].span.start, words[at].span.end)
            first = at + 1


def _contrasts(words: Sequence[_Word]) -> Iterator[tuple[Span, Span]]:
    """Spans of a thing that is denied and of what is said instead: not the red one, but the blue one."""
    texts = [word.text for word in words]
    for at, text in enumerate(texts):
        if text != "not" and not text.endswith("n't"):
            continue
        turn = next((other for other in range(at + 2, min(at + 9, len(texts))) if _turns(words, other)), None)
        if turn is not None and turn + 1 < len(texts):
            last = next((o for o in range(turn + 1, len(texts)) if words[o].mark), len(texts) - 1)
            yield (
                Span(words[at].span.start, words[turn - 1].span.end),
                Span(words[turn].span.start, words[last].span.end),
            )


def _turns(words: Sequence[_Word], at: int) -> bool:
    """Whether a word begins what is said instead: but; behind a comma or semicolon also "it is", "she's"."""
    texts = [word.text for word in words[at : at + 2]]
    pronoun, _, verb = texts[0].partition("'")
    is_said = pronoun in WORDS["pronoun"] and (verb in {"s", "re"} or texts[-1] in {"is", "are", "was", "were"})
    return texts[0] == "but" or (words[at - 1].mark in {",", ";", "—"} and is_said)


def heard_sentences(sound: SoundFeatures) -> Iterator[SpokenSentence]:
    """Sentences of sound whose words are not known: between long pauses; phrases between shorter ones."""
    phrases = heard_spans(sound, PHRASE_PAUSE_S)
    peaks = heard_accents(sound)
    for whole in heard_spans(sound, SENTENCE_PAUSE_S):
        inside = tuple(phrase for phrase in phrases if whole.start <= phrase.start < whole.end)
        accents = tuple(peak for peak in peaks if whole.start <= peak.time < whole.end)
        rises = heard_rise(sound, whole.end)
        question = Span(max(whole.start, whole.end - ASKED_S), whole.end) if rises else None
        yield SpokenSentence(whole, inside or (whole,), accents, question, rises)


def heard_rise(sound: SoundFeatures, end: float) -> bool:
    """Whether the pitch rises before the end of a sentence, in seconds, so that it asks."""
    last, before = (sound.highest(end - late, end - early)[1] for late, early in RISE_S)
    return last - before > RISE_SEMITONES


def heard_spans(sound: SoundFeatures, pause_s: float, least_s: float = LEAST_PHRASE_S) -> list[Span]:
    """Spans of speech, of at least `least_s` seconds, that pauses of at least some seconds divide."""
    loud = sound.times[sound.level > PAUSE_DB]
    if not len(loud):
        return []
    cuts = np.flatnonzero(np.diff(loud) > pause_s)
    starts, ends = loud[np.concatenate([[0], cuts + 1])], loud[np.concatenate([cuts, [len(loud) - 1]])]
    spans = [Span(float(start), float(end) + sound.step_s) for start, end in zip(starts, ends, strict=True)]
    return [span for span in spans if span.end - span.start >= least_s]


def heard_accents(sound: SoundFeatures) -> list[Accent]:
    """Accents of a sound: peaks of level and pitch, the most prominent first, at least `PEAK_GAP_S` apart."""
    loud = sound.level > PAUSE_DB
    if not loud.any():
        return []
    score = sound.level + np.clip(sound.pitch, -6.0, 6.0)
    inner = score[1:-1]
    peaks = 1 + np.flatnonzero((inner > score[:-2]) & (inner >= score[2:]) & (sound.level[1:-1] > PEAK_DB))
    chosen: list[int] = []
    for peak in peaks[np.argsort(-score[peaks], kind="stable")].tolist():
        if all(abs(peak - other) * sound.step_s >= PEAK_GAP_S for other in chosen):
            chosen.append(peak)
    middle = float(np.median(score[chosen])) if chosen else 0.0
    found = [(at, MEAN_PROMINENCE + PROMINENCE_SPREAD * (score[at] - middle) / PEAK_RANGE_DB) for at in sorted(chosen)]
    return [
        Accent(float(sound.times[at]), float(np.clip(value, LEAST_PROMINENCE, MOST_PROMINENT))) for at, value in found
    ]
