"""Each style of a palette: recordings that its fields have not seen, against what fields and noise make of them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.gesture_study.blinks import blinks_of
from corpus_tools.gesture_study.clips import dealt, from_field, from_noise, with_source
from corpus_tools.gesture_study.longrun import LongRun, long_run
from corpus_tools.gesture_study.measures import (
    Spectrum,
    between_frames,
    correlation,
    distance,
    diversity,
    halves,
    ratio,
    recordings,
    spectrum,
)
from corpus_tools.gesture_study.traits import Trait, traits_of, visible
from lexicon.errors import InputError
from tts2face.gesture.gesture_stream import Fields
from tts2face.models.palette import GESTURE_FPS, Palette, Style

NEAR, HALF = 1.5, 0.5  # a field's distance: at most so many of that between halves, below this share of noise's
CORRELATION_WITHIN = 0.1
FEWEST = 10  # recordings of which some can be held out
N_TAKES = 60  # recordings whose distances tell how unlike takes are

Doubles = NDArray[np.float64]
Progress = Callable[[int, int], None]
Motion = Mapping[str, NDArray[np.floating]]


@dataclass(frozen=True, slots=True)
class Options:
    """One in so many recordings is held out; so many random halvings of them; so many clips; the seed of all.

    Raises
    ------
    InputError
        A number is too small.
    """

    one_in: int = 5
    halves: int = 50
    clips: int = 3
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse numbers that leave nothing to compare."""
        if self.one_in < 2:
            raise InputError(f"one in {self.one_in} recordings cannot be held out; give 2 or more")
        if self.halves < 1:
            raise InputError(f"there must be at least 1 halving, not {self.halves}")
        if self.clips < 2:
            raise InputError(f"seeds are compared with at least 2 clips, not {self.clips}")
        if self.seed < 0:
            raise InputError(f"a seed is a whole number from 0, not {self.seed}")


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """A trait of recordings, of a field's clips and of noise, and Wasserstein distances in its unit.

    `halves` lies between random halves of the recordings (mean); the others between all of them and one clip (mean).
    """

    trait: Trait
    real: Doubles
    field: Doubles
    noise: Doubles
    halves: float
    to_field: float
    to_noise: float

    @property
    def is_met(self) -> bool:
        """Whether the field is as near as a trait with a target must be."""
        return self.to_field <= NEAR * self.halves and self.to_field < HALF * self.to_noise


@dataclass(frozen=True, slots=True, eq=False)
class Moving:
    """Spectra of a feature that moves, and how its speed goes with the sound's intensity (r)."""

    feature: str
    unit: str
    spectra: tuple[Spectrum, Spectrum, Spectrum]
    with_intensity: tuple[float, float, float]
    diversity: tuple[float, float]

    @property
    def goes_with_sound(self) -> bool:
        """Whether the field's r is near the recordings'."""
        return abs(self.with_intensity[0] - self.with_intensity[1]) <= CORRELATION_WITHIN

    @property
    def fast(self) -> tuple[float, float]:
        """Power above `measures.FAST_HZ` of field and noise, over that of the recordings."""
        real, field, noise = (one.fast for one in self.spectra)
        return ratio(field, real), ratio(noise, real)


@dataclass(frozen=True, slots=True, eq=False)
class StyleFound:
    """What one style is like: `real` is its recordings, or for a derived style what the field of its source makes.

    Long clips are of measured styles alone: derived ones are theirs, changed.
    """

    name: str
    source: str | None
    summary: str
    n_learnt: int
    n_held: int
    is_held_out: bool
    minutes: float
    blinks_per_minute: tuple[float, float, float]
    compared: tuple[Compared, ...]
    moving: tuple[Moving, ...]
    long: LongRun


@dataclass(frozen=True, slots=True, eq=False)
class GesturesFound:
    """The whole study of a palette."""

    name: str
    options: Options
    styles: tuple[StyleFound, ...]

    @property
    def targets(self) -> tuple[int, int]:
        """How many targets of measured styles are met, and how many there are."""
        measured = [style for style in self.styles if style.source is None]
        kept = [one.is_met for style in measured for one in style.compared if one.trait.has_target]
        kept += [one.goes_with_sound for style in measured for one in style.moving if one.feature == "head"]
        return sum(kept), len(kept)


def study(name: str, palette: Palette, options: Options, on_progress: Progress | None = None) -> GesturesFound:
    """Measure every style of a palette."""
    found: list[StyleFound] = []
    ready: dict[str, _Ready] = {}
    for done, style in enumerate(names := (*palette.styles, *palette.derivations)):
        if on_progress:
            on_progress(done, len(names))
        source = palette.derivations[style].source if style in palette.derivations else style
        if source not in ready:
            ready[source] = _ready(palette, source, options)
        found.append(_style_found(palette, style, ready[source], options))
    if on_progress:
        on_progress(len(names), len(names))
    return GesturesFound(name, options, tuple(found))


