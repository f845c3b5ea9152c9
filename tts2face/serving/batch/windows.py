"""Frames of cues: windows that do not overlap, and the slots up to the next cue.

Fit of speech to the time of its cue: the speaking rate, the pauses, and what remains too long.

What a batch will take: seconds of work and bytes on disk, before anything is rendered.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import groupby
from pathlib import Path

from lexicon.errors import InputError
from lexicon.marked_text import RATE_LIMITS
from tts2face.interchange.subtitles.cues import Cue
from tts2face.picture.options import Picture
from tts2face.serving.batch.options import CUT_PAUSES, REPORT
from tts2face.serving.batch.output import Output, Plan, is_current, read_manifest
from tts2face.serving.batch.segment import TRACK, Segment
from tts2face.serving.batch.store import Store
from tts2face.session.speech_stream import SpeechSpan

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


def cue_windows(cues: Sequence[Cue], fps: Fraction, margins: tuple[int, int] = (0, 0)) -> tuple[Window, ...]:
    """Windows of spoken cues in order of time; overlapping ones end where the next one begins.

    Cues that begin at the same frame, and speakers of one cue, divide their time by their letters. Windows are longer
    than their cues by `margins` frames before and after them, or by half of a gap that is shorter than two margins.
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
    return tuple(_with_slots(_with_margins(windows, *margins), fps))


def _parts(cue: Cue) -> list[tuple[Cue, int]]:
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


def _with_slots(windows: Sequence[Window], fps: Fraction) -> list[Window]:
    """Windows cut at the start of the next one, with their slots."""
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


# Seconds of one core, measured at 256 x 256 to 1280 x 720 (docs/performance.md): for each frame, for each pixel sample
# of the square that holds the head, for each pixel of the picture, for each second of speech, and to load the models.
FRAME_S = 4.3e-3
SAMPLE_S = 11.6e-9
PIXEL_S = 22e-9
SYNTHESIS_S = 0.15
START_S = 5.0
FRAME_BYTES, PIXEL_BYTES = 1000, 0.003  # of a frame, H.264 at CRF 18
SOUND_BYTES_PER_S, OUTPUT_SOUND_BYTES_PER_S = 96_000, 16_000  # of a segment, and of an output
TRACK_BYTES_PER_S = 200_000  # of a segment for exports; an export is about half of it


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is to be done: outputs, segments, seconds of clips, seconds of one core, bytes of segments and outputs."""

    n_outputs: int
    n_stale: int
    n_segments: int
    n_missing: int
    seconds: float
    core_s: float
    n_bytes: int


def estimate_batch(plan: Plan, out: Path, store: Store | None) -> Estimate:
    """Estimate of what a run of a plan takes; nothing is written."""
    entries = read_manifest(out)
    stale = [one for one in plan.outputs if not is_current(entries.get(one.name), one, out)]
    needed = {segment.address: segment for output in stale for segment in output.needed}
    missing = [segment for address, segment in needed.items() if store is None or store.result(address) is None]
    fps = plan.outputs[0].fps if plan.outputs else 30.0
    work = sum(_core_seconds(segment, fps) for segment in missing)
    work += START_S if missing else 0.0
    n_bytes = sum(_n_bytes(segment, fps, SOUND_BYTES_PER_S) for segment in missing)
    n_bytes += sum(_output_bytes(output) for output in stale)
    seconds = sum(_n_frames(segment) for output in stale for segment in output.segments) / fps
    return Estimate(len(plan.outputs), len(stale), len(plan.segments), len(missing), seconds, work, int(n_bytes))


def _n_frames(segment: Segment) -> int:
    if segment.fills_slot and segment.slot_frames is not None:
        return segment.slot_frames
    return segment.window_frames


def _core_seconds(segment: Segment, fps: float) -> float:
    n_frames = _n_frames(segment)
    synthesis = n_frames / fps * SYNTHESIS_S
    if segment.medium == TRACK:
        return synthesis
    picture = Picture(**segment.picture)
    samples = min(picture.width, picture.height) ** 2 * picture.samples_per_side**2
    return synthesis + n_frames * (FRAME_S + samples * SAMPLE_S + picture.width * picture.height * PIXEL_S)


def _n_bytes(segment: Segment, fps: float, sound_bytes_per_s: float) -> float:
    n_frames = _n_frames(segment)
    if segment.medium == TRACK:
        return n_frames / fps * TRACK_BYTES_PER_S
    picture = Picture(**segment.picture)
    in_frame = FRAME_BYTES + picture.width * picture.height * PIXEL_BYTES
    return n_frames * in_frame + n_frames / fps * sound_bytes_per_s


def _output_bytes(output: Output) -> float:
    seconds = sum(_n_frames(segment) for segment in output.segments) / output.fps
    movies = output.segments if output.suffix else ()
    n_bytes = sum(_n_bytes(segment, output.fps, OUTPUT_SOUND_BYTES_PER_S) for segment in movies)
    return n_bytes + len(output.exports) * seconds * TRACK_BYTES_PER_S / 2


MAX_STEPS = 4  # of the search for a rate; two are usual
AIM = 0.985  # of the cue's time, so that rounding of durations by the voice does not need another step
PAUSE_PLACES = re.compile(r"(?<=\w)([,;:.!?…]+)\s+(?=\S)")
SHORT_PAUSE = "[pause 0]"  # the shortest pause between two utterances, 20 ms


Measure = Callable[[str, float], SpeechSpan]  # span of a text at a rate


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
        Seconds from the start of the cue to the end of the last word.
    overflow_s
        Seconds by which the last word ends after the cue; 0 if it fits.
    n_steps
        Number of times the speech was measured.
    """

    text: str
    rate: float
    speech_s: float
    overflow_s: float
    n_steps: int


