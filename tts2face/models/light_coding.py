"""Coding of baked light in ``.face`` files: all its arrays deflated as one, pictures as JPEG among them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.values.checks import anything, number, record, table, whole
from tts2face.models.baked_light import (
    HAIR_QUALITY,
    LEAST_SIDE,
    MAX_FACTOR,
    N_PAGES,
    BakedLight,
    HairLight,
    HairTint,
    fills_pages,
)
from tts2face.models.codec import stored_arrays, stored_tensors
from tts2face.storage.deflated import pack_arrays, unpack_arrays
from tts2face.storage.model_pictures import JPEG_QUALITY, decode_colours, encode_colours
from tts2face.storage.schema import Contents, ModelPlace, Tensor

# texels of a page
MAX_SIDE = 4096
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


TRIANGLE_STEPS = Tensor("int32", ("drawn triangles",))  # from one to the next
OF_TINT: Mapping[str, Tensor] = {
    "tint_colours": Tensor("float32", ("colours of the hair", 3), 0.0, 1.0, is_optional=True),
    "tint_vertices": Tensor("uint8", ("other colours", "vertices of the hair", 3), is_optional=True),
}
OWN = stored_tensors(BakedLight, "", {})
TENSORS: Mapping[str, Tensor] = {
    "triangle_steps": TRIANGLE_STEPS,
    **{name: OWN[name] for name in ("is_inside", "rows")},  # which have the sizes that others must have
    **OWN,
    **{name: Tensor("uint8", (f"bytes of {name}",)) for name in ("page0", "page1", "backdrop")},
    **OF_TINT,
}
OF_HAIR: Mapping[str, Tensor] = {
    **{name: TENSORS[name] for name in ("page0", "page1", "triangle_steps")},
    **stored_tensors(HairLight, "", {}),
    **OF_TINT,
}


def encode_light(light: BakedLight) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """Bytes (N,) of light, and the fields that `decode_light` takes with them."""
    content, stored = _encoded(light, JPEG_QUALITY, {"backdrop": encode_colours(light.backdrop)})
    more = {"page_of": dict(light.page_of), "head_lamps": light.head_lamps, "eye_gain": light.eye_gain}
    return content, stored | more


def encode_hair_light(light: HairLight) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """Bytes (N,) of light with another haircut, and the fields that `decode_hair_light` takes with them."""
    return _encoded(light, HAIR_QUALITY, {})


def _encoded(light: HairLight, quality: int, pictures: Mapping[str, Any]) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    arrays = stored_arrays(light) | dict(pictures)
    if light.tint is not None:
        arrays |= {"tint_colours": light.tint.colours, "tint_vertices": light.tint.vertices}
    arrays["triangle_steps"] = np.diff(light.triangles, prepend=np.int32(0))
    arrays |= {f"page{number}": encode_colours(page, quality) for number, page in enumerate(light.pages)}
    content, listed = pack_arrays(arrays)
    return content, {"arrays": listed}


def decode_light(
    content: NDArray[np.uint8], stored: Mapping[str, Any], sizes: Mapping[str, int], path: Path
) -> BakedLight:
    """Light of what `encode_light` returned, for a face with these numbers of vertices and triangles."""
    FIELDS(stored, ModelPlace(f"{path}: metadata: light"))
    arrays = unpack_arrays(content, stored["arrays"], "light", path)
    n_partners = len(arrays.get("rows", ())) + len(arrays.get("ball_rows", ()))
    contents = Contents(path, "face", arrays, {}, {"partners": n_partners})
    contents.tensors(TENSORS)
    for name in ("rows", "partners", "mouth_rows", "ball_rows"):
        contents.indices(name, sizes["vertices"], "vertices")
    kept = _checked(contents, sizes)
    of_head, n_lamps = stored["head_lamps"], len(arrays["lamps"])
    contents.require(of_head <= n_lamps, f"light has {of_head} head_lamps, but {n_lamps} lamps")
    return BakedLight(
        **kept,
        backdrop=decode_colours(arrays["backdrop"], path),
        page_of=stored["page_of"],
        head_lamps=of_head,
        eye_gain=stored["eye_gain"],
    )


def decode_hair_light(
    content: NDArray[np.uint8], stored: Mapping[str, Any], sizes: Mapping[str, int], path: Path
) -> HairLight:
    """Light of what `encode_hair_light` returned, for a face with so many vertices and triangles with the haircut."""
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
