"""Coding of baked light in ``.face`` files: all its arrays deflated as one, pictures as JPEG among them.

Coding of the displacements of shapes in files: sparse, in steps of 16 bits.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.values.checks import anything, number, record, table, whole
from tts2face.models.baked_light import (
    LEAST_SIDE,
    N_BALL_TERMS,
    N_LAMP_NUMBERS,
    N_MOUTH_TERMS,
    N_PAGES,
    N_TERMS,
    TABLE_SIDE,
    BakedLight,
    HairLight,
    HairTint,
    fills_pages,
)
from tts2face.numeric.arrays import zeros_with_room
from tts2face.storage.deflated import pack_arrays, unpack_arrays
from tts2face.storage.model_pictures import JPEG_QUALITY, decode_colours, encode_colours
from tts2face.storage.schema import MAX_MM, Contents, ModelPlace, Tensor

MAX_SIDE = 4096
MAX_FACTOR = 1e3  # of any weight or light
HAIR_QUALITY = 85  # of the JPEG pictures of haircuts; 92 takes 100 kB more of each
PICTURES = ("page0", "page1", "backdrop", "tint")
ARRAYS = {"arrays": anything}  # checked when they are inflated
FIELDS = record(
    {
        **ARRAYS,
        "page_of": table(whole(0, N_PAGES - 1)),
        "head_lamps": whole(0, 64),
        "eye_gain": number(0.0, MAX_FACTOR),
    }
)
HAIR_FIELDS = record(ARRAYS)


def _factors(*shape: int | str, low: float = -MAX_FACTOR) -> Tensor:
    return Tensor("float32", shape, low, MAX_FACTOR, may_be_empty=True)


TENSORS: Mapping[str, Tensor] = {
    "triangle_steps": Tensor("int32", ("drawn triangles",)),  # from one to the next
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
    **{name: Tensor("uint8", (f"bytes of {name}",), is_optional=name == "tint") for name in PICTURES},
    "tint_colours": Tensor("float32", ("colours of the hair", 3), 0.0, 1.0, is_optional=True),
    "tint_vertices": Tensor("uint8", ("other colours", "vertices of the hair", 3), is_optional=True),
}
OF_HAIR = {
    name: TENSORS[name]
    for name in (
        *("page0", "page1", "triangle_steps", "is_inside", "base", "turns_deg", "turn_weights", "turn_modes"),
        *("camera_yaws_deg", "camera_modes", "camera_sizes", "tint", "tint_colours", "tint_vertices"),
    )
}


def encode_light(light: BakedLight) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """Bytes (N,) of light, and the fields that `decode_light` takes with them."""
    content, stored = _encoded(light, {"backdrop": encode_colours(light.backdrop)})
    more = {"page_of": dict(light.page_of), "head_lamps": light.head_lamps, "eye_gain": light.eye_gain}
    return content, stored | more


def encode_hair_light(light: HairLight) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """Bytes (N,) of light with another haircut, and the fields that `decode_hair_light` takes with them."""
    return _encoded(light, {})


def _encoded(light: BakedLight | HairLight, pictures: Mapping[str, Any]) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    arrays = {one.name: getattr(light, one.name) for one in fields(light) if one.name in TENSORS} | dict(pictures)
    if light.tint is None:
        arrays.pop("tint", None)
    else:
        pages = np.concatenate(list(light.tint.pages))
        tint = {"tint": encode_colours(pages, HAIR_QUALITY), "tint_colours": light.tint.colours}
        arrays |= tint | {"tint_vertices": light.tint.vertices}
    arrays["triangle_steps"] = np.diff(light.triangles, prepend=np.int32(0))
    quality = JPEG_QUALITY if isinstance(light, BakedLight) else HAIR_QUALITY
    arrays |= {f"page{number}": encode_colours(page, quality) for number, page in enumerate(light.pages)}
    content, listed = pack_arrays(arrays)
    return content, {"arrays": listed}


def decode_light(
    content: NDArray[np.uint8], stored: Mapping[str, Any], sizes: Mapping[str, int], path: Path
) -> BakedLight:
    """Light of what `encode_light` returned, for a face with these numbers of vertices and triangles.

    Raises
    ------
    DataError
        It is damaged, or does not fit the face.
    """
    FIELDS(stored, ModelPlace(f"{path}: metadata: light"))
    arrays = unpack_arrays(content, stored["arrays"], "light", path)
    n_partners = len(arrays.get("rows", ())) + len(arrays.get("ball_rows", ()))
    contents = Contents(path, "face", arrays, {}, {"partners": n_partners})
    contents.tensors(TENSORS)
    for name in ("rows", "partners", "mouth_rows", "ball_rows"):
        contents.indices(name, sizes["vertices"], "vertices")
    kept = _checked(contents, sizes)
    lamps = stored["head_lamps"]
    contents.require(lamps <= len(arrays["lamps"]), f"light has {lamps} head_lamps, but {len(arrays['lamps'])} lamps")
    return BakedLight(
        **kept,
        backdrop=decode_colours(arrays["backdrop"], path),
        page_of=stored["page_of"],
        head_lamps=lamps,
        eye_gain=stored["eye_gain"],
    )


def decode_hair_light(
    content: NDArray[np.uint8], stored: Mapping[str, Any], sizes: Mapping[str, int], path: Path
) -> HairLight:
    """Light of what `encode_hair_light` returned, for a face with so many vertices and triangles with the haircut.

    Raises
    ------
    DataError
        It is damaged.
    """
    HAIR_FIELDS(stored, ModelPlace(f"{path}: metadata: light"))
    contents = Contents(path, "haircut", unpack_arrays(content, stored["arrays"], "light", path), {})
    contents.tensors(OF_HAIR)
    return HairLight(**_checked(contents, sizes))


def _checked(contents: Contents, sizes: Mapping[str, int]) -> dict[str, Any]:
    """Attributes that are both of light and of light with another haircut, checked, with the others that are arrays."""
    arrays, path = contents.arrays, contents.path
    contents.only_known()
    drawn = np.cumsum(arrays["triangle_steps"], dtype=np.int64)
    numbers = np.where(drawn < 0, ~drawn, drawn)
    contents.require(int(numbers.max()) < sizes["triangles"], f"light draws a triangle beyond its {sizes['triangles']}")
    pages = [decode_colours(arrays[f"page{number}"], path) for number in range(N_PAGES)]
    sides = pages[0].shape[:2]
    fit = all(page.shape == (*sides, 3) for page in pages) and all(
        LEAST_SIDE <= side <= MAX_SIDE and side.bit_count() == 1 for side in sides
    )
    contents.require(fit, f"pages of light differ, or have a side that is not a power of two from {LEAST_SIDE}")
    whole = fills_pages(arrays["turn_modes"].shape[2], arrays["camera_modes"].shape[2])
    contents.require(whole, "texels of change of light do not fill their pages")
    coded = (*PICTURES, "triangle_steps", "tint_colours", "tint_vertices")
    kept = {name: array for name, array in arrays.items() if name not in coded}
    tint = _tint(contents, sizes["vertices"], sides[0])
    return kept | {"triangles": drawn.astype(np.int32), "pages": np.stack(pages), "tint": tint}


def _tint(contents: Contents, n_vertices: int, side: int) -> HairTint | None:
    arrays = contents.arrays
    present = [name in arrays for name in ("tint", "tint_colours", "tint_vertices")]
    contents.require(len(set(present)) == 1, "light with another colour of the hair lacks a part of it")
    if not present[0]:
        return None
    colours, vertices = arrays["tint_colours"], arrays["tint_vertices"]
    stacked = decode_colours(arrays["tint"], contents.path)
    n, wide = len(vertices), stacked.shape[1]
    contents.require(len(colours) == n + 1, f"light has {len(colours)} colours of hair, but vertices of {n}")
    fits = len(stacked) % n == 0 and len(stacked) // n <= wide <= side and side % wide == 0
    contents.require(fits, f"hair in {n} other colours, {wide} by {len(stacked)} texels, does not fit its page")
    contents.require(
        vertices.shape[1] <= n_vertices, f"light colours {vertices.shape[1]} vertices of hair, of {n_vertices}"
    )
    return HairTint(colours, np.stack(np.split(stacked, n)), vertices)


STEPS_PER_SHAPE = 32000.0  # 16-bit steps of a shape's largest displacement, at most
MAX_STEP_MM = 0.1  # 16 bits of it are 3 m
ROOM = 32  # further shapes for which faces have room; a palette adds about 15
TRIPLE = np.dtype("V12")  # displacement of a vertex: rows are copied as one item each, in half of the time
MAX_CELLS = 100_000_000  # shapes x vertices: 1.2 GB when read; a head has 1.4 million

SHAPE_TENSORS: Mapping[str, Tensor] = {
    "shape_steps": Tensor("float32", ("shapes",), 0.0, MAX_STEP_MM, may_be_empty=True),
    "shape_counts": Tensor("int32", ("shapes",), 0, may_be_empty=True),
    "shape_vertices": Tensor("int32", ("moved vertices",), may_be_empty=True),
    "shape_deltas": Tensor("int16", ("moved vertices", 3), may_be_empty=True),
}


def check_shapes(contents: Contents, names: Sequence[str]) -> None:
    """Check the shapes of these names, whose arrays are of the right kinds."""
    arrays, n_shapes, n_vertices = contents.arrays, contents.sizes["shapes"], contents.sizes["vertices"]
    contents.indices("shape_vertices", n_vertices, "vertices")
    contents.require(len(names) == n_shapes, f"has {len(names)} shape_names, but {n_shapes} shape_steps")
    contents.require(len(set(names)) == len(names), "has two shapes of the same name")
    contents.require(n_shapes * n_vertices <= MAX_CELLS, f"has {n_shapes} shapes of {n_vertices} vertices: too many")
    moved, total = contents.sizes["moved vertices"], int(arrays["shape_counts"].sum(dtype=np.int64))
    contents.require(total == moved, f"shape_counts adds up to {total}, but there are {moved} moved vertices")


def quantise(values: NDArray[np.floating], least: float = 1e-9) -> tuple[NDArray[np.int16], float]:
    """Values in whole steps, and the step: one of the largest value's 32000, and no smaller than `least`."""
    step = max(float(np.abs(values).max(initial=0.0)) / STEPS_PER_SHAPE, least)
    return np.rint(values / step).astype(np.int16), step


