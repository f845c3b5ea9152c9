"""Gesture palettes: recorded facial gestures of speakers as named styles, and the ``.palette`` file format.

After Ju and Lee 2008: a style holds one speaker's recorded gestures without the speech motion of the lips. All styles
are motion of one common face, so that styles of different speakers can be mixed.

Schema of ``.palette`` files (docs/file-formats.md), checked when a file is read.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.checks import Check, free, number, record, table, text
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.processes.shared import Shared, file_state
from tts2face.storage.schema import Contents, Tensor, millimetres, refuse
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.types import HEAD_CHANNELS

MAX_MODES = 64  # of a region
MAX_VALUE = 1e4  # of any motion: mm, radians, or weights; 16 bits in steps of 1/2000 of the spread reach 16 spreads
LOUDNESS_DB = 400.0  # of either sign
SEMITONES = 120.0  # ten octaves
MAX_GAIN = 100.0
# A tempo of 0.05 stretches 30 frames to 20 s; one of 20 gives 600 frames/s, the most that a clip can use.
SLOWEST, FASTEST = 0.05, 20.0

RATE_FACTORS, LEVEL_DB = (0.5, 2.0), 12.0  # of the voice; level of either sign

_CHANGE = record(
    {},
    {
        "gain": number(-MAX_GAIN, MAX_GAIN),
        "offset": table(number(-MAX_VALUE, MAX_VALUE)),
        "tempo": number(SLOWEST, FASTEST),
    },
)
_DELIVERY = record({}, {"rate": number(*RATE_FACTORS), "level_db": number(-LEVEL_DB, LEVEL_DB)})
METADATA: Mapping[str, Check] = {
    "metadata": free,
    "fps": number(1.0, 1000.0),
    "styles": table(free),
    "derivations": table(record({"source": text, "summary": text, "changes": table(_CHANGE)}, {"delivery": _DELIVERY})),
}


def check_palette(
    path: Path,
    arrays: Mapping[str, NDArray[Any]],
    header: Mapping[str, Any],
    channels: Mapping[str, tuple[str, ...] | None],
) -> None:
    """Check the arrays and metadata of a palette file.

    Parameters
    ----------
    channels
        Channels of each feature; None for the modes of a region of that name.

    Raises
    ------
    DataError
        A part is missing, has the wrong type or shape, is out of range or not finite, or contradicts another part.
    """
    contents = Contents(path, "palette", arrays, header)
    contents.metadata(METADATA)
    contents.tensors({"neutral": millimetres(N_LANDMARKS, 3)})
    widths = {name: ("modes of " + name if known is None else len(known)) for name, known in channels.items()}
    for name, known in channels.items():
        if known is None:
            _check_region(contents, name)
    for style in header["styles"]:
        _check_style(contents, style, widths)
    contents.only_known()
    _check_derivations(contents, channels)


def _check_region(contents: Contents, name: str) -> None:
    landmarks, modes = f"region.{name}.landmarks", f"region.{name}.modes"
    contents.tensors(
        {
            landmarks: Tensor("int32", (f"landmarks of {name}",)),
            modes: Tensor("float32", (f"modes of {name}", f"landmarks of {name}", 3), -1.01, 1.01),
        }
    )
    contents.indices(landmarks, N_LANDMARKS, "landmarks of the face mesh")
    contents.distinct(landmarks)
    n_modes = contents.sizes[f"modes of {name}"]
    contents.require(n_modes <= MAX_MODES, f"{modes} are {n_modes}; at most {MAX_MODES} are possible")
    contents.orthonormal(modes)


def _check_style(contents: Contents, style: str, widths: Mapping[str, int | str]) -> None:
    prefix, frames = f"style.{style}", f"frames of {style}"
    contents.tensors(
        {
            f"{prefix}.intensity": Tensor("float16", (frames,), -LOUDNESS_DB, LOUDNESS_DB),
            f"{prefix}.pitch": Tensor("float16", (frames,), -SEMITONES, SEMITONES),
            f"{prefix}.lengths": Tensor("int32", (f"recordings of {style}",), 1),
        }
    )
    contents.sums_to(f"{prefix}.lengths", contents.sizes[frames], "frames of intensity")
    for feature, width in widths.items():
        values, step = f"{prefix}.{feature}", f"{prefix}.{feature}.step"
        present = values in contents.arrays
        contents.tensors(
            {
                values: Tensor("int16", (frames, width), is_optional=True),
                step: Tensor("float32", (width,), 0.0, MAX_VALUE, is_optional=not present),
            }
        )
        if present:
            steps = contents.arrays[step]
            contents.require(bool((steps > 0).all()), f"{step} holds 0; steps must be above 0")
            largest = float(np.abs(contents.arrays[values].astype(np.int32)).max() * np.float64(steps.max()))
            contents.require(
                largest <= MAX_VALUE, f"{values} in steps of {step} reaches {largest:g}, beyond {MAX_VALUE:g}"
            )


def _check_derivations(contents: Contents, channels: Mapping[str, tuple[str, ...] | None]) -> None:
    header = contents.header
    contents.require(bool(header["styles"]), "holds no style")
    duplicates = sorted(header["styles"].keys() & header["derivations"].keys())
    contents.require(not duplicates, f"has a recorded and a derived style of the name {duplicates[:1]}")
    for name, derived in header["derivations"].items():
        for feature, change in derived["changes"].items():
            where = f"{contents.path}: the derived style {name!r} changes"
            if feature not in channels:
                refuse(f"{where} {feature!r}; it must be one of {', '.join(channels)}", "palette")
            known = channels[feature]
            if known is None:
                known = tuple(f"{feature}{i}" for i in range(contents.sizes["modes of " + feature]))
            for channel in change.get("offset", {}):
                if channel not in known:
                    refuse(f"{where} {channel!r} of {feature}; it must be one of {', '.join(known)}", "palette")


KIND = "palette"
FORMAT_VERSION = 1
GESTURE_FPS = 30.0  # Ju and Lee 2008, section 3; the frame rate of every style
STEPS_PER_SPREAD = 2000.0  # 16-bit steps per standard deviation: finer than the noise of trackers

EXPRESSIONS = ("sad", "happy", "afraid", "angry", "surprised")  # neutral, the sixth, is the face at rest
EYE_CHANNELS = ("left", "right")  # of the speaker
# Channels of the features that are the same in every palette; "brows" and "cheeks" have one channel per mode of the
# palette's regions. Units: weights of basis expressions; closure of the lids (0 to 1); radians (down, to the own left);
# radians and mm.
FIXED_CHANNELS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"expression": EXPRESSIONS, "blink": EYE_CHANNELS, "gaze": ("pitch", "yaw"), "head": HEAD_CHANNELS}
)
REGION_FEATURES = ("brows", "cheeks")
MEASURED_STYLE = "measured"  # the recorded motion from which the default style is derived, unchanged
FEATURES = ("expression", "brows", "blink", "cheeks", "gaze", "head")

Float32Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class FaceRegion:
    """Independent motion D_j of a region of the face: ``displacement = sum_i d_i modes_i``.

    Parameters
    ----------
    landmarks : (L,)
        Indices of `tts2face.models.landmarks`.
    modes : (k, L, 3)
        Orthonormal as rows of (k, 3 L); values d are in mm.
    """

    landmarks: NDArray[np.int32]
    modes: Float32Array


@dataclass(frozen=True, slots=True, eq=False)
class Style:
    """Recorded gestures of one speaker in one mood: concatenated recordings at `GESTURE_FPS`.

    Parameters
    ----------
    lengths : (R,)
        Frames of each recording.
    intensity : (T,)
        Sound level in dB relative to the mean level of the speech; silence is far below 0.
    pitch : (T,)
        Semitones relative to the median of the recording; 0 on unvoiced frames.
    motion
        (T, k) values of each recorded feature of `FEATURES`.
    metadata
        At least sources, licence, attribution and command.
    steps
        (k,) steps of each feature's values in the file from which the style was read, so that it is written unchanged;
        empty for new motion.
    """

    lengths: NDArray[np.int32]
    intensity: Float32Array
    pitch: Float32Array
    motion: Mapping[str, Float32Array]
    metadata: Mapping[str, Any] = field(default_factory=dict)
    steps: Mapping[str, Float32Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that all parts have the same number of frames, then make the arrays read-only."""
        n_frames = int(self.lengths.sum())
        if n_frames == 0 or not len(self.intensity) == len(self.pitch) == n_frames:
            raise DataError("a style's recordings, intensity and pitch differ in length; build the palette again")
        for name, values in self.motion.items():
            if name not in FEATURES or len(values) != n_frames:
                raise DataError(f"a style's {name} does not fit its {n_frames} frames; build the palette again")
        for array in (self.lengths, self.intensity, self.pitch, *self.motion.values(), *self.steps.values()):
            array.setflags(write=False)

    @property
    def seconds(self) -> float:
        """Duration of all recordings in seconds."""
        return float(self.lengths.sum()) / GESTURE_FPS


