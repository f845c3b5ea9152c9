"""Times of cues: what cannot be meant is read right where that is certain, else left out or refused; missing ends."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from statistics import median

from lexicon.errors import DataError
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import plain_text

CHARACTERS_PER_S = 15.0  # of speech; for the end of a cue whose own end is missing
MIN_ESTIMATED_S = 1.0
MAX_S = 1e6  # 11 days; larger times are damaged
HOUR_S, DAY_S = 3600.0, 86_400.0
MIDNIGHT_S = 3 * HOUR_S  # around midnight, within which a clock is seen to begin anew
SAME_INSTANT_S = 1e-6
FILM_MARGIN_S = 0.5  # by which a file of subtitles may be longer than its film
# Characters that a reader of subtitles sees in a second; broadcasters allow 12 to 20, a single word may stand for long.
POSSIBLE_SPEEDS, LIKELY_SPEEDS = (0.7, 150.0), (3.0, 45.0)


def placed(
    written: Sequence[WrittenCue], warnings: list[SubtitleWarning], *, shift: float = 0.0, film_s: float | None = None
) -> list[WrittenCue]:
    """Cues in order of time, without those that lie before or after the film."""
    cues = _in_columns(_over_midnight(written, warnings), warnings)
    _check_different(cues)
    cues = [replace(cue, begin_s=cue.begin_s + shift, end_s=_plus(cue.end_s, shift)) for cue in cues] if shift else cues
    cues = _within_film(cues, film_s, warnings)
    kept: list[WrittenCue] = []
    latest = 0.0
    for cue in cues:
        if cue.begin_s > MAX_S:
            warnings.append(SubtitleWarning(cue.line, f"the start {cue.begin_s:.0f} s is damaged; the cue is left out"))
            continue
        if cue.begin_s < 0.0 and cue.end_s is not None and cue.end_s <= 0.0:
            warnings.append(SubtitleWarning(cue.line, "the cue lies before the start of the film; it is left out"))
            continue
        if cue.begin_s < 0.0:
            warnings.append(SubtitleWarning(cue.line, "the start is negative; the cue begins at 0 s"))
            cue = replace(cue, begin_s=0.0)  # noqa: PLW2901 - the corrected cue
        # signs stand in blocks of their own, and nobody waits for them
        if cue.begin_s < latest and not cue.kind:
            warnings.append(SubtitleWarning(cue.line, "this cue begins before the one above it; cues are sorted"))
        latest = latest if cue.kind else max(latest, cue.begin_s)
        kept.append(cue)
    kept.sort(key=lambda cue: cue.begin_s)
    if kept and kept[0].begin_s >= HOUR_S and film_s is None:
        warnings.append(
            SubtitleWarning(
                kept[0].line,
                f"the first cue begins after {kept[0].begin_s / HOUR_S:.1f} hours, perhaps by the time code of a tape; "
                f"--shift -{kept[0].begin_s // HOUR_S * HOUR_S:.0f} sets it to the film",
            )
        )
    return kept


def _plus(instant: float | None, shift: float) -> float | None:
    return None if instant is None else instant + shift


def _over_midnight(cues: Sequence[WrittenCue], warnings: list[SubtitleWarning]) -> list[WrittenCue]:
    """Cues in the order of the file, whose times go on after 24 hours where a clock begins anew at midnight."""
    unwrapped: list[WrittenCue] = []
    offset, before = 0.0, 0.0
    for cue in cues:
        if _is_wrapped(before - offset, cue.begin_s):
            offset += DAY_S
            warnings.append(SubtitleWarning(cue.line, "the clock begins anew at midnight here; the times go on"))
        start, end = cue.begin_s + offset, _plus(cue.end_s, offset)
        if cue.end_s is not None and end is not None and _is_wrapped(cue.begin_s, cue.end_s):
            end += DAY_S
        unwrapped.append(replace(cue, begin_s=start, end_s=end))
        # a single wrong hour is far from the cues around it
        is_far = start >= MAX_S or (len(unwrapped) > 1 and start - before > DAY_S / 2)
        before = before if is_far else max(start, before)
    return unwrapped


def _is_wrapped(before: float, after: float) -> bool:
    """Whether a clock of 24 hours was at midnight between two of its readings."""
    return DAY_S - MIDNIGHT_S < before < DAY_S and after < MIDNIGHT_S


def _in_columns(cues: Sequence[WrittenCue], warnings: list[SubtitleWarning]) -> list[WrittenCue]:
    """Cues with starts and ends exchanged, where all of a file end before they begin."""
    timed = [cue for cue in cues if cue.end_s is not None and cue.begin_s <= MAX_S]
    is_reversed = len(timed) > 1 and all(cue.end_s is not None and cue.end_s < cue.begin_s for cue in timed)
    if not is_reversed:
        return list(cues)
    warnings.append(SubtitleWarning(timed[0].line, "all cues end before they begin; starts and ends are exchanged"))
    return [cue if cue.end_s is None else replace(cue, begin_s=cue.end_s, end_s=cue.begin_s) for cue in cues]


def _check_different(cues: Sequence[WrittenCue]) -> None:
    """Refuse times that are all equal: they are missing, whatever the file says."""
    worded = [cue for cue in cues if cue.text.strip()]
    starts = {cue.begin_s for cue in worded}
    has_lengths = any(cue.end_s is not None and cue.end_s > cue.begin_s for cue in worded)
    if len(starts) == 1 and (len(worded) > 2 or (len(worded) > 1 and not has_lengths)):
        raise DataError(
            f"line {worded[0].line}: all {len(worded)} cues begin at {worded[0].begin_s:g} s, so that the file has no "
            "times; export it with them"
        )


def _within_film(cues: Sequence[WrittenCue], film_s: float | None, warnings: list[SubtitleWarning]) -> list[WrittenCue]:
    """Cues that begin before the end of the film; hours of a tape's time code are taken off."""
    if film_s is None or not cues:
        return list(cues)
    outside = [cue for cue in cues if cue.begin_s > film_s + FILM_MARGIN_S]
    if not outside:
        return list(cues)
    first = min(cue.begin_s for cue in cues)
    hours = first // HOUR_S * HOUR_S
    moved = [replace(cue, begin_s=cue.begin_s - hours, end_s=_plus(cue.end_s, -hours)) for cue in cues]
    if hours and all(cue.begin_s <= film_s + FILM_MARGIN_S for cue in moved):
        warnings.append(
            SubtitleWarning(
                cues[0].line,
                f"the times begin at {hours / HOUR_S:.0f} h, which is taken off: the film has {film_s:.1f} s",
            )
        )
        return moved
    if 2 * len(outside) > len(cues):
        raise DataError(
            f"line {outside[0].line}: {len(outside)} of {len(cues)} cues begin after the end of the film, which has "
            f"{film_s:.1f} s; choose the subtitles of this film, or move them with --shift"
        )
    number = f"{len(outside)} cues begin" if len(outside) > 1 else "this cue begins"
    left = "they are" if len(outside) > 1 else "it is"
    warnings.append(
        SubtitleWarning(
            outside[0].line, f"{number} after the end of the film, which has {film_s:.1f} s; {left} left out"
        )
    )
    return [cue for cue in cues if cue.begin_s <= film_s + FILM_MARGIN_S]


