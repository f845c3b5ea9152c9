"""Coding of baked light in ``.face`` files: all its arrays deflated as one, pictures as JPEG among them."""

import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.baked_light import (
    LEAST_SIDE,
    N_BALL_TERMS,
    N_LAMP_NUMBERS,
    N_MOUTH_TERMS,
    N_PAGES,
    N_TERMS,
    TABLE_SIDE,
    BakedLight,
)
from tts2face.models.picture_coding import decode_colours, encode_colours
from tts2face.storage.deflated import deflate, inflate
from tts2face.storage.schema import (
    MAX_MM,
    Contents,
    Tensor,
    list_of,
    number,
    record,
    row,
    table,
    text,
    whole,
)

MAX_BYTES = 64_000_000  # of all arrays; the light of a shipped face has 6,000,000
MAX_SIDE = 4096
MAX_FACTOR = 1e3  # of any weight or light
PICTURES = ("page0", "page1", "backdrop")
FIELDS = record(
    {
        "arrays": list_of(row(text, text, list_of(whole(0, MAX_BYTES)))),
        "page_of": table(whole(0, N_PAGES - 1)),
        "head_lamps": whole(0, 64),
        "eye_gain": number(0.0, MAX_FACTOR),
    }
)


def _factors(*shape: int | str, low: float = -MAX_FACTOR) -> Tensor:
    return Tensor("float32", shape, low, MAX_FACTOR, may_be_empty=True)


TENSORS: Mapping[str, Tensor] = {
    "triangles": Tensor("int32", ("drawn triangles",)),
    "is_inside": Tensor("bool", ("drawn triangles",)),
    "rows": Tensor("int32", ("lit vertices",), may_be_empty=True),
    "base": Tensor("uint8", ("lit vertices", 3), may_be_empty=True),
    "responses": Tensor("int8", (N_TERMS, 3, "lit vertices"), may_be_empty=True),
    "response_sizes": _factors(N_TERMS),
    "limits": Tensor("int8", (2, 3, "lit vertices"), may_be_empty=True),
    "partners": Tensor("int32", ("partners",), may_be_empty=True),
    "mouth_rows": Tensor("int32", ("vertices of the mouth",), may_be_empty=True),
    "mouth_base": Tensor("uint8", ("vertices of the mouth", 3), may_be_empty=True),
    "mouth_responses": Tensor("int8", (N_MOUTH_TERMS, 3, "vertices of the mouth"), may_be_empty=True),
    "mouth_sizes": _factors(N_MOUTH_TERMS),
    "mouth_limits": Tensor("int8", (2, 3, "vertices of the mouth"), may_be_empty=True),
    "turns_deg": Tensor("float32", ("turns", 2), -90.0, 90.0, may_be_empty=True),
    "turn_weights": _factors("turns", "turn modes"),
    "turn_modes": Tensor("int8", ("turn modes", 3, "texels of change"), may_be_empty=True),
    "camera_yaws_deg": Tensor("float32", ("cameras",), -180.0, 180.0, may_be_empty=True),
    "camera_modes": Tensor("int8", ("cameras", 3, "texels from cameras"), may_be_empty=True),
    "camera_sizes": _factors("cameras"),
    "ball_rows": Tensor("int32", ("lit vertices of eyes",), may_be_empty=True),
    "ball_base": _factors("lit vertices of eyes", 3),
    "ball_responses": Tensor("int8", (N_BALL_TERMS, 3, "lit vertices of eyes"), may_be_empty=True),
    "ball_sizes": _factors(N_BALL_TERMS),
    "lamps": Tensor("float32", ("lamps", N_LAMP_NUMBERS), -MAX_MM, MAX_MM, may_be_empty=True),
    "sky": _factors(3, low=0.0),
    "eye_edges": Tensor("float32", (2,), 0.01, 1.5),
    "view": Tensor("uint8", (TABLE_SIDE, TABLE_SIDE, TABLE_SIDE, 3)),
    **{name: Tensor("uint8", (f"bytes of {name}",)) for name in PICTURES},
}


def encode_light(light: BakedLight) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """Bytes (N,) of light, and the fields that `decode_light` takes with them."""
    arrays = {one.name: getattr(light, one.name) for one in fields(light) if one.name in TENSORS}
    arrays["backdrop"] = encode_colours(light.backdrop)
    arrays |= {f"page{number}": encode_colours(page) for number, page in enumerate(light.pages)}
    content = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays.values())
    return deflate(content), {
        "arrays": [[name, array.dtype.name, list(array.shape)] for name, array in arrays.items()],
        "page_of": dict(light.page_of),
        "head_lamps": light.head_lamps,
        "eye_gain": light.eye_gain,
    }


def decode_light(
    content: NDArray[np.uint8], stored: Mapping[str, Any], sizes: Mapping[str, int], path: Path
) -> BakedLight:
    """Light of what `encode_light` returned, for a face with these numbers of vertices and triangles.

    Raises
    ------
    DataError
        It is damaged, or does not fit the face.
    """
    arrays = _arrays(content, stored, path)
    n_partners = len(arrays.get("rows", ())) + len(arrays.get("ball_rows", ()))
    contents = Contents(path, "face", arrays, {}, {"partners": n_partners})
    contents.tensors(TENSORS)
    contents.only_known()
    for name in ("rows", "partners", "mouth_rows", "ball_rows"):
        contents.indices(name, sizes["vertices"], "vertices")
    drawn = arrays["triangles"]
    numbers = np.where(drawn < 0, ~drawn, drawn)
    contents.require(int(numbers.max()) < sizes["triangles"], f"light draws a triangle beyond its {sizes['triangles']}")
    pages = [decode_colours(arrays[f"page{number}"], path) for number in range(N_PAGES)]
    backdrop = decode_colours(arrays["backdrop"], path)
    side = len(pages[0])
    is_square = (
        all(page.shape == (side, side, 3) for page in pages)
        and LEAST_SIDE <= side <= MAX_SIDE
        and side.bit_count() == 1
    )
    contents.require(is_square, f"pages of light are not squares of a power of two from {LEAST_SIDE}")
    lamps = stored["head_lamps"]
    contents.require(lamps <= len(arrays["lamps"]), f"light has {lamps} head_lamps, but {len(arrays['lamps'])} lamps")
    kept = {name: array for name, array in arrays.items() if name not in PICTURES}
    light = BakedLight(
        **kept,
        pages=np.stack(pages),
        backdrop=backdrop,
        page_of=stored["page_of"],
        head_lamps=lamps,
        eye_gain=stored["eye_gain"],
    )
    contents.require(light.has_whole_pages, "texels of change of light do not fill their pages")
    return light


def _arrays(content: NDArray[np.uint8], stored: Mapping[str, Any], path: Path) -> dict[str, NDArray[Any]]:
    """Arrays by name."""
    FIELDS(stored, f"{path}: metadata: light")
    kinds = {name: (np.dtype(TENSORS[name].dtype), shape) for name, kind, shape in stored["arrays"] if name in TENSORS}
    sizes = {name: math.prod(shape) * kind.itemsize for name, (kind, shape) in kinds.items()}
    raw = inflate(content, min(sum(sizes.values()), MAX_BYTES), "light", path)
    found, at = {}, 0
    for name, (kind, shape) in kinds.items():
        found[name] = np.frombuffer(raw, kind, sizes[name] // kind.itemsize, at).reshape(shape)
        at += sizes[name]
    return found
