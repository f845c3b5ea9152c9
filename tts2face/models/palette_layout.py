"""Schema of ``.palette`` files (docs/file-formats.md), checked when a file is read."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import N_LANDMARKS
from tts2face.storage.schema import Check, Contents, Tensor, free, millimetres, number, record, refuse, table, text

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