def latest_ends(cues: Sequence[WrittenCue]) -> list[float]:
    """For each cue in order of time the latest end that an estimate may give it, so that it overrules no written time.

    It is the start of the next cue, or the end of one that begins at the same instant: words of no length share the
    time up to the next instant that is written. Without either it is infinite.
    """
    ends: list[float] = []
    first = 0
    while first < len(cues):
        start = cues[first].begin_s
        after = first + 1
        while after < len(cues) and cues[after].begin_s <= start + SAME_INSTANT_S:
            after += 1
        written = [cue.end_s for cue in cues[first:after] if cue.end_s is not None and cue.end_s > start]
        following = [cues[after].begin_s] if after < len(cues) else []
        ends += [min([*written, *following], default=inf)] * (after - first)
        first = after
    return ends


def estimated_end(start: float, latest: float, text: str) -> float:
    """End of a cue by the length of its text, at most the latest one that it may have."""
    return min(start + max(MIN_ESTIMATED_S, len(text) / CHARACTERS_PER_S), latest)


def median_speed(cues: Sequence[WrittenCue]) -> float | None:
    """Characters a second that a reader of the cues sees; None without a cue that has words and a length."""
    speeds = [
        len(" ".join(plain_text(cue.text, cue.markup).split())) / (cue.end_s - cue.begin_s)
        for cue in cues
        if cue.end_s is not None and cue.end_s > cue.begin_s and cue.text.strip()
    ]
    return median(speeds) if speeds else None


def is_possible(cues: Sequence[WrittenCue]) -> bool:
    """Whether cues can be read in their time, and do not stand for minutes; also where that cannot be known."""
    speed = median_speed(cues)
    return speed is None or POSSIBLE_SPEEDS[0] <= speed <= POSSIBLE_SPEEDS[1]


def is_likely(cues: Sequence[WrittenCue]) -> bool:
    """Whether cues stand about as long as those of films."""
    speed = median_speed(cues)
    return speed is not None and LIKELY_SPEEDS[0] <= speed <= LIKELY_SPEEDS[1]
