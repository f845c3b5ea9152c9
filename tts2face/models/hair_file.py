"""Reading and writing of ``.hair`` files (docs/file-formats.md)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.hair import BALD, Hair
from tts2face.models.late import Late
from tts2face.models.mesh_coding import decode_tangents, decode_uv, encode_tangents, encode_uv
from tts2face.models.occlusion_coding import MAX_OCCLUSION_BYTES, decode_occlusion, encode_occlusion
from tts2face.models.picture_coding import decode_colours, decode_coverage, encode_colours, encode_coverage
from tts2face.storage.files import SHIPPED_FOLDER, find_file
from tts2face.storage.schema import Check, Contents, Tensor, free, millimetres, whole
from tts2face.storage.tensors import read_tensors, write_tensors

KIND = "hair"
FORMAT_VERSION = 1

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
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header)


def read_hair(path: Path, *, checks_pictures: bool = True) -> Hair:
    """Read a ``.hair`` file.

    Pictures are decoded at once where the file may be damaged (`checks_pictures`), otherwise when hair is first drawn.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file is damaged, of another kind or version, or invalid.
    """
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
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


def load_hair(name: str) -> Hair:
    """Load a shipped haircut by name, or one from a file.

    Raises
    ------
    InputError
        There is no such haircut.
    DataError
        As `read_hair`.
    """
    if not Path(name).suffix and name not in haircut_names():
        raise InputError(f"there is no haircut {name!r}; give {', '.join((BALD, *haircut_names()))}, or a .hair file")
    path = find_file(name, KIND)
    return read_hair(path, checks_pictures=path.parent != SHIPPED_FOLDER)


def haircut_names() -> tuple[str, ...]:
    """Names of the shipped haircuts, without `BALD`."""
    return tuple(sorted(path.stem for path in SHIPPED_FOLDER.glob(f"*.{KIND}")))


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
