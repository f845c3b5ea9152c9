"""Fit of speech to the time of its cue: the speaking rate, the pauses, and what remains too long.

A sentence that runs over several cues has one rate, at which each of its parts fits its own cue, if possible.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lexicon.marked_text import RATE_LIMITS
from tts2face.serving.batch.options import CUT_PAUSES, REPORT

MAX_STEPS = 4  # of the search for a rate; two are usual
AIM = 0.985  # of a time, so that rounding of durations by the voice does not need another step
EASY_S = 0.5  # after a cue that speech may use before its rate is raised: a viewer reads on as long
RELEASE_S = 0.05  # after the last word, whose sound ends after its last phone
PAUSE_PLACES = re.compile(r"(?<=\w)([,;:.!?…]+)\s+(?=\S)")
SHORT_PAUSE = "[pause 0]"  # the shortest pause between two utterances, 20 ms

Measure = Callable[[str, float], Sequence[float]]  # ends of the parts of a text at a rate, in seconds of their segments


@dataclass(frozen=True, slots=True)
class Room:
    """Time of a cue, in seconds of its segment.

    Parameters
    ----------
    window_s
        End of the cue.
    slot_s
        End of its slot, `silence_s` before the next one; None: no other follows.
    overlap_s
        By how much speech may sound on after its slot.
    is_shared
        Whether the next cue is of the same speaker, who speaks faster rather than twice at once.
    release_s
        Silence before the next cue; none within a sentence.
    silence_s
        Silence between the slot and the next cue.
    """

    window_s: float
    slot_s: float | None = None
    overlap_s: float = 0.0
    is_shared: bool = False
    release_s: float = RELEASE_S
    silence_s: float = 0.0

    @property
    def easy_s(self) -> float:
        """End of speech for which no rate is raised."""
        if self.slot_s is None:
            return self.window_s + EASY_S
        return max(self.window_s, min(self.window_s + EASY_S, self.slot_s - self.release_s))

    @property
    def next_s(self) -> float:
        """End of the slot."""
        return float("inf") if self.slot_s is None else max(self.slot_s, self.window_s)

    @property
    def last_s(self) -> float:
        """End of speech that sounds on as long as is allowed."""
        return self.next_s + self.overlap_s

    def excess(self, end_s: float) -> tuple[float, float]:
        """Seconds by which speech that ends at `end_s` ends after its cue, and after the next one has begun."""
        return max(0.0, end_s - self.window_s), max(0.0, end_s - self.next_s - self.silence_s)


@dataclass(frozen=True, slots=True)
class Limits:
    """How speech may be changed to fit; `rooms` are those of all parts of a sentence, of which one is fitted."""

    rooms: tuple[Room, ...]
    rate: float = 1.0
    min_rate: float = 1.0
    max_rate: float = 1.4
    policy: str = "extend"
    part: int = 0


@dataclass(frozen=True, slots=True)
class Fit:
    """Text and rate by which speech fits its cue.

    Parameters
    ----------
    text
        Words, with marks that shorten the pauses if that was needed.
    rate
        Speaking rate.
    speech_s
        Seconds of the segment at which the last word ends.
    overflow_s
        Seconds by which the last word ends after the cue; 0 if it fits.
    overlap_s
        Seconds by which it ends after the next cue has begun.
    n_steps
        Number of times the speech was measured.
    """

    text: str
    rate: float
    speech_s: float
    overflow_s: float = 0.0
    overlap_s: float = 0.0
    n_steps: int = 1


def fit_speech(text: str, limits: Limits, measure: Measure) -> Fit:
    """Choose the rate and pauses by which a text fits its cue.

    Speech keeps its rate as long as it ends up to `EASY_S` after its cue and before the next one; else the rate is
    raised up to `Limits.max_rate`, measured again at each step, as durations of voices do not follow the rate exactly.
    Speech that is shorter than its cue is slowed down to `Limits.min_rate`. Then the policy applies: ``extend`` lets
    the speech end in the silence before the next cue; ``cut-pauses`` shortens the pauses at punctuation first;
    ``report`` changes nothing. What reaches into the next cue by more than `Room.overlap_s` is spoken faster, up to
    twice the rate; a speaker whose own next cue begins is spoken faster first.
    """
    search = _Search(text, limits, measure)
    keeps_to_cue = limits.policy == REPORT
    search.faster(
        max(limits.rate, limits.max_rate), [room.window_s if keeps_to_cue else room.easy_s for room in limits.rooms]
    )
    if (
        limits.policy == CUT_PAUSES
        and search.exceeds([room.easy_s for room in limits.rooms])
        and search.shorten_pauses()
    ):
        search.faster(max(limits.rate, limits.max_rate), [room.easy_s for room in limits.rooms])
    if not keeps_to_cue:  # beyond the limit each part has a rate of its own: one that is too long does not hurry all
        own = limits.rooms[limits.part]
        ends = [float("inf")] * len(limits.rooms)
        ends[limits.part] = own.next_s if own.is_shared else own.last_s
        search.faster(RATE_LIMITS[1], ends)
    if search.rate == limits.rate and limits.min_rate < limits.rate:
        search.slower(limits.min_rate, [room.window_s for room in limits.rooms])
    return search.result()


class _Search:
    """Search for a rate; it begins with that of the request."""

    def __init__(self, text: str, limits: Limits, measure: Measure) -> None:
        self.rate = limits.rate
        self._text, self._limits = text, limits
        self._measure = measure
        self._n_steps = 0
        self._ends: Sequence[float] = ()
        self._speak(limits.rate)

    def exceeds(self, targets: Sequence[float]) -> bool:
        """Whether a part ends after its target."""
        return any(end > target for end, target in zip(self._ends, targets, strict=True))

    def faster(self, fastest: float, targets: Sequence[float]) -> None:
        """Raise the rate up to `fastest`, as little as all parts need to end at their targets."""
        for step in range(1, MAX_STEPS):
            if not self.exceeds(targets) or self.rate >= fastest:
                return
            longest = max(end / target for end, target in zip(self._ends, targets, strict=True))
            # at least one percent a step
            raised = fastest if step == MAX_STEPS - 1 else self.rate * max(longest / AIM, 1.01)
            self._speak(min(fastest, raised))

    def slower(self, slowest: float, targets: Sequence[float]) -> None:
        """Lower the rate down to `slowest`, as far as all parts still end at their targets."""
        for _ in range(1, MAX_STEPS):
            longest = max(end / target for end, target in zip(self._ends, targets, strict=True))
            lowered = max(slowest, round(self.rate * longest / AIM, 6))
            if lowered >= self.rate:
                return
            before = self.rate, self._ends
            self._speak(lowered)
            if self.exceeds(targets):
                self.rate, self._ends = before
                return

    def shorten_pauses(self) -> bool:
        """Shorten the pauses at punctuation, at the rate of the request; whether there are any."""
        short = PAUSE_PLACES.sub(rf"\1 {SHORT_PAUSE} ", self._text)
        if short == self._text:
            return False
        self._text = short
        self._speak(self._limits.rate)
        return True

    def result(self) -> Fit:
        """The fit that was found, of the part in question."""
        end, room = self._ends[self._limits.part], self._limits.rooms[self._limits.part]
        return Fit(self._text, round(self.rate, 6), end, *room.excess(end), self._n_steps)

    def _speak(self, rate: float) -> None:
        self.rate, self._ends = rate, self._measure(self._text, rate)
        self._n_steps += 1


def without_overlap(fit: Fit, n_words: int, end_of: Callable[[int], float], room: Room) -> int:
    """Number of first words of a fitted text that end before the next cue, or within the allowed overlap.

    `end_of` gives the end of so many words in seconds of the segment; at least one word is kept.
    """
    if fit.speech_s <= room.last_s:
        return n_words
    low, high = 1, n_words - 1
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if end_of(middle) <= room.last_s else (low, middle - 1)
    return max(low, 1)
