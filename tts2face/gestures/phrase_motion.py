"""Head and brows that follow sentences and their words: a course, accents, questions, lists and contrasts.

What people do, by time scale and event, was measured on readers and on a public speaker (decision 264): the large
movement is that of the sentence, and accents choose the direction of small ones. Positive pitch is chin down.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from tts2face.gestures.speech_plan import Accent, Span, SpeechPlan, SpokenSentence
from tts2face.numeric.arrays import FloatArray, smoothstep

# Course of a sentence: share of it, degrees of pitch, mm of the brows. 104 sentences of 4 to 7 s of free English.
COURSE = ((0.10, -1.0, 0.45), (0.25, -2.2, 0.8), (0.50, -0.9, 0.7), (0.75, 0.5, 0.35))
OPEN_S = 2.4  # as which the length of a sentence counts whose sound still arrives
OPEN_END = 0.4  # of the fall at its end, which is known when the sound is silent
FALL_S = 0.30  # before its last accent, from which on it falls
FALL, END = (3.4, -1.1), (2.6, -0.9)  # there, and at its end
BEFORE_S = 0.30  # the rise begins so long before the first phone
HOLD_S, RETURN_S = 0.25, 0.9  # behind the end, before and in which the head comes back
ROUND_S = 0.10  # by which movements begin earlier and end later, so that they join smoothly
USUAL_S, LENGTH_LIMITS = 4.5, (0.45, 1.15)  # sentences of this length have all of it; shorter ones less
# Of that speaker's pitch and brows, and spread of their logarithm between sentences. Means over sentences lose a third.
COURSE_SHARE, BROW_COURSE_SHARE = 1.1, 1.3
COURSE_SPREAD = 0.3
COMMA_SHARE = 0.35  # of the course, between phrases
COMMA = ((-0.12, 2.2, -0.7, 0.15), (0.48, -2.0, 0.7, 0.26))  # seconds from the end of a phrase, degrees, mm, width in s
# An accent of prominence 1: degrees up, spread of the logarithm, share of those that go down, seconds behind the
# middle of the vowel, width, and the movement back.
ACCENT_DEG, ACCENT_SPREAD = 1.6, 0.5
DOWN_SHARE = 0.15
ACCENT_DELAY_S, ACCENT_WIDTH_S = 0.06, 0.10
REBOUND, REBOUND_S = 0.5, 0.42
ASIDE = (0.3, 0.2)  # spread of its yaw and roll, relative to its size
BROW_MM, BROW_SPREAD = 0.9, 0.35  # of a rise of the brows
BROW_SHARE = 0.2  # of content words have one
BROW_DELAY_S, BROW_WIDTH_S = 0.03, 0.14
BROW_GAP_S = 0.5
BROW_TAIL = 0.35  # of it stays up a little longer
BROW_TAIL_S, BROW_TAIL_WIDTH_S = 0.25, 0.16
SIDE_SPREAD = 0.16  # of left against right, which people's brows have
EMPHASIS_MM = 1.3  # of the brows on an emphasised word, to which its mark gives a nod
# A question: brows up and the head a little aside from its stressed word on, and the chin falls less at its end.
QUESTION_MM, QUESTION_TILT_DEG = 1.7, 3.0
QUESTION_FALL = 0.25
OPEN_QUESTION = 0.6  # share where the tune falls: who, when, why
ASK_S, ASKED_S = 0.3, 0.6  # in which that begins and ends
# A list is counted: the chin falls on each item, and the head turns from one side to the other.
ITEM_DEG, LIST_TURN_DEG = 2.0, 3.0
ITEM_WIDTH_S = 0.13
# Contrasts: to one side, then to the other.
SIDE_TURN_DEG, SIDE_TILT_DEG = 3.6, 1.4
SIDE_S = 0.3
KNOWN_S = 0.2  # from which on an accent of a sound that arrives is shown
SAME_S = 1e-3  # within which two onsets are one
KEPT_S = 2.0  # after their end, movements are forgotten
NOTHING = np.zeros(5)


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """A change (5,) from one second to another, which then stays."""

    start: float
    end: float
    change: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Bell:
    """A Gaussian movement (5,) about a second, with a width in seconds."""

    time: float
    width: float
    size: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _OpenSentence:
    """A sentence whose sound still arrives: its onset, sizes (5,) of its course, its last accent and rise of brows.

    Times are seconds of the clip; `n_phrases` have ended.
    """

    onset: float
    sizes: FloatArray
    last_accent: float
    last_brows: float
    n_phrases: int = 0


@dataclass(slots=True)
class PhraseMotion:
    """Movements of a clip's sentences; those of a sentence depend on its time and the seed alone.

    The same seed draws the same for head and brows, which then move together.
    """

    seed: Sequence[int]
    _steps: list[_Step] = field(default_factory=list)
    _bells: list[_Bell] = field(default_factory=list)
    _left: FloatArray = field(default_factory=lambda: NOTHING)  # of steps that are forgotten
    _open: _OpenSentence | None = None

    def copy(self) -> "PhraseMotion":
        """Movements that continue as these, independently of them."""
        return PhraseMotion(self.seed, self._steps.copy(), self._bells.copy(), self._left, self._open)

    def add(self, plan: SpeechPlan, start: float) -> None:
        """Add what a plan, in seconds of the clip, does from `start` seconds on; what was shown before stays."""
        forgotten = start - KEPT_S
        self._left = self._left + sum((step.change for step in self._steps if step.end <= forgotten), NOTHING)
        self._steps = [step for step in self._steps if step.end > forgotten]
        self._bells = [bell for bell in self._bells if bell.time > forgotten]
        for sentence in plan.sentences:
            if self._open is not None and abs(self._open.onset - sentence.span.start) > SAME_S:
                self._end_arriving(start, start, self._open.sizes, 0.0)  # it broke off
                self._open = None
            if sentence.is_open or self._open is not None:
                self._add_arriving(sentence, start)
            else:
                self._add_sentence(sentence, start)

    def at(self, times: FloatArray) -> FloatArray:
        """(T, 5) degrees of pitch, yaw and roll, and mm of the left and the right brow, at T times."""
        found = np.tile(self._left, (len(times), 1))
        for step in self._steps:
            found += np.outer(smoothstep(times, step.start, step.end), step.change)
        for bell in self._bells:
            found += np.outer(np.exp(-0.5 * np.square((times - bell.time) / bell.width)), bell.size)
        return found

    def _add_sentence(self, sentence: SpokenSentence, start: float) -> None:
        chances = np.random.default_rng([*self.seed, round(1000 * sentence.span.start)])
        self._add_course(sentence, start, chances)
        last = -BROW_GAP_S
        for accent in sentence.accents:
            if accent.time in sentence.items:
                continue
            last = self._add_accent(accent, start, last, chances)
        side = float(np.sign(chances.random() - 0.5))
        if sentence.question is not None:
            share = 1.0 if sentence.rises else OPEN_QUESTION
            asked = share * np.array([-0.8, 0.0, side * QUESTION_TILT_DEG, QUESTION_MM, QUESTION_MM])
            self._hold(asked, (sentence.question.start, ASK_S), (sentence.question.end + 0.1, ASKED_S), start)
        self._add_list(sentence.items, side, sentence.span.end, start)
        for denied, said in sentence.sides:
            turn = side * np.array([0.0, SIDE_TURN_DEG, -SIDE_TILT_DEG, 0.0, 0.0])
            self._hold(turn, (denied.start, SIDE_S), (said.start - 0.1, SIDE_S), start)
            self._hold(-turn, (said.start - 0.1, SIDE_S), (said.end + 0.2, 2 * SIDE_S), start)

    def _add_arriving(self, sentence: SpokenSentence, start: float) -> None:
        """Add what is known now of a sentence whose sound arrives: its onset, its new accents, its end."""
        before = self._open
        if before is None:
            onset = sentence.span.start
            chances = np.random.default_rng([*self.seed, round(1000 * onset)])
            size = float(np.exp(COURSE_SPREAD * chances.normal()))
            sizes = size * np.array([COURSE_SHARE, 0.0, 0.0, BROW_COURSE_SHARE, BROW_COURSE_SHARE])
            before = _OpenSentence(onset, sizes, -np.inf, -np.inf)
            keys = [(onset - BEFORE_S, 0.0, 0.0)]
            keys += [(onset + share * OPEN_S, pitch, brows) for share, pitch, brows in COURSE]
            self._follow(keys, sizes, start)
        last, brows = before.last_accent, before.last_brows
        for accent in sentence.accents:
            if accent.time > last + 1e-6:
                chances = np.random.default_rng([*self.seed, round(1000 * accent.time)])
                # an accent that is known late is shown late: cut off, it would not be seen
                late = replace(accent, time=max(accent.time, start + KNOWN_S))
                brows = self._add_accent(late, start, brows, chances)
                last = accent.time
        for phrase in sentence.phrases[before.n_phrases : -1]:
            self._add_pause(phrase, before.sizes, start)
        n_phrases = len(sentence.phrases) - 1
        self._open = replace(before, last_accent=last, last_brows=brows, n_phrases=n_phrases)
        if not sentence.is_open:
            self._open = None
            depth = OPEN_END * (QUESTION_FALL if sentence.rises else 1.0)
            self._end_arriving(max(sentence.span.end, start), start, before.sizes, depth)

    def _end_arriving(self, end: float, start: float, sizes: FloatArray, depth: float) -> None:
        """Lower the chin at the end of a sentence, which is known now, and come back."""
        held = COURSE[-1][1:]
        keys = [(end, *held), (end + FALL_S, depth * END[0], depth * END[1])]
        keys += [(keys[-1][0] + HOLD_S, *keys[-1][1:]), (keys[-1][0] + HOLD_S + RETURN_S, 0.0, 0.0)]
        self._follow(keys, sizes, start)

    def _follow(self, keys: Sequence[tuple[float, float, float]], sizes: FloatArray, start: float) -> None:
        """Move from key to key of the course: seconds, pitch and brows."""
        for (from_s, pitch, brows), (to_s, next_pitch, next_brows) in pairwise(keys):
            change = sizes * np.array([next_pitch - pitch, 0.0, 0.0, *[next_brows - brows] * 2])
            if change.any():
                self._step(from_s - ROUND_S, to_s + ROUND_S, change, start)

    def _add_course(self, sentence: SpokenSentence, start: float, chances: np.random.Generator) -> None:
        onset, end = sentence.span.start, sentence.span.end
        length = end - onset
        size = np.exp(COURSE_SPREAD * chances.normal()) * np.clip(length / USUAL_S, *LENGTH_LIMITS)
        sizes = size * np.array([COURSE_SHARE, 0.0, 0.0, BROW_COURSE_SHARE, BROW_COURSE_SHARE])
        late = [accent.time for accent in sentence.accents if accent.time > onset + 0.6 * length]
        fall = (late[-1] if late else onset + 0.93 * length) + ACCENT_DELAY_S
        depth = QUESTION_FALL if sentence.rises else 1.0
        keys = [(onset + share * length, pitch, brows) for share, pitch, brows in COURSE]
        keys = [(onset - BEFORE_S, 0.0, 0.0), *(key for key in keys if key[0] < fall - FALL_S)]
        keys += [(fall - FALL_S, *keys[-1][1:]), (fall, depth * FALL[0], depth * FALL[1])]
        keys += [(max(end, fall + 0.05), depth * END[0], depth * END[1])]
        keys += [(keys[-1][0] + HOLD_S, *keys[-1][1:]), (keys[-1][0] + HOLD_S + RETURN_S, 0.0, 0.0)]
        self._follow(keys, sizes, start)
        for phrase in sentence.phrases[:-1]:
            self._add_pause(phrase, sizes, start)

    def _add_pause(self, phrase: Span, sizes: FloatArray, start: float) -> None:
        """Lower the chin at the end of a phrase within a sentence."""
        for after, pitch, brows, width in COMMA:
            moved = COMMA_SHARE * sizes * np.array([pitch, 0.0, 0.0, brows, brows])
            self._bell(phrase.end + after, width, moved, start)

    def _add_accent(self, accent: Accent, start: float, last: float, chances: np.random.Generator) -> float:
        """Add the movements of an accent; returns the time of the last rise of the brows."""
        spread, yaw, roll, rise, uneven, late = chances.normal(size=6)
        goes_down, has_rise = chances.random(2)
        time, weight = accent.time + ACCENT_DELAY_S + 0.02 * late, accent.prominence
        size = -ACCENT_DEG * weight * np.exp(ACCENT_SPREAD * spread - 0.5 * ACCENT_SPREAD**2)
        size = -0.8 * size if goes_down < DOWN_SHARE else size
        is_strong = accent.emphasis > 0.0
        size = 0.0 if is_strong else size
        moved = size * np.array([1.0, ASIDE[0] * yaw, ASIDE[1] * roll, 0.0, 0.0])
        self._bell(time, ACCENT_WIDTH_S, moved, start)
        self._bell(time + REBOUND_S, 1.2 * ACCENT_WIDTH_S, -REBOUND * moved, start)
        if not is_strong and (has_rise > BROW_SHARE * min(2.0, 0.4 + weight) or accent.time - last < BROW_GAP_S):
            return last
        height = BROW_MM * np.exp(BROW_SPREAD * rise) * min(weight + 0.3, 1.3)
        height = EMPHASIS_MM * (0.6 + 0.4 * accent.emphasis) if is_strong else height
        brows = height * np.array([0.0, 0.0, 0.0, 1.0 + SIDE_SPREAD * uneven, 1.0 - SIDE_SPREAD * uneven])
        at = accent.time + BROW_DELAY_S
        self._bell(at, BROW_WIDTH_S, brows, start)
        self._bell(at + BROW_TAIL_S, BROW_TAIL_WIDTH_S, BROW_TAIL * brows, start)
        return accent.time

    def _add_list(self, items: Sequence[float], side: float, end: float, start: float) -> None:
        if len(items) < 2:
            return
        places = side * LIST_TURN_DEG * np.linspace(-1.0, 1.0, len(items))
        for number, (time, place) in enumerate(zip(items, places.tolist(), strict=True)):
            self._bell(time + ACCENT_DELAY_S, ITEM_WIDTH_S, np.array([ITEM_DEG, 0.0, 0.0, 0.0, 0.0]), start)
            turn = np.array([0.0, place, 0.0, 0.0, 0.0])
            until = items[number + 1] - SIDE_S / 2 if number + 1 < len(items) else end + SIDE_S
            self._hold(turn, (time - SIDE_S / 2, SIDE_S), (until, SIDE_S if until < end else 2 * SIDE_S), start)

    def _hold(self, pose: FloatArray, onset: tuple[float, float], end: tuple[float, float], start: float) -> None:
        """Take a pose at a second, within some seconds about it, and leave it likewise."""
        self._step(onset[0] - onset[1] / 2, onset[0] + onset[1] / 2, pose, start)
        self._step(end[0] - end[1] / 2, end[0] + end[1] / 2, -pose, start)

    def _step(self, onset: float, end: float, change: FloatArray, start: float) -> None:
        onset = max(onset, start)
        self._steps.append(_Step(onset, max(end, onset + 2 * ROUND_S), change))

    def _bell(self, time: float, width: float, size: FloatArray, start: float) -> None:
        # what would have begun before is later or smaller, so that nothing jumps
        if time - 3 * width < start:
            size = size * np.clip((time - start) / (3 * width), 0.0, 1.0)
            width = max(min(width, (time - start) / 3), 0.03)
        if size.any():
            self._bells.append(_Bell(time, width, size))