@dataclass(frozen=True, slots=True, eq=False)
class _Ready:
    """A measured style: what its fields are made of, what they have not seen, the fields, and a clip of theirs.

    The clip is what derived styles are compared with.
    """

    learnt: Style
    held: Style
    is_held_out: bool
    fields: Fields
    again: Motion


def _ready(palette: Palette, source: str, options: Options) -> _Ready:
    whole = palette.styles[source]
    is_held_out = len(whole.lengths) >= FEWEST
    learnt, held = dealt(whole, options.one_in, options.seed) if is_held_out else (whole, whole)
    fields = Fields(with_source(palette, source, learnt))
    again = _from_fields(fields, source, held, options.seed + options.clips) if palette.derivations else {}
    return _Ready(learnt, held, is_held_out, fields, again)


def _style_found(palette: Palette, name: str, ready: _Ready, options: Options) -> StyleFound:
    derived = palette.derivations.get(name)
    source = name if derived is None else derived.source
    learnt, held, fields = ready.learnt, ready.held, ready.fields
    clips = [_from_fields(fields, name, held, options.seed + k) for k in range(options.clips)]
    noises = [from_noise(fields, name, len(held.intensity), options.seed + k) for k in range(options.clips)]
    real = held.motion if derived is None else ready.again
    rates = [_rate(real, held), _rate(clips[0], held), _rate(noises[0], held)]
    return StyleFound(
        name=name,
        source=None if derived is None else source,
        summary="" if derived is None else derived.summary,
        n_learnt=len(learnt.lengths),
        n_held=len(held.lengths),
        is_held_out=ready.is_held_out,
        minutes=palette.styles[source].seconds / 60,
        blinks_per_minute=(rates[0], rates[1], rates[2]),
        compared=tuple(_compared(trait, held, (real, clips, noises), options) for trait in traits_of(palette, learnt)),
        moving=_moving(palette, held, real, clips, noises),
        long=long_run(fields, name, learnt, held, options.seed) if derived is None else LongRun({}, {}),
    )


def _from_fields(fields: Fields, name: str, held: Style, seed: int) -> Motion:
    return {feature: from_field(fields, name, feature, held.intensity, seed).values for feature in held.motion}


def _rate(motion: Motion, held: Style) -> float:
    return blinks_of(motion["blink"], held.lengths, GESTURE_FPS).per_minute if "blink" in motion else float("nan")


def _compared(
    trait: Trait, held: Style, kinds: tuple[Motion, list[Motion], list[Motion]], options: Options
) -> Compared:
    def read(motion: Motion) -> list[Doubles]:
        return [trait.of(part) for part in recordings(motion[trait.feature], held.lengths)]

    parts = read(kinds[0])
    clips, noises = ([np.concatenate(read(clip)) for clip in kind] for kind in kinds[1:])
    generator = np.random.default_rng([options.seed, 2])
    apart = [
        distance(np.concatenate([parts[i] for i in one]), np.concatenate([parts[i] for i in other]))
        for one, other in halves(len(parts), options.halves, generator)
        if len(parts) > 1
    ]
    real = np.concatenate(parts)
    return Compared(
        trait,
        real,
        np.concatenate(clips),
        np.concatenate(noises),
        float(np.mean(apart)) if apart else float("nan"),
        float(np.mean([distance(real, clip) for clip in clips])),
        float(np.mean([distance(real, noise) for noise in noises])),
    )


def _moving(
    palette: Palette, held: Style, real: Motion, clips: list[Motion], noises: list[Motion]
) -> tuple[Moving, ...]:
    shown = [visible(palette, motion) for motion in (real, clips[0], noises[0])]
    heard = between_frames(held.intensity, held.lengths)
    found = []
    for trait in traits_of(palette, held):
        if not trait.name.endswith(" speed") or trait.feature == "blink":
            continue
        feature = trait.feature
        spectra = [spectrum(motion[feature], held.lengths, GESTURE_FPS) for motion in shown]
        together = [
            float(np.mean([correlation(trait.all_of(recordings(one[feature], held.lengths)), heard) for one in kind]))
            for kind in ([real], clips, noises)
        ]
        unlike = [_diversity([one[feature] for one in kind], real[feature], held) for kind in (clips, noises)]
        unit = trait.unit.removesuffix("/s")
        found.append(
            Moving(
                feature,
                "" if unit == "1" else unit,
                (spectra[0], spectra[1], spectra[2]),
                (together[0], together[1], together[2]),
                (unlike[0], unlike[1]),
            )
        )
    return tuple(found)


def _diversity(clips: list[NDArray[np.floating]], real: NDArray[np.floating], held: Style) -> float:
    """Mean over the recordings' sounds of how unlike the clips of one are, against how unlike takes are."""
    if len(held.lengths) < 2:
        return float("nan")
    least = int(held.lengths.min())
    takes = [part[:least] for part in recordings(real, held.lengths)][:N_TAKES]
    cut = [[part[:least] for part in recordings(clip, held.lengths)] for clip in clips]
    return float(np.mean([diversity([clip[at] for clip in cut], takes) for at in range(len(takes))]))