def pack_shapes(shapes: Iterable[NDArray[np.floating]], least_mm: float) -> dict[str, NDArray[Any]]:
    """Arrays by name of displacements (V, 3), mm, of shapes, in steps of at least so many mm."""
    steps, sizes, moved = [], [], []
    for shape in shapes:
        quantised, step = quantise(shape, least_mm)
        rows = np.flatnonzero(quantised.any(axis=1))
        steps.append(quantised[rows])
        sizes.append(step)
        moved.append(rows.astype(np.int32))
    return {
        "shape_deltas": np.concatenate([np.zeros((0, 3), np.int16), *steps]),
        "shape_vertices": np.concatenate([np.zeros(0, np.int32), *moved]),
        "shape_counts": np.array([len(rows) for rows in moved], np.int32),
        "shape_steps": np.array(sizes, np.float32),
    }


def unpack_shapes(arrays: Mapping[str, NDArray[Any]], n_vertices: int) -> NDArray[np.float32]:
    """Displacements (K, V, 3) of what `pack_shapes` returned."""
    counts, steps = arrays["shape_counts"], arrays["shape_steps"]
    shapes = zeros_with_room(len(counts), ROOM, (n_vertices, 3))
    bounds = np.concatenate([[0], np.cumsum(counts)])
    for at, step in enumerate(steps):
        span = slice(bounds[at], bounds[at + 1])
        moved = arrays["shape_deltas"][span] * step
        shapes[at].view(TRIPLE)[arrays["shape_vertices"][span]] = moved.view(TRIPLE)
    return shapes
