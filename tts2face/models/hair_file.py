"""Reading and writing of ``.hair`` files (docs/file-formats.md)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.hair import BALD, Hair
from tts2face.models.late import Late
from tts2face.models.light_coding import HAIR_QUALITY, decode_hair_light, encode_hair_light
from tts2face.models.lit_hair import LitHair
from tts2face.models.mesh_coding import decode_tangents, decode_uv, encode_tangents, encode_uv, round_places
from tts2face.models.occlusion_coding import MAX_OCCLUSION_BYTES, decode_occlusion, encode_occlusion
from tts2face.models.picture_coding import decode_colours, decode_coverage, encode_colours, encode_coverage
from tts2face.models.shape_coding import SHAPE_TENSORS, check_shapes, pack_shapes, unpack_shapes
from tts2face.storage.files import SHIPPED_FOLDER, find_file
from tts2face.storage.schema import Check, Contents, Tensor, anything, free, list_of, millimetres, text, whole
from tts2face.storage.tensors import read_tensors, write_tensors

KIND = "hair"
OF_FACE = "-"  # between the names of a face with baked light and of its haircut, in the name of a file
LEAST_STEP_MM = 0.01  # of shapes
FORMAT_VERSION = 1

LIGHT = "light"
METADATA: Mapping[str, Check] = {"n_face_vertices": whole(1, 2**31 - 1), "metadata": free}
OCCLUSION_BYTES = whole(0, MAX_OCCLUSION_BYTES)
TENSORS: Mapping[str, Tensor] = {
    "vertices": millimetres("vertices", 3),
    "triangles": Tensor("int32", ("triangles", 3)),
    "uv": Tensor("uint16", ("vertices", 2)),
    "tangents": Tensor("int8", ("vertices", 3)),
    "relief": Tensor("uint8", ("bytes of relief",)),
    "alpha": Tensor("uint8", ("bytes of alpha",)),
    "anchors": Tensor("int32", ("anchors",)),
    "anchor_places": millimetres("anchors", 3),
    "scalp": Tensor("uint8", ("bytes of scalp",), is_optional=True),
    "occlusion": Tensor("uint8", ("bytes of occlusion",), is_optional=True),
    "skin_occlusion": Tensor("uint8", ("bytes of skin occlusion",), is_optional=True),
}
LIT_METADATA: Mapping[str, Check] = {
    "face": text,
    "n_face_vertices": whole(1, 2**31 - 1),
    "n_face_triangles": whole(1, 2**31 - 1),
    "shape_names": list_of(text),
    LIGHT: anything,  # checked when it is inflated
    "metadata": free,
}
LIT_TENSORS: Mapping[str, Tensor] = {
    **{name: TENSORS[name] for name in ("vertices", "triangles", "uv", "tangents")},
    **SHAPE_TENSORS,
    "colours": Tensor("uint8", ("vertices", 3)),
    "loose": Tensor("uint8", ("vertices",)),
    "middle": millimetres(3),
    "skin": Tensor("uint8", ("bytes of skin",)),
    LIGHT: Tensor("uint8", ("bytes of light",)),
}
PICTURES = ("relief", "alpha", "scalp")
MIN_ANCHORS = 4  # that are not in one plane: fewer do not determine the fit


def write_hair(path: Path, hair: Hair) -> None:
    """Write a ``.hair`` file."""
    arrays: dict[str, NDArray[Any]] = {
        "vertices": hair.vertices.astype(np.float32),
        "triangles": hair.triangles.astype(np.int32),
        "uv": encode_uv(hair.uv),
        "tangents": encode_tangents(hair.tangents),
        "relief": encode_colours(hair.relief),
        "alpha": encode_coverage(hair.alpha),
        "anchors": hair.anchors.astype(np.int32),
        "anchor_places": hair.anchor_places.astype(np.float32),
    }
    if hair.scalp is not None:
        arrays["scalp"] = encode_coverage(hair.scalp)
    n_bytes = 0
    for name in ("occlusion", "skin_occlusion"):
        bits = getattr(hair, name)
        if bits is not None:
            arrays[name], n_bytes = encode_occlusion(bits[None]), bits.shape[1]
    header = {"n_face_vertices": hair.n_face_vertices, "occlusion_bytes": n_bytes, "metadata": dict(hair.metadata)}
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def write_lit_hair(path: Path, hair: LitHair) -> None:
    """Write a ``.hair`` file for a face with baked light."""
    content, stored = encode_hair_light(hair.lights[0])
    arrays: dict[str, NDArray[Any]] = {
        "vertices": round_places(hair.vertices),
        "triangles": hair.triangles.astype(np.int32),
        "uv": encode_uv(hair.uv),
        "tangents": encode_tangents(hair.tangents),
        "colours": hair.colours,
        "loose": hair.loose,
        "middle": hair.middle.astype(np.float32),
        "skin": encode_colours(hair.skins[0], HAIR_QUALITY),
        LIGHT: content,
        **pack_shapes(hair.shapes.values(), LEAST_STEP_MM),
    }
    header = {
        "face": hair.face,
        "n_face_vertices": hair.n_face_vertices,
        "n_face_triangles": hair.n_face_triangles,
        "shape_names": list(hair.shapes),
        LIGHT: stored,
        "metadata": dict(hair.metadata),
    }
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def read_hair(path: Path, *, checks_pictures: bool = True) -> Hair | LitHair:
    """Read a ``.hair`` file: hair cards for heads, or a haircut of a face with baked light.

    Pictures are decoded at once where the file may be damaged (`checks_pictures`), otherwise when hair is first drawn.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file is damaged, of another kind or version, or invalid.
    """
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    if LIGHT in arrays:
        lit = _lit_hair_from_arrays(arrays, header, path)
        if checks_pictures:
            tuple(lit.skins)
            tuple(lit.lights)
        return lit
    _check_hair(path, arrays, header)
    hair = _hair_from_arrays(arrays, header, path)
    if checks_pictures:
        tuple(hair.pictures)
    return hair


def _hair_from_arrays(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path) -> Hair:
    return Hair(
        vertices=arrays["vertices"],
        triangles=arrays["triangles"],
        uv=decode_uv(arrays["uv"]),
        tangents=decode_tangents(arrays["tangents"]),
        pictures=_read_pictures(arrays, path),
        anchors=arrays["anchors"],
        anchor_places=arrays["anchor_places"],
        n_face_vertices=header["n_face_vertices"],
        metadata=header["metadata"],
        occlusion=_read_occlusion("occlusion", len(arrays["vertices"]), (arrays, header, path)),
        skin_occlusion=_read_occlusion("skin_occlusion", header["n_face_vertices"], (arrays, header, path)),
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
    return LitHair(
        face=header["face"],
        n_face_vertices=header["n_face_vertices"],
        n_face_triangles=header["n_face_triangles"],
        vertices=arrays["vertices"],
        triangles=arrays["triangles"],
        uv=decode_uv(arrays["uv"]),
        tangents=decode_tangents(arrays["tangents"]),
        colours=arrays["colours"],
        loose=arrays["loose"],
        middle=arrays["middle"],
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

    Raises
    ------
    InputError
        There is no such haircut.
    DataError
        As `read_hair`.
    """
    known = haircut_names(face)
    if not (name in known or Path(name).suffix):
        lacks = f"the face {face} has no haircut {name!r}" if face else f"there is no haircut {name!r}"
        raise InputError(f"{lacks}; give {', '.join((own, *known))}, or a .hair file")
    path = find_file(f"{face}{OF_FACE}{name}" if face and name in known else name, KIND)
    return read_hair(path, checks_pictures=path.parent != SHIPPED_FOLDER)


def haircut_names(face: str = "") -> tuple[str, ...]:
    """Names of the shipped haircuts of a face with baked light beside its own; without a face those for heads."""
    stems = sorted(path.stem for path in SHIPPED_FOLDER.glob(f"*.{KIND}"))
    if face:
        return tuple(stem.removeprefix(face + OF_FACE) for stem in stems if stem.startswith(face + OF_FACE))
    return tuple(stem for stem in stems if OF_FACE not in stem)


def _check_hair(path: Path, arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any]) -> None:
    contents = Contents(path, "haircut", arrays, header)
    contents.metadata(METADATA)
    OCCLUSION_BYTES(header.get("occlusion_bytes", 0), f"{path}: metadata: occlusion_bytes")
    contents.tensors(TENSORS)
    contents.only_known()
    contents.indices("triangles", contents.sizes["vertices"], "vertices")
    contents.indices("anchors", header["n_face_vertices"], "vertices of the head")
    contents.distinct("anchors")
    places = arrays["anchor_places"].astype(np.float64)
    spread = np.linalg.matrix_rank(places - places.mean(axis=0), tol=1.0)
    contents.require(
        len(places) >= MIN_ANCHORS and spread == 3, f"has {len(places)} anchors, which do not surround the head"
    )