@dataclass(frozen=True, slots=True)
class FeatureChange:
    """Change of a feature of a recorded style.

    ``gain`` multiplies the motion about its mean, ``offset`` is added to channels by name, ``tempo`` multiplies the
    playback speed.
    """

    gain: float = 1.0
    offset: Mapping[str, float] = field(default_factory=dict)
    tempo: float = 1.0


@dataclass(frozen=True, slots=True)
class Delivery:
    """How a voice speaks under a style: factor of the speaking rate, and gain of the sound in dB."""

    rate: float = 1.0
    level_db: float = 0.0

    @property
    def volume(self) -> float:
        """The gain as a factor."""
        return math.pow(10.0, self.level_db / 20.0)


PLAIN = Delivery()


@dataclass(frozen=True, slots=True)
class Derivation:
    """Derived style: the recorded style ``source`` with changes by feature, and its delivery."""

    source: str
    changes: Mapping[str, FeatureChange]
    summary: str
    delivery: Delivery = PLAIN


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Palette:
    """Recorded and derived gesture styles by name.

    Parameters
    ----------
    neutral : (478, 3)
        Landmarks at rest of the face that all styles move, mm; axes as in `tts2face.models.landmarks`.
    regions
        Region of each of `REGION_FEATURES`.
    styles, derivations
        Recorded styles, and those derived from them.
    """

    neutral: Float32Array
    regions: Mapping[str, FaceRegion]
    styles: Mapping[str, Style]
    derivations: Mapping[str, Derivation]
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that there are styles, that their channels agree, and that the source of each derived style exists."""
        if not self.styles:
            raise DataError("the palette holds no style; build it with `tts2face corpus gestures`")
        for name, style in self.styles.items():
            for feature, values in style.motion.items():
                if values.shape[1] != len(self.channels(feature)):
                    raise DataError(f"{feature} of the style {name} has {values.shape[1]} channels; build it again")
        for name, derived in self.derivations.items():
            if derived.source not in self.styles:
                raise DataError(f"the style {name} is derived from {derived.source}, which is missing; build it again")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all styles, the derived ones first, `MEASURED_STYLE` last."""
        return tuple(dict.fromkeys([*self.derivations, *self.styles, MEASURED_STYLE]))

    def source(self, name: str) -> str:
        """Recorded style that a style is or is derived from; for `MEASURED_STYLE` that of the first derived style.

        Raises
        ------
        InputError
            The palette has no style of this name.
        """
        if name in self.styles:
            return name
        if name in self.derivations:
            return self.derivations[name].source
        self.require(name)
        first = next(iter(self.derivations.values()), None)
        return next(iter(self.styles)) if first is None else first.source

    @property
    def deliveries(self) -> Mapping[str, Delivery]:
        """Deliveries of the styles by name; recorded styles have none."""
        return {name: derived.delivery for name, derived in self.derivations.items()}

    def channels(self, feature: str) -> tuple[str, ...]:
        """Names of a feature's channels."""
        if feature in REGION_FEATURES:
            return tuple(f"{feature}{i}" for i in range(len(self.regions[feature].modes)))
        return FIXED_CHANNELS[feature]

    @property
    def brow_lift(self) -> NDArray[np.float64]:
        """(k,) mean height in mm of the brows' landmarks for one unit of each of their modes."""
        return np.asarray(self.regions["brows"].modes[:, :, 1].mean(axis=1), np.float64)

    def require(self, name: str) -> str:
        """Return the name of an existing style.

        Raises
        ------
        InputError
            The palette has no style of this name.
        """
        if name not in self.names:
            raise InputError(f"there is no style {name!r} in the palette; it has {', '.join(self.names)}")
        return name


