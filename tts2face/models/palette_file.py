"""Reading and writing of ``.palette`` files (docs/file-formats.md)."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.checks import Check, free, number, record, table, text
from tts2face.models.codec import Stored, StoredModel, check_model, half, model_of, stored_arrays
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.palette import (
    FEATURES,
    FIXED_CHANNELS,
    GESTURE_FPS,
    PLAIN,
    REGION_FEATURES,
    Delivery,
    Derivation,
    FaceRegion,
    FeatureChange,
    Palette,
    Style,
)
from tts2face.processes.shared import Shared, file_state
from tts2face.storage.schema import Contents, Tensor, millimetres, refuse
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors, write_tensors

KIND = "palette"
FORMAT_VERSION = 1
STEPS_PER_SPREAD = 2000.0  # 16-bit steps per standard deviation: finer than the noise of trackers
MAX_VALUE = 1e4  # of any motion: mm, radians, or weights; 16 bits in steps of 1/2000 of the spread reach 16 spreads
LOUDNESS_DB = 400.0  # of either sign
SEMITONES = 120.0  # ten octaves
# of a derived style
MAX_GAIN = 100.0
# A tempo of 0.05 stretches 30 frames to 20 s; one of 20 gives 600 frames/s, the most that a clip can use.
SLOWEST, FASTEST = 0.05, 20.0

# of the voice; level and pitch of either sign
RATE_FACTORS, RANGE_FACTORS = (0.5, 2.0), (0.0, 2.0)
LEVEL_DB = PITCH = 12.0

_CHANGE = record(
    {},
    {
        "gain": number(-MAX_GAIN, MAX_GAIN),
        "offset": table(number(-MAX_VALUE, MAX_VALUE)),
        "tempo": number(SLOWEST, FASTEST),
    },
)
_DELIVERY = record(
    {},
    {
        "rate": number(*RATE_FACTORS),
        "level_db": number(-LEVEL_DB, LEVEL_DB),
        "pitch": number(-PITCH, PITCH),
        "range": number(*RANGE_FACTORS),
    },
)
METADATA: Mapping[str, Check] = {
    "metadata": free,
    "fps": number(1.0, 1000.0),
    "styles": table(free),
    "derivations": table(record({"source": text, "summary": text, "changes": table(_CHANGE)}, {"delivery": _DELIVERY})),
}
_PALETTES: Shared[Palette] = Shared()


@dataclass(frozen=True, slots=True, eq=False)
class StoredStyle(StoredModel):
    """Loudness, pitch and lengths of the recordings of a style, in a file."""

    intensity: Annotated[NDArray[np.float32], half("frames of {own}", low=-LOUDNESS_DB, high=LOUDNESS_DB)]
    pitch: Annotated[NDArray[np.float32], half("frames of {own}", low=-SEMITONES, high=SEMITONES)]
    lengths: Annotated[NDArray[np.int32], Tensor("int32", ("recordings of {own}",), 1)]

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse recordings of another number of frames."""
        contents.sums_to(f"{prefix}.lengths", len(contents.arrays[f"{prefix}.intensity"]), "frames of intensity")


