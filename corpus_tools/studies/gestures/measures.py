"""Measures of gestures: speeds, spectra, distances of distributions, correlation, diversity, coverage, repetition.

Motion is (T, k): recordings of `lengths` (R,) frames each, concatenated. No measure crosses their borders.

Traits of gestures that are compared: a number for each frame or each blink of a recording.

Blinks: onsets, durations and speeds, interpolated linearly between frames.

Measures of what the body does by itself: breaths, micro-saccades and pupils of minutes of speech and silence.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch
from scipy.spatial.distance import cdist
from scipy.stats import wasserstein_distance

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.face.body import BREATH_SHAPE, DILATION, PUPIL_SHAPE, Breathing, Pupils
from tts2face.gestures.gaze import microsaccades
from tts2face.gestures.stream import style_median
from tts2face.models.palette import GESTURE_FPS, Palette, Style
from tts2face.types import Trajectory

FAST_HZ = 6.0  # motion of head or brows above this is perceived as trembling
SEGMENT = 64  # frames of a spectrum's window: 2.1 s, which a recording of 3 s holds

Doubles = NDArray[np.float64]
Motion = NDArray[np.floating]
Lengths = NDArray[np.int32]


def split_recordings(values: Motion, lengths: Lengths) -> list[Motion]:
    """The recordings, split again."""
    return np.split(values, np.cumsum(lengths)[:-1])


def wasserstein(one: Motion, other: Motion) -> float:
    """Wasserstein distance of two sets of numbers, in their unit; NaN where one is empty."""
    return float(wasserstein_distance(one, other)) if len(one) and len(other) else float("nan")


def random_halves(n: int, n_times: int, generator: np.random.Generator) -> Iterator[tuple[NDArray[np.int64], ...]]:
    """`n_times` pairs of random halves of the indices below n."""
    for _ in range(n_times):
        order = generator.permutation(n)
        yield order[: n // 2], order[n // 2 :]


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Power (F,) of frequencies (F,) in Hz: squared units per Hz, summed over the channels."""

    hz: Doubles
    power: Doubles

    @property
    def fast_power(self) -> float:
        """Power above `FAST_HZ`."""
        return float(self.power[self.hz >= FAST_HZ].sum() * (self.hz[1] - self.hz[0]))