@dataclass(frozen=True, slots=True)
class Limits:
    """Time of a cue, time up to the next one (None: unlimited), and how speech may be changed."""

    window_s: float
    slot_s: float | None
    rate: float
    max_rate: float
    policy: str


def fit_speech(text: str, limits: Limits, measure: Measure) -> Fit:
    """Choose the rate and pauses by which a text fits its cue.

    The natural duration is measured first; a text that is shorter than its cue keeps its rate. Else the rate is raised
    up to `Limits.max_rate`, measured again at each step, as durations of voices do not follow the rate exactly. Then
    the policy applies: ``extend`` lets the speech end after its cue, up to the next one; ``cut-pauses`` shortens the
    pauses at punctuation first; ``report`` changes nothing.
    """
    fastest = max(limits.rate, limits.max_rate)
    fit = _search(text, limits.rate, fastest, limits.window_s, measure)
    if fit.overflow_s > 0.0 and limits.policy == CUT_PAUSES and PAUSE_PLACES.search(text):
        short = PAUSE_PLACES.sub(rf"\1 {SHORT_PAUSE} ", text)
        n_before = fit.n_steps
        fit = _search(short, limits.rate, fastest, limits.window_s, measure)
        fit = Fit(fit.text, fit.rate, fit.speech_s, fit.overflow_s, fit.n_steps + n_before)
    if limits.slot_s is not None and fit.speech_s > limits.slot_s and limits.policy != REPORT:
        last = _search(fit.text, fit.rate, RATE_LIMITS[1], limits.slot_s, measure)  # the next cue begins: faster
        overflow = max(0.0, last.speech_s - limits.window_s)
        fit = Fit(last.text, last.rate, last.speech_s, overflow, fit.n_steps + last.n_steps)
    return fit


def _search(text: str, rate: float, fastest: float, window_s: float, measure: Measure) -> Fit:
    """The lowest rate from `rate` to `fastest` at which a text fits, or the fastest one."""
    if not rate <= fastest:
        raise InputError(f"the rate {rate:g} exceeds the largest rate {fastest:g}; lower it")
    spoken = measure(text, rate).end
    steps = 1
    while spoken > window_s and rate < fastest and steps < MAX_STEPS:
        rate = min(fastest, rate * max(spoken / (window_s * AIM), 1.01))
        if steps == MAX_STEPS - 1:
            rate = fastest
        spoken = measure(text, rate).end
        steps += 1
    return Fit(text, round(rate, 6), spoken, max(0.0, spoken - window_s), steps)