def write_palette(path: Path, palette: Palette) -> None:
    """Write a ``.palette`` file (docs/file-formats.md); values as read, or in steps of 1/2000 of their spread."""
    arrays: dict[str, NDArray[Any]] = {"neutral": palette.neutral}
    for name, region in palette.regions.items():
        arrays |= {f"region.{name}.landmarks": region.landmarks, f"region.{name}.modes": region.modes}
    for name, style in palette.styles.items():
        arrays |= {
            f"style.{name}.lengths": style.lengths.astype(np.int32),
            f"style.{name}.intensity": style.intensity.astype(np.float16),
            f"style.{name}.pitch": style.pitch.astype(np.float16),
        }
        for feature, values in style.motion.items():
            step = style.steps.get(feature)
            if step is None:
                step = np.maximum(values.std(axis=0), 1e-6) / STEPS_PER_SPREAD
            arrays[f"style.{name}.{feature}"] = np.clip(np.rint(values / step), -32768, 32767).astype(np.int16)
            arrays[f"style.{name}.{feature}.step"] = step.astype(np.float32)
    header = {
        "metadata": dict(palette.metadata),
        "fps": GESTURE_FPS,
        "styles": {name: dict(style.metadata) for name, style in palette.styles.items()},
        "derivations": {
            name: {
                "source": derived.source,
                "summary": derived.summary,
                "changes": {
                    feature: {"gain": change.gain, "offset": dict(change.offset), "tempo": change.tempo}
                    for feature, change in derived.changes.items()
                },
                **({"delivery": asdict(derived.delivery)} if derived.delivery != PLAIN else {}),
            }
            for name, derived in palette.derivations.items()
        },
    }
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header)


