"""Reading and writing of ``.hair`` files (docs/file-formats.md): cards of heads, and haircuts of faces with light."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.checks import Check, anything, free, list_of, text, whole
from tts2face.models.baked_light import HAIR_QUALITY
from tts2face.models.codec import header_checks, model_of, stored_arrays, stored_header, stored_tensors
from tts2face.models.face_names import BALD, HAIR_KIND, OF_FACE, haircut_names
from tts2face.models.hair import Hair
from tts2face.models.late import Late
from tts2face.models.light_coding import decode_hair_light, encode_hair_light
from tts2face.models.lit_hair import LitHair
from tts2face.models.mesh_coding import (
    MAX_OCCLUSION_BYTES,
    decode_occlusion,
    encode_occlusion,
)
from tts2face.models.shape_coding import SHAPE_TENSORS, check_shapes, pack_shapes, unpack_shapes
from tts2face.storage.model_pictures import decode_colours, decode_coverage, encode_colours, encode_coverage
from tts2face.storage.schema import Contents, ModelPlace, Tensor
from tts2face.storage.shipped import SHIPPED_FOLDER, find_file
from tts2face.storage.tensors import read_tensors, write_tensors

LEAST_STEP_MM = 0.01  # of shapes
FORMAT_VERSION = 1

LIGHT = "light"
METADATA: Mapping[str, Check] = header_checks(Hair)
OCCLUSION_BYTES = whole(0, MAX_OCCLUSION_BYTES)
OWN = stored_tensors(Hair, "", {})
TENSORS: Mapping[str, Tensor] = {
    **{name: OWN[name] for name in ("vertices", "triangles", "uv", "tangents")},
    "relief": Tensor("uint8", ("bytes of relief",)),
    "alpha": Tensor("uint8", ("bytes of alpha",)),
    **OWN,
    "scalp": Tensor("uint8", ("bytes of scalp",), is_optional=True),
    "occlusion": Tensor("uint8", ("bytes of occlusion",), is_optional=True),
    "skin_occlusion": Tensor("uint8", ("bytes of skin occlusion",), is_optional=True),
}
LIT_METADATA: Mapping[str, Check] = {
    **header_checks(LitHair),
    "shape_names": list_of(text),
    LIGHT: anything,  # checked when it is inflated
    "metadata": free,
}
LIT_OWN = stored_tensors(LitHair, "", {})
LIT_TENSORS: Mapping[str, Tensor] = {
    **{name: LIT_OWN[name] for name in ("vertices", "triangles", "uv", "tangents")},
    **SHAPE_TENSORS,
    **LIT_OWN,
    "skin": Tensor("uint8", ("bytes of skin",)),
    LIGHT: Tensor("uint8", ("bytes of light",)),
}
PICTURES = ("relief", "alpha", "scalp")
MIN_ANCHORS = 4  # that are not in one plane: fewer do not determine the fit


def write_hair(path: Path, hair: Hair) -> None:
    """Write a ``.hair`` file."""
    arrays = stored_arrays(hair)
    arrays |= {"relief": encode_colours(hair.relief), "alpha": encode_coverage(hair.alpha)}
    if hair.scalp is not None:
        arrays["scalp"] = encode_coverage(hair.scalp)
    n_bytes = 0
    for name in ("occlusion", "skin_occlusion"):
        bits = getattr(hair, name)
        if bits is not None:
            arrays[name], n_bytes = encode_occlusion(bits[None]), bits.shape[1]
    header = {"n_face_vertices": hair.n_face_vertices, "occlusion_bytes": n_bytes, "metadata": dict(hair.metadata)}
    write_tensors(path, HAIR_KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def write_lit_hair(path: Path, hair: LitHair) -> None:
    """Write a ``.hair`` file for a face with baked light."""
    content, stored = encode_hair_light(hair.lights[0])
    arrays = stored_arrays(hair)
    arrays |= {"skin": encode_colours(hair.skins[0], HAIR_QUALITY), LIGHT: content}
    arrays |= pack_shapes(hair.shapes.values(), LEAST_STEP_MM)
    header = {
        **stored_header(hair),
        "shape_names": list(hair.shapes),
        LIGHT: stored,
        "metadata": dict(hair.metadata),
    }
    write_tensors(path, HAIR_KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def read_hair(path: Path, *, checks_pictures: bool = True) -> Hair | LitHair:
    """Read a ``.hair`` file: hair cards for heads, or a haircut of a face with baked light.

    Pictures are decoded at once where the file may be damaged (`checks_pictures`), otherwise when hair is first drawn.
    """
    arrays, header = read_tensors(path, HAIR_KIND, FORMAT_VERSION)
    if LIGHT in arrays:
        lit = _lit_hair_from_arrays(arrays, header, path)
        if checks_pictures:
            tuple(lit.skins)
            tuple(lit.lights)
        return lit
    contents = Contents(path, "haircut", arrays, header)
    _check_hair(contents)
    hair = _hair_of(contents)
    if checks_pictures:
        tuple(hair.pictures)
    return hair


def _hair_of(contents: Contents) -> Hair:
    file = contents.arrays, contents.header, contents.path
    return model_of(
        Hair,
        contents,
        pictures=_read_pictures(contents.arrays, contents.path),
        occlusion=_read_occlusion("occlusion", contents.sizes["vertices"], file),
        skin_occlusion=_read_occlusion("skin_occlusion", contents.header["n_face_vertices"], file),
    )


def _lit_hair_from_arrays(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path) -> LitHair:
    contents = Contents(path, "haircut", arrays, header)
    contents.metadata(LIT_METADATA)
    contents.tensors(LIT_TENSORS)
    contents.only_known()
    contents.indices("triangles", contents.sizes["vertices"], "vertices")
    check_shapes(contents, header["shape_names"])
    n = contents.sizes["vertices"]
    sizes = {
        "vertices": header["n_face_vertices"] + n,
        "triangles": header["n_face_triangles"] + contents.sizes["triangles"],
    }
    return model_of(
        LitHair,
        contents,
        shapes=dict(zip(header["shape_names"], unpack_shapes(arrays, n), strict=True)),
        skins=Late(1, lambda: [decode_colours(arrays["skin"], path)]),
        lights=Late(1, lambda: [decode_hair_light(arrays[LIGHT], header[LIGHT], sizes, path)]),
        metadata=header["metadata"],
    )


def _read_pictures(arrays: Mapping[str, NDArray[Any]], path: Path) -> Late[NDArray[np.uint8]]:
    contents = {name: arrays[name] for name in PICTURES if name in arrays}

    def decode() -> list[NDArray[np.uint8]]:
        relief = decode_colours(contents["relief"], path, "L")
        alpha, *scalp = (decode_coverage(content, path) for name, content in contents.items() if name != "relief")
        if relief.shape != alpha.shape:
            raise DataError(f"{path}: relief and alpha differ in size; build or copy the file again")
        return [relief, alpha, *scalp]

    return Late(len(contents), decode)


def _read_occlusion(name: str, n_vertices: int, file: tuple[Any, Any, Path]) -> NDArray[np.uint8] | None:
    arrays, header, path = file
    if name not in arrays:
        return None
    bits: NDArray[np.uint8] = decode_occlusion(arrays[name], (1, n_vertices, header.get("occlusion_bytes", 0)), path)[0]
    return bits


def load_hair(name: str, face: str = "", own: str = BALD) -> Hair | LitHair:
    """Load a shipped haircut by name, or one from a file.

    Parameters
    ----------
    name
        Haircut.
    face
        Shipped face with baked light whose haircut it is; empty for one of cards, for heads.
    own
        Haircut that such a face has without a file.
    """
    known = haircut_names(face)
    if not (name in known or Path(name).suffix):
        lacks = f"the face {face} has no haircut {name!r}" if face else f"there is no haircut {name!r}"
        raise InputError(f"{lacks}; give {', '.join((own, *known))}, or a .hair file")
    path = find_file(f"{face}{OF_FACE}{name}" if face and name in known else name, HAIR_KIND)
    return read_hair(path, checks_pictures=path.parent != SHIPPED_FOLDER)


def _check_hair(contents: Contents) -> None:
    header = contents.header
    contents.metadata(METADATA)
    OCCLUSION_BYTES(header.get("occlusion_bytes", 0), ModelPlace(f"{contents.path}: metadata: occlusion_bytes"))
    contents.tensors(TENSORS)
    contents.only_known()
    contents.indices("triangles", contents.sizes["vertices"], "vertices")
    contents.indices("anchors", header["n_face_vertices"], "vertices of the head")
    contents.distinct("anchors")
    places = contents.arrays["anchor_places"].astype(np.float64)
    spread = np.linalg.matrix_rank(places - places.mean(axis=0), tol=1.0)
    contents.require(
        len(places) >= MIN_ANCHORS and spread == 3, f"has {len(places)} anchors, which do not surround the head"
    )
