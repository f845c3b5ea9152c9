"""Comparison of each style's held-out recordings with motion generated for their sound by fields and by noise."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.gestures.blinks import find_blinks
from corpus_tools.studies.gestures.body import BodyMeasure, measure_body
from corpus_tools.studies.gestures.clips import (
    LongRun,
    field_clip,
    hold_out,
    long_run,
    noise_clip,
    published_clip,
    replace_style,
    sound_of,
)
from corpus_tools.studies.gestures.gaze import GazeStudy, study_gaze
from corpus_tools.studies.gestures.measures import (
    Spectrum,
    diversity,
    frame_midpoints,
    random_halves,
    ratio,
    spectrum,
    split_recordings,
    wasserstein,
)
from corpus_tools.studies.gestures.speech import SpeechMeasure, study_speech
from corpus_tools.studies.gestures.traits import Trait, in_display_units, style_traits
from lexicon.errors import InputError
from lexicon.values.fields import check_fields
from tts2face.gestures.stream import GestureFields
from tts2face.lips.motion_measures import pearson
from tts2face.models.palette import GESTURE_FPS, Palette, Style
from tts2face.numeric.arrays import FloatArray
from tts2face.session.session import Session
from tts2face.types import Progress, ignore_progress

NEAR, HALF = 1.5, 0.5  # maximum distance of a field, relative to the distance between halves and to that of noise
CORRELATION_WITHIN = 0.1
FEWEST = 10  # recordings; with fewer, none is held out
N_TAKES = 60  # recordings whose distances are the reference of diversity

Motion = Mapping[str, NDArray[np.floating]]


@dataclass(frozen=True, slots=True)
class StudyOptions:
    """Options of a study: one in `one_in` recordings is held out; numbers of random halvings and clips; the seed.

    `people` is a folder of recorded gaze, with which the made one is compared; None: it is not. `speaks`: the default
    style speaks sentences, in which head, brows and blinks are compared with people.

    Raises
    ------
    InputError
        A number is too small.
    """

    one_in: int = 5
    halves: int = 50
    clips: int = 3
    seed: int = 0
    people: Path | None = None
    speaks: bool = False

    def __post_init__(self) -> None:
        """Check the types and the numbers."""
        check_fields(self)
        if self.one_in < 2:
            raise InputError(f"one in {self.one_in} recordings cannot be held out; give 2 or more")
        if self.halves < 1:
            raise InputError(f"there must be at least 1 halving, not {self.halves}")
        if self.clips < 2:
            raise InputError(f"seeds are compared with at least 2 clips, not {self.clips}")
        if self.seed < 0:
            raise InputError(f"a seed is a whole number from 0, not {self.seed}")


@dataclass(frozen=True, slots=True, eq=False)
class TraitComparison:
    """Values of a trait in recordings, clips of a field, of noise and of a published field, and Wasserstein distances.

    `halves` is the mean distance between random halves of the recordings; the others are means from all recordings to
    one clip.
    Distances are in the trait's unit. Only measured styles have a clip of the published field; for derived ones
    `published` is empty and `to_published` NaN.
    """

    trait: Trait
    real: FloatArray
    field: FloatArray
    noise: FloatArray
    published: FloatArray
    halves: float
    to_field: float
    to_noise: float
    to_published: float

    @property
    def is_met(self) -> bool:
        """Whether the field is within the targets `NEAR` and `HALF`."""
        return self.to_field <= NEAR * self.halves and self.to_field < HALF * self.to_noise


@dataclass(frozen=True, slots=True, eq=False)
class FeatureComparison:
    """Spectra of a feature, the correlation (r) of its speed with the sound's intensity, and diversity.

    Spectra and r are those of recordings, field, noise and, for measured styles, the published field; diversity is
    that of field and noise.
    """

    feature: str
    unit: str
    spectra: tuple[Spectrum, ...]
    with_intensity: tuple[float, ...]
    diversity: tuple[float, float]

    @property
    def follows_sound(self) -> bool:
        """Whether the correlation of the field is within `CORRELATION_WITHIN` of the recordings'."""
        return abs(self.with_intensity[0] - self.with_intensity[1]) <= CORRELATION_WITHIN

    @property
    def fast_power(self) -> tuple[float, ...]:
        """Power above `measures.FAST_HZ` of field, noise and published field, over that of the recordings."""
        real, *others = (each_spectrum.fast_power for each_spectrum in self.spectra)
        return tuple(ratio(other, real) for other in others)