def read_palette(path: Path) -> Palette:
    """Read a ``.palette`` file.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file is damaged, of another kind, version or frame rate, or invalid (`tts2face.models.palette`).
    """
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    check_palette(path, arrays, header, {name: FIXED_CHANNELS.get(name) for name in FEATURES})
    if header["fps"] != GESTURE_FPS:
        raise DataError(f"{path} was recorded at {header['fps']:g} frames/s, not {GESTURE_FPS:g}; build it again")
    return _palette_from_arrays(arrays, header)


def load_palette(name: str) -> Palette:
    """A shipped palette by name, or one from a ``.palette`` file; errors as `find_file` and `read_palette`.

    All who load the same file share one palette; a file that has changed is read again.
    """
    path = find_file(name, KIND)
    return _PALETTES.get(file_state(path), lambda: read_palette(path))


_PALETTES: Shared[Palette] = Shared()


def _palette_from_arrays(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any]) -> Palette:
    regions = {
        name: FaceRegion(arrays[f"region.{name}.landmarks"], arrays[f"region.{name}.modes"]) for name in REGION_FEATURES
    }
    return Palette(
        neutral=arrays["neutral"],
        regions=regions,
        styles={name: _style_from_arrays(name, arrays, metadata) for name, metadata in header["styles"].items()},
        derivations={
            name: Derivation(
                derived["source"],
                {feature: FeatureChange(**change) for feature, change in derived["changes"].items()},
                derived["summary"],
                Delivery(**derived.get("delivery", {})),
            )
            for name, derived in header["derivations"].items()
        },
        metadata=header["metadata"],
    )


def _style_from_arrays(name: str, arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> Style:
    features = [feature for feature in FEATURES if f"style.{name}.{feature}" in arrays]
    steps = {feature: arrays[f"style.{name}.{feature}.step"] for feature in features}
    motion = {feature: arrays[f"style.{name}.{feature}"] * steps[feature] for feature in features}
    return Style(
        lengths=arrays[f"style.{name}.lengths"],
        intensity=arrays[f"style.{name}.intensity"].astype(np.float32),
        pitch=arrays[f"style.{name}.pitch"].astype(np.float32),
        motion=motion,
        metadata=metadata,
        steps=steps,
    )