def spectrum(values: Motion, lengths: Lengths, fps: float) -> Spectrum:
    """Mean power spectrum of the recordings without their means (Welch 1967; Hann windows of `SEGMENT` frames)."""
    total: Doubles | None = None
    hz: Motion = np.zeros(0)
    used = 0
    for part in split_recordings(values, lengths):
        if len(part) < SEGMENT:
            continue
        level = part.astype(np.float64) - part.mean(axis=0, dtype=np.float64)
        hz, power = welch(level, fps, nperseg=SEGMENT, axis=0)
        whole = np.asarray(power.sum(axis=1), np.float64) * len(part)
        total = whole if total is None else total + whole
        used += len(part)
    if total is None:
        return Spectrum(np.fft.rfftfreq(SEGMENT, 1 / fps).astype(np.float64), np.full(SEGMENT // 2 + 1, np.nan))
    return Spectrum(np.asarray(hz, np.float64), total / used)


def ratio(one: float, other: float) -> float:
    """The quotient; NaN where the divisor is 0."""
    return one / other if other else float("nan")


def frame_midpoints(values: Motion, lengths: Lengths) -> Doubles:
    """(T - R,) means of neighbouring frames of (T,): values at the instants of finite differences."""
    return np.concatenate([(part[1:] + part[:-1]) / 2.0 for part in split_recordings(values, lengths)])


def diversity(clips: Sequence[Motion], takes: Sequence[Motion]) -> float:
    """Mean distance between clips of different seeds, over that between different takes of the same length.

    The distance is the root mean square over frames. 0: all seeds give the same motion; 1: clips differ as much as
    recordings.
    """
    return ratio(_mean_distance(clips), _mean_distance(takes))


def _mean_distance(clips: Sequence[Motion]) -> float:
    flat = np.stack([clip.astype(np.float64).ravel() for clip in clips])
    gaps = cdist(flat, flat)
    return float(gaps[np.triu_indices(len(flat), 1)].mean() / np.sqrt(len(clips[0])))


def coverage(shown: NDArray[np.int64], lengths: Lengths, within: int) -> float:
    """Share of recorded moments within `within` frames of a moment in `shown`, in the same recording."""
    edges = np.concatenate([[0], np.cumsum(lengths)])
    visited = np.zeros(edges[-1], bool)
    moments = np.unique(shown)
    at = np.searchsorted(edges, moments, side="right") - 1
    for moment, low, high in zip(moments, edges[at], edges[at + 1], strict=True):
        visited[max(low, moment - within) : min(high, moment + within + 1)] = True
    return float(visited.mean())


def autocorrelation(values: Motion, most: int) -> Doubles:
    """(most + 1,) autocorrelation of a clip at lags of 0 to `most` frames, over all channels; 1 at lag 0.

    Close to 1 at the period of a repetition. Each lag is averaged over its number of frame pairs.
    """
    centred = values.astype(np.float64) - values.mean(axis=0, dtype=np.float64)
    size = 1 << int(np.ceil(np.log2(2 * len(centred))))
    power = np.abs(np.fft.rfft(centred, size, axis=0)) ** 2
    sums = np.fft.irfft(power.sum(axis=1), size)[: most + 1]
    means = sums / (len(centred) - np.arange(most + 1))
    return np.asarray(means / means[0])


SHUT = 0.5  # closure from which lids count as shut (as in tts2face.gestures.noise)
OPEN = 0.2  # closure below which lids count as open; trackers measure about 0.1 for narrowed eyes


@dataclass(frozen=True, slots=True, eq=False)
class Blinks:
    """Blinks of some recordings.

    Parameters
    ----------
    n, seconds
        Number of blinks and duration of the recordings.
    intervals : (I,)
        Seconds from onset to onset within a recording; an onset is an upward crossing of `SHUT`.
    closing, opening : (B,)
        Seconds from `OPEN` to the instant of the greatest closure, and from there to `OPEN`.
    closing_speeds, opening_speeds : (B,)
        Highest speed of each, shares per second.

    Blinks that begin or end outside their recording contribute only their onsets.
    """

    n: int
    seconds: float
    intervals: Doubles
    closing: Doubles
    opening: Doubles
    closing_speeds: Doubles
    opening_speeds: Doubles

    @property
    def durations(self) -> Doubles:
        """(B,) seconds from open to open."""
        return self.closing + self.opening

    @property
    def per_minute(self) -> float:
        """Blinks per minute."""
        return 60 * self.n / self.seconds


def find_blinks(shut: NDArray[np.floating], lengths: NDArray[np.int32], fps: float) -> Blinks:
    """Blinks in concatenated recordings of `lengths` (R,) frames, from lid closures (T, 2) or (T,) in 0..1."""
    lids = np.asarray(shut, np.float64).reshape(len(shut), -1).mean(axis=1)
    n, intervals, found = 0, [np.zeros(0)], [np.zeros((0, 4))]
    for part in np.split(lids, np.cumsum(lengths)[:-1]):
        onsets = blink_onsets(part) / fps
        n += len(onsets)
        intervals.append(np.diff(onsets))
        found.append(_blink_phases(part, fps))
    closing, opening, closing_speeds, opening_speeds = np.concatenate(found).T
    seconds = float(np.sum(lengths)) / fps
    return Blinks(n, seconds, np.concatenate(intervals), closing, opening, closing_speeds, opening_speeds)


def blink_onsets(lids: Doubles) -> Doubles:
    """(B,) fractional frames at which lid closures (T,) cross `SHUT` upwards."""
    shut = lids > SHUT
    last = np.flatnonzero(~shut[:-1] & shut[1:])
    return np.asarray(last + (SHUT - lids[last]) / (lids[last + 1] - lids[last]))


def _blink_phases(lids: Doubles, fps: float) -> Doubles:
    """(B, 4) closing time, opening time, closing speed and opening speed of the blinks within a recording."""
    rows = []
    closed = lids > OPEN
    begins = np.flatnonzero(~closed[:-1] & closed[1:])
    for begin in begins:
        after = np.flatnonzero(~closed[begin + 1 :])
        if not len(after):
            break
        end = begin + 1 + int(after[0])  # the first open frame
        top = begin + int(np.argmax(lids[begin : end + 1]))
        if lids[top] <= SHUT:
            continue
        first = begin + (OPEN - lids[begin]) / (lids[begin + 1] - lids[begin])
        last = end - (OPEN - lids[end]) / (lids[end - 1] - lids[end])
        speeds = np.diff(lids[begin : end + 1]) * fps
        rows.append(((top - first) / fps, (last - top) / fps, speeds.max(), -speeds.min()))
    return np.array(rows, np.float64).reshape(-1, 4)


IN_DEGREES = 180.0 / np.pi


@dataclass(frozen=True, slots=True)
class Trait:
    """A trait: its name, unit and feature, and the function that computes it from a recording's motion (T, k).

    Fields must reproduce the recorded distribution of traits with a target (docs/gestures.md).
    """

    name: str
    unit: str
    feature: str
    of: Callable[[Motion], Doubles]
    has_target: bool = False

    def values_of(self, parts: Sequence[Motion]) -> Doubles:
        """Values of all recordings."""
        return np.concatenate([self.of(part) for part in parts]) if len(parts) else np.zeros(0)


def style_traits(palette: Palette, style: Style) -> tuple[Trait, ...]:
    """The traits of a style's features; amplitudes are distances from its medians."""
    middle = {feature: style_median(style, feature).astype(np.float64) for feature in style.motion}
    found: list[Trait] = []
    for feature in style.motion:
        if feature == "blink":
            found += [Trait(name, unit, feature, of, name == INTERVALS) for name, unit, of in BLINKS]
        else:
            found += _motion_traits(palette, feature, middle[feature])
    return tuple(found)


INTERVALS = "blink interval"


def _blink_trait(value: Callable[[Blinks], Doubles]) -> Callable[[Motion], Doubles]:
    return lambda part: value(find_blinks(part, np.array([len(part)], np.int32), GESTURE_FPS))


BLINKS: tuple[tuple[str, str, Callable[[Motion], Doubles]], ...] = (
    (INTERVALS, "s", _blink_trait(lambda found: found.intervals)),
    ("blink duration", "s", _blink_trait(lambda found: found.durations)),
    ("closing time", "s", _blink_trait(lambda found: found.closing)),
    ("opening time", "s", _blink_trait(lambda found: found.opening)),
    ("closing speed", "1/s", _blink_trait(lambda found: found.closing_speeds)),
    ("opening speed", "1/s", _blink_trait(lambda found: found.opening_speeds)),
)


def _motion_traits(palette: Palette, feature: str, middle: Doubles) -> list[Trait]:
    """Speed and amplitude of a feature in display units."""
    display, unit = display_units(palette, feature)
    if feature == "brows":
        lift = palette.brow_lift
        return [
            Trait("brow height", "mm", feature, lambda part: part @ lift, has_target=True),
            Trait("brow speed", "mm/s", feature, lambda part: np.abs(np.diff(part @ lift)) * GESTURE_FPS),
        ]
    return [
        Trait(
            f"{feature} speed",
            f"{unit}/s" if unit else "1/s",
            feature,
            lambda part: np.linalg.norm(np.diff(display(part), axis=0), axis=1) * GESTURE_FPS,
            has_target=feature == "head",
        ),
        Trait(f"{feature} amplitude", unit, feature, lambda part: np.linalg.norm(display(part - middle), axis=1)),
    ]


def display_units(palette: Palette, feature: str) -> tuple[Callable[[Motion], Motion], str]:
    """Conversion of a feature's channels to visible motion, and its unit: the head's angles, mean landmark motion."""
    if feature == "head":
        return lambda values: values[:, :3].astype(np.float64) * IN_DEGREES, "deg"
    if feature == "gaze":
        return lambda values: values.astype(np.float64) * IN_DEGREES, "deg"
    if feature in palette.regions:
        size = np.sqrt(len(palette.regions[feature].landmarks))
        return lambda values: values.astype(np.float64) / size, "mm"
    return lambda values: values.astype(np.float64), ""


def in_display_units(palette: Palette, motion: Mapping[str, Motion]) -> dict[str, Motion]:
    """All features in display units."""
    return {feature: display_units(palette, feature)[0](values) for feature, values in motion.items()}


MINUTES = 4
PHRASE_S, PAUSE_S = 3.0, 0.5
RISING = 0.001  # of a full breath in a frame
LEAST_JUMP_DEG = 0.06  # of eyes in a frame: they drift by less


@dataclass(frozen=True, slots=True)
class BodyMeasure:
    """A measure, its value, and the range that its source gives."""

    name: str
    value: float
    unit: str
    published: tuple[float, float]
    source: str


def measure_body(seed: int) -> tuple[BodyMeasure, ...]:
    """Measures of a seed."""
    silence = PhoneSequence([SILENCE], [0.0, 60.0 * MINUTES])
    pauses = np.arange(0, 60.0 * MINUTES, PHRASE_S + PAUSE_S)
    edges = np.sort(np.concatenate([pauses, pauses + PAUSE_S]))
    speech = PhoneSequence([SILENCE, "ɑ"] * (len(edges) // 2 - 1) + [SILENCE], edges.tolist())
    still, spoken = (_channels(phones, seed) for phones in (silence, speech))
    eyes = np.degrees(microsaccades(np.arange(GESTURE_FPS * 60 * MINUTES) / GESTURE_FPS, seed))
    jumps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    jumps = jumps[jumps > LEAST_JUMP_DEG]
    pupils = 1 + DILATION * still[:, 1]
    return (
        BodyMeasure("breaths at rest", _breaths(still[:, 0]), "a minute", (12, 18), "Conrad and Schönle 1979"),
        BodyMeasure("breaths in speech", _breaths(spoken[:, 0]), "a minute", (8, 25), "Winkworth et al. 1995"),
        BodyMeasure("micro-saccades", len(jumps) / 60 / MINUTES, "a second", (1, 2), "Martinez-Conde et al. 2004"),
        BodyMeasure("their size, median", float(np.median(jumps)), "degrees", (0.1, 1), "Martinez-Conde et al. 2004"),
        BodyMeasure("pupils, deviation", 100 * float(pupils.std() / pupils.mean()), "%", (2, 10), "Stark et al. 1958"),
        BodyMeasure(
            "wider in speech by",
            100 * DILATION * float(spoken[:, 1].mean() - still[:, 1].mean()),
            "%",
            (2, 15),
            "Kahneman and Beatty 1966",
        ),
    )


def _channels(phones: PhoneSequence, seed: int) -> Doubles:
    """(T, 2) breath and pupils with phones."""
    n_frames = round(float(phones.edges[-1]) * GESTURE_FPS)
    motion = Trajectory((BREATH_SHAPE, PUPIL_SHAPE), np.zeros((n_frames, 2), np.float32), float(GESTURE_FPS))
    breathing, pupils = Breathing(0), Pupils(1)
    moved, _ = pupils.apply(breathing.apply(motion, phones, seed, None)[0], phones, seed, None)
    return moved.values.astype(np.float64)


def _breaths(level: Doubles) -> float:
    """Breaths a minute: beginnings of a rise."""
    rises = np.diff(level) > RISING
    begins = int((rises[1:] & ~rises[:-1]).sum())
    return begins * 60 * GESTURE_FPS / len(level)
