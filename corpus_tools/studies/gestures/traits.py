"""Traits of gestures that are compared: a number for each frame or each blink of a recording."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from corpus_tools.studies.gestures.blinks import Blinks, find_blinks
from corpus_tools.studies.gestures.measures import Motion
from tts2face.gestures.stream import style_median
from tts2face.models.palette import GESTURE_FPS, Palette, Style
from tts2face.numeric.arrays import FloatArray

IN_DEGREES = 180.0 / np.pi
INTERVALS = "blink interval"


@dataclass(frozen=True, slots=True)
class Trait:
    """A trait: its name, unit and feature, and the function that computes it from a recording's motion (T, k).

    Fields must reproduce the recorded distribution of traits with a target (docs/gestures.md).
    """

    name: str
    unit: str
    feature: str
    of: Callable[[Motion], FloatArray]
    has_target: bool = False

    def values_of(self, parts: Sequence[Motion]) -> FloatArray:
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


def _blink_trait(value: Callable[[Blinks], FloatArray]) -> Callable[[Motion], FloatArray]:
    return lambda part: value(find_blinks(part, np.array([len(part)], np.int32), GESTURE_FPS))


BLINKS: tuple[tuple[str, str, Callable[[Motion], FloatArray]], ...] = (
    (INTERVALS, "s", _blink_trait(lambda found: found.intervals)),
    ("blink duration", "s", _blink_trait(lambda found: found.durations)),
    ("closing time", "s", _blink_trait(lambda found: found.closing)),
    ("opening time", "s", _blink_trait(lambda found: found.opening)),
    ("closing speed", "1/s", _blink_trait(lambda found: found.closing_speeds)),
    ("opening speed", "1/s", _blink_trait(lambda found: found.opening_speeds)),
)


def _motion_traits(palette: Palette, feature: str, middle: FloatArray) -> list[Trait]:
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