@dataclass(frozen=True, slots=True, eq=False)
class StyleStudy:
    """Results for one style: `real` is its recordings, or for a derived style the motion of its source's field.

    Only measured styles have long clips and a clip of the published field; derived styles transform long clips.
    `blinks_per_minute` has the order of `FeatureComparison.spectra`.
    """

    name: str
    source: str | None
    summary: str
    n_training: int
    n_held_out: int
    is_held_out: bool
    minutes: float
    blinks_per_minute: tuple[float, ...]
    trait_comparisons: tuple[TraitComparison, ...]
    motion_comparisons: tuple[FeatureComparison, ...]
    long_run: LongRun


@dataclass(frozen=True, slots=True, eq=False)
class GestureStudy:
    """Results for all styles of a palette, and of what the body does whatever the style."""

    name: str
    options: StudyOptions
    styles: tuple[StyleStudy, ...]
    body: tuple[BodyMeasure, ...]
    gaze: GazeStudy | None
    speech: tuple[SpeechMeasure, ...] = ()

    @property
    def targets(self) -> tuple[int, int]:
        """Number of targets of measured styles and of the gaze that are met, and number of targets."""
        measured = [style for style in self.styles if style.source is None]
        kept = [
            compared.is_met for style in measured for compared in style.trait_comparisons if compared.trait.has_target
        ]
        kept += [
            moving.follows_sound
            for style in measured
            for moving in style.motion_comparisons
            if moving.feature == "head"
        ]
        kept += [comparison.is_met for comparison in self.gaze.comparisons] if self.gaze is not None else []
        kept += [measure.is_met for measure in self.speech]
        return sum(kept), len(kept)


def study_gestures(
    name: str, palette: Palette, options: StudyOptions, on_progress: Progress = ignore_progress
) -> GestureStudy:
    """Measure every style of a palette."""
    gaze = None if options.people is None else study_gaze(options.people, seed=options.seed)
    studies: list[StyleStudy] = []
    prepared: dict[str, _PreparedStyle] = {}
    for done, style in enumerate(names := (*palette.styles, *palette.derivations)):
        on_progress(done, len(names))
        source = palette.derivations[style].source if style in palette.derivations else style
        if source not in prepared:
            prepared[source] = _prepare_style(palette, source, options)
        studies.append(_study_style(palette, style, prepared[source], options))
    on_progress(len(names), len(names))
    speech = study_speech(Session(palette=name)) if options.speaks else ()
    return GestureStudy(name, options, tuple(studies), measure_body(options.seed), gaze, speech)


@dataclass(frozen=True, slots=True, eq=False)
class _PreparedStyle:
    """A measured style: training and held-out recordings, fields, and the reference clip of derived styles."""

    training: Style
    held_out: Style
    is_held_out: bool
    fields: GestureFields
    reference_clip: Motion


def _prepare_style(palette: Palette, source: str, options: StudyOptions) -> _PreparedStyle:
    whole = palette.styles[source]
    is_held_out = len(whole.lengths) >= FEWEST
    training, held_out = hold_out(whole, options.one_in, options.seed) if is_held_out else (whole, whole)
    fields = GestureFields(replace_style(palette, source, training))
    reference = _field_motion(fields, source, held_out, options.seed + options.clips) if palette.derivations else {}
    return _PreparedStyle(training, held_out, is_held_out, fields, reference)


