"""Frames of cues: windows that do not overlap, and the slots up to the next cue."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import groupby

from tts2face.subtitles.cue import Cue

EXTENSION_S = 1.0  # after a cue that no other cue follows soon; speech may use it
MAX_TAIL_S = 2.0  # longer silences are segments of their own, shared by equal silences


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
    def cue_begin(self) -> int:
        """Frame at which the cue itself begins."""
        return self.begin + self.margin_begin

    @property
    def cue_end(self) -> int:
        """Frame at which the cue itself ends."""
        return self.end - self.margin_end


def cue_windows(cues: Sequence[Cue], fps: Fraction, margin: int = 0) -> tuple[Window, ...]:
    """Windows of spoken cues in order of time; overlapping ones end where the next one begins.

    Cues that begin at the same frame, and speakers of one cue, divide their time by their letters. Windows are longer
    than their cues by `margin` frames at both ends, or by half of a gap that is shorter than two margins.
    """
    windows: list[Window] = []
    for begin, group in groupby(cues, key=lambda cue: round(Fraction(cue.begin_s) * fps)):
        together = [part for cue in group for part in _parts(cue)]
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
    return tuple(_with_slots(_with_margins(windows, margin), fps))


def _parts(cue: Cue) -> list[tuple[Cue, int]]:
    """A cue for each of its speakers, with its number from 1; a cue of one speaker with 0."""
    if not cue.parts:
        return [(cue, 0)]
    return [
        (replace(cue, text=part.text, speaker=part.speaker, parts=()), number)
        for number, part in enumerate(cue.parts, start=1)
    ]


def _with_margins(windows: Sequence[Window], margin: int) -> list[Window]:
    """Windows with margins in the gaps between them."""
    if margin == 0:
        return list(windows)
    longer: list[Window] = []
    for number, window in enumerate(windows):
        before = window.begin if number == 0 else max(window.begin - windows[number - 1].end, 0)
        after = windows[number + 1].begin - window.end if number + 1 < len(windows) else 2 * margin
        first = min(margin, before if number == 0 else before - before // 2)
        last = min(margin, max(after, 0) // 2)
        longer.append(
            replace(window, begin=window.begin - first, end=window.end + last, margin_begin=first, margin_end=last)
        )
    return longer


def _with_slots(windows: Sequence[Window], fps: Fraction) -> list[Window]:
    """Windows cut at the begin of the next one, with their slots."""
    slots: list[Window] = []
    extension, tail = round(EXTENSION_S * fps), round(MAX_TAIL_S * fps)
    at = 0
    for number, window in enumerate(windows):
        begin = max(window.begin, at)
        following = windows[number + 1].begin if number + 1 < len(windows) else None
        end = max(window.end if following is None else min(window.end, following), begin + 1)
        is_last = following is None or following - end > tail
        slot_end = end + extension if is_last or following is None else max(following, end)
        slots.append(replace(window, begin=begin, end=end, slot_end=slot_end, next_begin=following))
        at = end
    return slots


def scenes(windows: Sequence[Window], gap_frames: int) -> list[list[Window]]:
    """Windows in groups divided by silences of at least `gap_frames`."""
    groups: list[list[Window]] = []
    for window in windows:
        if groups and window.begin - groups[-1][-1].end < gap_frames:
            groups[-1].append(window)
        else:
            groups.append([window])
    return groups