@dataclass(frozen=True, slots=True, eq=False)
class StoredMotion(StoredModel):
    """Motion (T, k) of a feature of a style in whole steps (k,); a style need not have all features."""

    values: Annotated[
        NDArray[np.int16], Stored(Tensor("int16", ("frames of {around}", "modes of {name}"), is_optional=True), "")
    ]
    step: Annotated[NDArray[np.float32], Tensor("float32", ("modes of {name}",), 0.0, MAX_VALUE, is_optional=True)]

    @classmethod
    def of(cls, values: NDArray[np.float32], step: NDArray[np.float32] | None) -> "StoredMotion":
        """Motion in the steps of the file from which it was read, or of its spread."""
        if step is None:
            # written with the steps that it was read with, a style stays equal bit by bit (decision 151)
            step = np.maximum(values.std(axis=0), 1e-6) / STEPS_PER_SPREAD
        return cls(np.clip(np.rint(values / step), -32768, 32767), step)

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse motion without steps, or beyond what faces can do."""
        step = f"{prefix}.step"
        if prefix not in contents.arrays:
            return
        contents.require(step in contents.arrays, f"lacks the array {step}")
        steps = contents.arrays[step]
        contents.require(bool((steps > 0).all()), f"{step} holds 0; steps must be above 0")
        largest = float(np.abs(contents.arrays[prefix].astype(np.int32)).max() * np.float64(steps.max()))
        contents.require(largest <= MAX_VALUE, f"{prefix} in steps of {step} reaches {largest:g}, beyond {MAX_VALUE:g}")


def write_palette(path: Path, palette: Palette) -> None:
    """Write a ``.palette`` file; values as read, or in steps of 1/2000 of their spread."""
    arrays: dict[str, NDArray[Any]] = {"neutral": palette.neutral}
    for name, region in palette.regions.items():
        arrays |= stored_arrays(region, f"region.{name}")
    for name, style in palette.styles.items():
        arrays |= stored_arrays(StoredStyle(style.intensity, style.pitch, style.lengths), f"style.{name}")
        for feature, values in style.motion.items():
            arrays |= stored_arrays(StoredMotion.of(values, style.steps.get(feature)), f"style.{name}.{feature}")
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
        The file is damaged, of another kind, version or frame rate, or invalid.
    """
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    contents = Contents(path, KIND, arrays, header)
    _check(contents)
    # fields search windows of frames, whose length depends on the rate
    if header["fps"] != GESTURE_FPS:
        raise DataError(f"{path} was recorded at {header['fps']:g} frames/s, not {GESTURE_FPS:g}; build it again")
    return _palette_of(contents)


def load_palette(name: str) -> Palette:
    """A shipped palette by name, or one from a ``.palette`` file; errors as `find_file` and `read_palette`.

    All who load the same file share one palette; a file that has changed is read again.
    """
    path = find_file(name, KIND)
    return _PALETTES.get(file_state(path), lambda: read_palette(path))


def _check(contents: Contents) -> None:
    contents.metadata(METADATA)
    contents.tensors({"neutral": millimetres(N_LANDMARKS, 3)})
    contents.sizes |= {f"modes of {name}": len(channels) for name, channels in FIXED_CHANNELS.items()}
    for name in REGION_FEATURES:
        check_model(FaceRegion, contents, f"region.{name}")
    for style in contents.header["styles"]:
        check_model(StoredStyle, contents, f"style.{style}")
        for feature in FEATURES:
            check_model(StoredMotion, contents, f"style.{style}.{feature}")
    contents.only_known()
    _check_derivations(contents)


def _check_derivations(contents: Contents) -> None:
    header = contents.header
    contents.require(bool(header["styles"]), "holds no style")
    duplicates = sorted(header["styles"].keys() & header["derivations"].keys())
    contents.require(not duplicates, f"has a recorded and a derived style of the name {duplicates[:1]}")
    for name, derived in header["derivations"].items():
        for feature, change in derived["changes"].items():
            where = f"{contents.path}: the derived style {name!r} changes"
            if feature not in FEATURES:
                refuse(f"{where} {feature!r}; it must be one of {', '.join(FEATURES)}", "palette")
            known = FIXED_CHANNELS.get(feature)
            if known is None:
                known = tuple(f"{feature}{i}" for i in range(contents.sizes["modes of " + feature]))
            for channel in change.get("offset", {}):
                if channel not in known:
                    refuse(f"{where} {channel!r} of {feature}; it must be one of {', '.join(known)}", "palette")


def _palette_of(contents: Contents) -> Palette:
    header = contents.header
    return Palette(
        neutral=contents.arrays["neutral"],
        regions={name: model_of(FaceRegion, contents, f"region.{name}") for name in REGION_FEATURES},
        styles={name: _style_of(name, contents, metadata) for name, metadata in header["styles"].items()},
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


def _style_of(name: str, contents: Contents, metadata: Mapping[str, Any]) -> Style:
    stored = model_of(StoredStyle, contents, f"style.{name}")
    motion = dict(_motion_of(name, contents))
    return Style(
        lengths=stored.lengths,
        intensity=stored.intensity,
        pitch=stored.pitch,
        motion={feature: moved.values * moved.step for feature, moved in motion.items()},
        metadata=metadata,
        steps={feature: moved.step for feature, moved in motion.items()},
    )


def _motion_of(style: str, contents: Contents) -> Iterator[tuple[str, StoredMotion]]:
    """Each feature that a style has, with its motion."""
    for feature in FEATURES:
        if f"style.{style}.{feature}" in contents.arrays:
            yield feature, model_of(StoredMotion, contents, f"style.{style}.{feature}")