def _study_style(palette: Palette, name: str, prepared: _PreparedStyle, options: StudyOptions) -> StyleStudy:
    derived = palette.derivations.get(name)
    source = name if derived is None else derived.source
    training, held_out, fields = prepared.training, prepared.held_out, prepared.fields
    clips = [_field_motion(fields, name, held_out, options.seed + k) for k in range(options.clips)]
    noises = [noise_clip(fields, name, len(held_out.intensity), options.seed + k) for k in range(options.clips)]
    published = [published_clip(fields.palette, name, sound_of(held_out), options.seed)] if derived is None else []
    real = held_out.motion if derived is None else prepared.reference_clip
    kinds = [[real], clips, noises, published]
    return StyleStudy(
        name=name,
        source=None if derived is None else source,
        summary="" if derived is None else derived.summary,
        n_training=len(training.lengths),
        n_held_out=len(held_out.lengths),
        is_held_out=prepared.is_held_out,
        minutes=palette.styles[source].seconds / 60,
        blinks_per_minute=tuple(_blink_rate(kind[0], held_out) for kind in kinds if kind),
        trait_comparisons=tuple(
            _compare_trait(trait, held_out, kinds, options) for trait in style_traits(palette, training)
        ),
        motion_comparisons=_compare_motion(palette, held_out, [kind for kind in kinds if kind]),
        long_run=long_run(fields, name, training, held_out, options.seed) if derived is None else LongRun({}, {}),
    )


def _field_motion(fields: GestureFields, name: str, held_out: Style, seed: int) -> Motion:
    sound = sound_of(held_out)
    return {feature: field_clip(fields, name, feature, sound, seed).values for feature in held_out.motion}


def _blink_rate(motion: Motion, held_out: Style) -> float:
    return find_blinks(motion["blink"], held_out.lengths, GESTURE_FPS).per_minute if "blink" in motion else float("nan")


def _compare_trait(trait: Trait, held_out: Style, kinds: list[list[Motion]], options: StudyOptions) -> TraitComparison:
    def values_of(motion: Motion) -> list[FloatArray]:
        return [trait.of(part) for part in split_recordings(motion[trait.feature], held_out.lengths)]

    parts = values_of(kinds[0][0])
    clips, noises, published = ([np.concatenate(values_of(clip)) for clip in kind] for kind in kinds[1:])
    generator = np.random.default_rng([options.seed, 2])
    between_halves = [
        wasserstein(np.concatenate([parts[i] for i in half]), np.concatenate([parts[i] for i in other]))
        for half, other in random_halves(len(parts), options.halves, generator)
        if len(parts) > 1
    ]
    real = np.concatenate(parts)
    return TraitComparison(
        trait,
        real,
        np.concatenate(clips),
        np.concatenate(noises),
        np.concatenate([np.zeros(0), *published]),
        float(np.mean(between_halves)) if between_halves else float("nan"),
        *(
            float(np.mean([wasserstein(real, clip) for clip in kind])) if kind else float("nan")
            for kind in (clips, noises, published)
        ),
    )


def _compare_motion(palette: Palette, held_out: Style, kinds: list[list[Motion]]) -> tuple[FeatureComparison, ...]:
    (real,), clips, noises, *_ = kinds
    shown = [in_display_units(palette, kind[0]) for kind in kinds]
    intensity = frame_midpoints(held_out.intensity, held_out.lengths)
    found = []
    for trait in style_traits(palette, held_out):
        # one row for each motion; blinks are events, compared by their own traits
        if not trait.name.endswith(" speed") or trait.feature == "blink":
            continue
        feature = trait.feature
        spectra = [spectrum(motion[feature], held_out.lengths, GESTURE_FPS) for motion in shown]
        correlations = [
            float(
                np.mean(
                    [
                        pearson(trait.values_of(split_recordings(item[feature], held_out.lengths)), intensity)
                        for item in kind
                    ]
                )
            )
            for kind in kinds
        ]
        diversities = [
            _diversity([item[feature] for item in kind], real[feature], held_out) for kind in (clips, noises)
        ]
        unit = trait.unit.removesuffix("/s")
        found.append(
            FeatureComparison(
                feature,
                "" if unit == "1" else unit,
                tuple(spectra),
                tuple(correlations),
                (diversities[0], diversities[1]),
            )
        )
    return tuple(found)


def _diversity(clips: list[NDArray[np.floating]], real: NDArray[np.floating], held_out: Style) -> float:
    """Mean of `diversity` over the sounds of the recordings."""
    # distances between recordings need two
    if len(held_out.lengths) < 2:
        return float("nan")
    least = int(held_out.lengths.min())
    takes = [part[:least] for part in split_recordings(real, held_out.lengths)][:N_TAKES]
    cut = [[part[:least] for part in split_recordings(clip, held_out.lengths)] for clip in clips]
    return float(np.mean([diversity([clip[at] for clip in cut], takes) for at in range(len(takes))]))
