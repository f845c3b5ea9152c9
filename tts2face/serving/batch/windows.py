"""Frames of cues: windows that do not overlap, and the slots up to the next cue."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import groupby
from unicodedata import east_asian_width

from tts2face.interchange.subtitles.cues import Cue

EXTENSION_S = 1.0  # after the last cue, whose words are estimated to fit
MAX_EXTENSION_S = 10.0  # after the last cue, if it has more words than time
SLOW_CHARACTERS_PER_S = 12.0  # of slow speech, by which its time is estimated
FIGURE_CHARACTERS, WIDE_CHARACTERS = 6, 4  # that a figure (seven) and a syllable of Chinese are estimated as
MAX_TAIL_S = 2.0  # of longer silences the rest is a segment of its own, shared by equal ones


@dataclass(frozen=True, slots=True)
class Window:
    """Frames [begin, end) of a cue with its margins, and the end of its slot: the time that its segment fills."""

    cue: Cue
    begin: int
    end: int
    slot_end: int
    next_begin: int | None = None
    part: int = 0  # of a cue with several speakers, from 1; 0: the whole cue
    margin_begin: int = 0
    margin_end: int = 0

    @property
    def numbers(self) -> tuple[int, int]:
        """Numbers of the cue and of the part."""
        return self.cue.number, self.part

    @property
    def cue_begin(self) -> int:
        """Frame at which the cue itself begins."""
        return self.begin + self.margin_begin

    @property
    def cue_end(self) -> int:
        """Frame at which the cue itself ends."""
        return self.end - self.margin_end


def cue_windows(
    cues: Sequence[Cue],
    fps: Fraction,
    margins: tuple[int, int] = (0, 0),
    *,
    is_spoken: Callable[[Cue, int], bool] = lambda _cue, _part: True,
    rate_of: Callable[[Cue, int], float] = lambda _cue, _part: 1.0,
) -> tuple[Window, ...]:
    """Windows of cues in order of time; overlapping ones end where the next one begins.

    Cues that begin at the same frame, and speakers of one cue, divide their time by their letters. Windows are longer
    than their cues by `margins` frames before and after them, or by half of a gap that is shorter than two margins.
    Lines, by their cue and part, that are not spoken have no window and take no time. Slots reach up to the next cue,
    or as far into a long silence as the words may need at their speaking rate; a longer silence gives no less.
    """
    windows: list[Window] = []
    for begin, group in groupby(cues, key=lambda cue: round(Fraction(cue.begin_s) * fps)):
        together = [line for cue in group for line in cue_lines(cue) if is_spoken(*line)]
        if not together:
            continue
        end = max(round(Fraction(cue.end_s) * fps) for cue, _ in together)
        end = max(end, begin + len(together))
        letters = [max(len(cue.text), 1) for cue, _ in together]
        at = begin
        for number, (cue, part) in enumerate(together):
            share = sum(letters[: number + 1]) / sum(letters)
            until = end if number == len(together) - 1 else begin + max(number + 1, round((end - begin) * share))
            until = max(until, at + 1)
            windows.append(Window(cue, at, until, until, part=part))
            at = until
    return tuple(_with_slots(_with_margins(windows, *margins), fps, rate_of))


def cue_lines(cue: Cue) -> list[tuple[Cue, int]]:
    """A cue for each of its speakers, with its number from 1; a cue of one speaker with 0."""
    if not cue.parts:
        return [(cue, 0)]
    return [
        (replace(cue, text=part.text, speaker=part.speaker, parts=()), number)
        for number, part in enumerate(cue.parts, start=1)
    ]


def _with_margins(windows: Sequence[Window], longest_before: int, longest_after: int) -> list[Window]:
    """Windows with margins in the gaps between them."""
    longer: list[Window] = []
    for number, window in enumerate(windows):
        before = window.begin if number == 0 else max(window.begin - windows[number - 1].end, 0)
        after = windows[number + 1].begin - window.end if number + 1 < len(windows) else 2 * longest_after
        first = min(longest_before, before if number == 0 else before - before // 2)
        last = min(longest_after, max(after, 0) // 2)
        longer.append(
            replace(window, begin=window.begin - first, end=window.end + last, margin_begin=first, margin_end=last)
        )
    return longer


def _with_slots(windows: Sequence[Window], fps: Fraction, rate_of: Callable[[Cue, int], float]) -> list[Window]:
    """Windows cut at the start of the next one, with their slots."""
    slots: list[Window] = []
    extension, tail, longest = (round(seconds * fps) for seconds in (EXTENSION_S, MAX_TAIL_S, MAX_EXTENSION_S))
    at = 0
    for number, window in enumerate(windows):
        begin = max(window.begin, at)
        following = windows[number + 1].begin if number + 1 < len(windows) else None
        end = max(window.end if following is None else min(window.end, following), begin + 1)
        rate = rate_of(window.cue, window.part)
        needed = begin + round(_n_spoken(window.cue.text) / SLOW_CHARACTERS_PER_S / rate * fps)
        if following is None:
            slot_end = min(max(end + (tail if needed > end else extension), needed), end + longest)
        else:
            slot_end = max(min(max(end + tail, needed), following), end)
        slots.append(replace(window, begin=begin, end=end, slot_end=slot_end, next_begin=following))
        at = end
    return slots


def _n_spoken(text: str) -> int:
    """Characters of English by which the time of a text is estimated: figures and East Asian ones take that of many."""
    return sum(
        FIGURE_CHARACTERS if character.isdigit() else WIDE_CHARACTERS if east_asian_width(character) in "WF" else 1
        for character in text
    )


def scenes(windows: Sequence[Window], gap_frames: int) -> list[list[Window]]:
    """Windows in groups divided by silences of at least `gap_frames`."""
    groups: list[list[Window]] = []
    for window in windows:
        if groups and window.begin - groups[-1][-1].end < gap_frames:
            groups[-1].append(window)
        else:
            groups.append([window])
    return groups
