"""Reading and writing of ``.face`` files: a face in compact form, with identity presets."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.baked_light import BakedLight
from tts2face.models.codec import model_of, stored_arrays
from tts2face.models.face import VERTEX_COLOURS, WIDE_OPEN, Eye, Face, FacePart, Hairdo, Texture
from tts2face.models.face_schema import (
    CHARACTER,
    FOLLOW,
    LIGHT,
    LIP_TOLERANCE,
    LIT_POSES,
    MAX_TEXTURES,
    OPENED_BY,
    PHOTO_ALPHA,
    PHOTO_BEHIND,
    PHOTOGRAPH,
    SCORE_INPUTS,
    check_face,
    lit_poses,
    texture_number,
)
from tts2face.models.face_tint import tint_parts
from tts2face.models.late import Late
from tts2face.models.light import Baked, Lamps, Light, Photographed
from tts2face.models.light_coding import decode_light, encode_light
from tts2face.models.mesh_coding import (
    decode_occlusion,
    encode_occlusion,
)
from tts2face.models.photo_view import PhotoView
from tts2face.models.score_map import SCORES, score_map_of
from tts2face.models.shape_coding import pack_shapes, quantise, unpack_shapes
from tts2face.numeric.arrays import FloatArray
from tts2face.storage.model_pictures import (
    decode_colours,
    decode_coverage,
    encode_colours,
    encode_coverage,
    texture_tensors,
)
from tts2face.storage.schema import Contents
from tts2face.storage.tensors import read_tensors, write_tensors

KIND = "face"
FORMAT_VERSION = 1
LEAST_STEP = 1.2e-5  # of shapes, of a face's extent: 0.004 mm of a head; finer ones are noise, which cannot be packed
PACKED_LATE = ("uv", "tangents")  # after the shapes, as in all files: equal faces give equal bytes


@dataclass(frozen=True, slots=True, eq=False)
class Identity:
    """Identity preset: age, sex and ancestry.

    Parameters
    ----------
    displacement : (V, 3)
        Millimetres, added to the face at rest.
    tints
        Part name -> three factors of its sRGB colours, vertex colours and texture alike.
    summary
        One-line description.
    hairdo
        Haircut and hair colour; None for those of the default identity.
    """

    displacement: NDArray[np.float32]
    tints: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    summary: str = ""
    hairdo: Hairdo | None = None


def write_face(path: Path, face: Face, identities: Mapping[str, Identity] | None = None) -> None:
    """Write a ``.face`` file (docs/file-formats.md): shapes sparse in 16 bits, the texture as JPEG."""
    least_mm = LEAST_STEP * float(np.ptp(face.vertices, axis=0).max())
    own = stored_arrays(face)
    if not (face.textures or face.light.is_flat):
        # nothing is drawn by places in a texture
        own.pop("uv", None)
    late = {name: own.pop(name) for name in PACKED_LATE if name in own}
    arrays = own | pack_shapes(face.shapes, least_mm) | late | _texture_arrays(face)
    if face.occlusion is not None:
        arrays["occlusion"] = encode_occlusion(face.occlusion)
    presets = dict(identities or {})
    arrays |= _pack_identities(presets, least_mm)
    header = {
        "parts": [_part_fields(part) for part in face.parts],
        "shape_names": list(face.shape_names),
        "eyes": [
            {
                "first": eye.first,
                "count": eye.count,
                "centre": [float(x) for x in eye.centre],
                "turns": {name: [float(x) for x in turn] for name, turn in eye.turns.items()},
            }
            for eye in face.eyes
        ],
        "identities": [[name, dict(preset.tints), preset.summary] for name, preset in presets.items()],
        "hairdos": _hairdos(face, presets),
        "occlusion_bytes": 0 if face.occlusion is None else face.occlusion.shape[2],
        "metadata": dict(face.metadata),
    }
    header |= _pose_fields(face) | ({LIP_TOLERANCE: face.lip_tolerance_mm} if face.lip_tolerance_mm else {})
    if face.scores is not None:
        arrays |= stored_arrays(face.scores, SCORES)
        header[SCORE_INPUTS] = list(face.scores.inputs)
    if not isinstance(face.light, Lamps):
        arrays[LIGHT], header[LIGHT] = encode_light(face.light.baked)
    if isinstance(face.light, Photographed):
        view = face.light.view
        # shares of the head's motion, in 8 bits
        arrays[FOLLOW] = np.rint(255 * view.follow).astype(np.uint8)
        if view.alpha is not None:
            arrays[PHOTO_ALPHA] = encode_coverage(view.alpha)
        if view.behind is not None:
            arrays[PHOTO_BEHIND] = encode_colours(view.behind)
        numbers = {"size": view.size, "view": view.view.tolist(), "lens": view.lens.tolist(), "corner": view.corner}
        header[PHOTOGRAPH] = {name: list(value) for name, value in numbers.items()}
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def read_face(path: Path, identity: str | None = None, *, checks_pictures: bool = True) -> Face:
    """Read a ``.face`` file, with an identity preset if given.

    Textures are decoded at once where the file may be damaged (`checks_pictures`), otherwise when one is first drawn.

    Raises
    ------
    InputError
        The file or the identity does not exist.
    DataError
        The file is damaged, of another kind or version, or invalid (`tts2face.models.face_schema`).
    """
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    check_face(path, arrays, header)
    # a file that holds its character is the place where it is read from
    if CHARACTER in arrays and isinstance(held := header["metadata"].get(CHARACTER), dict):
        header["metadata"] = header["metadata"] | {CHARACTER: held | {"file": str(path)}}
    names = [name for name, _, _ in header["identities"]]
    if identity is not None and identity not in names:
        offered = ", ".join(names) or "none"
        raise InputError(f"the face {path.stem} has no identity {identity!r}; it has: {offered}")
    face = _face_from_arrays(arrays, header, path)
    if checks_pictures:
        tuple(face.textures)
        if not isinstance(face.light, Lamps):
            _ = face.light.baked
    return face if identity is None else _apply_identity(face, arrays, header, names.index(identity))


def read_identities(path: Path) -> FloatArray:
    """Displacements (P, V, 3) of the identity presets of a shipped ``.face`` file, mm."""
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    presets = [arrays[f"identity{n}"] * arrays[f"identity{n}_step"][0] for n in range(len(header["identities"]))]
    return np.array(presets, np.float64).reshape(len(presets), len(arrays["vertices"]), 3)


def _pose_fields(face: Face) -> dict[str, Any]:
    """Fields that name the poses of the occlusion; none of ARKit's faces, whose files stay equal."""
    own = {OPENED_BY: face.opened_by} if face.opening is not None and face.opened_by != WIDE_OPEN else {}
    usual = lit_poses({"shape_names": face.shape_names, **own})
    return {**own, LIT_POSES: face.n_lit_poses} if face.occlusion is not None and face.n_lit_poses != usual else own


def _texture_arrays(face: Face) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {}
    for number, texture in enumerate(face.textures):
        pixels, alpha = texture_tensors(number)
        arrays[pixels] = encode_colours(texture.pixels)
        if texture.alpha is not None:
            arrays[alpha] = encode_coverage(texture.alpha)
    return arrays


def _pack_identities(presets: Mapping[str, Identity], least_mm: float) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {}
    for number, preset in enumerate(presets.values()):
        steps, step = quantise(preset.displacement, least_mm)
        arrays |= {f"identity{number}": steps, f"identity{number}_step": np.array([step], np.float32)}
    return arrays


def _part_fields(part: FacePart) -> dict[str, Any]:
    """Fields of a part; those that not every part has only where they are set."""
    usual = {"cutout": False, "kind": "plain", "texture": VERTEX_COLOURS}
    return {key: value for key, value in asdict(part).items() if key not in usual or value != usual[key]}


def _hairdos(face: Face, presets: Mapping[str, Identity]) -> dict[str, list[str]]:
    """Haircut and colour by identity; that of the face itself is named by the empty text."""
    own = {} if face.hairdo is None else {"": face.hairdo}
    of_presets = {name: preset.hairdo for name, preset in presets.items() if preset.hairdo is not None}
    return {name: [hairdo.haircut, hairdo.colour] for name, hairdo in (own | of_presets).items()}


def _read_part(fields: Mapping[str, Any], n_textures: int) -> FacePart:
    number = texture_number(fields)
    return FacePart(**{**fields, "texture": number if number < n_textures else VERTEX_COLOURS})


def _read_occlusion(
    arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path
) -> NDArray[np.uint8] | None:
    if "occlusion" not in arrays:
        return None
    shape = (lit_poses(header), len(arrays["vertices"]), header.get("occlusion_bytes", 0))
    return decode_occlusion(arrays["occlusion"], shape, path)


def _read_textures(arrays: Mapping[str, NDArray[Any]], path: Path) -> Late[Texture]:
    every = map(texture_tensors, range(MAX_TEXTURES))
    present = takewhile(lambda pair: pair[0] in arrays, every)
    pictures = [(arrays[colours], arrays.get(coverage)) for colours, coverage in present]

    def decode() -> Iterator[Texture]:
        for colours, coverage in pictures:
            pixels = decode_colours(colours, path)
            alpha = None if coverage is None else decode_coverage(coverage, path)
            if alpha is not None and alpha.shape != pixels.shape[:2]:
                raise DataError(f"{path}: a texture and its alpha differ in size; build or copy the face again")
            yield Texture(pixels, alpha)

    return Late(len(pictures), decode)


def _read_light(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path) -> Light:
    if LIGHT not in arrays:
        return Lamps()
    names = {"vertices": "vertices", "triangles": "triangles", "shapes": "shape_steps"}
    sizes = {what: len(arrays[name]) for what, name in names.items()}

    def decode() -> BakedLight:
        return decode_light(arrays[LIGHT], header[LIGHT], sizes, path)

    return Photographed(decode, _read_view(arrays, header, path)) if PHOTOGRAPH in header else Baked(decode)


def _read_view(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path) -> PhotoView:
    stored = header[PHOTOGRAPH]
    wide, high = stored["size"]
    follow = arrays[FOLLOW].astype(np.float32) / np.float32(255)
    alpha = decode_coverage(arrays[PHOTO_ALPHA], path) if PHOTO_ALPHA in arrays else None
    behind = decode_colours(arrays[PHOTO_BEHIND], path) if PHOTO_BEHIND in arrays else None
    if any(layer is not None and layer.shape[:2] != (high, wide) for layer in (alpha, behind)):
        raise DataError(f"{path}: the photograph and its layers differ in size; build or copy the face again")
    lens, (left, top) = np.array(stored["lens"]), stored["corner"]
    return PhotoView((wide, high), np.array(stored["view"]), lens, follow, (left, top), alpha, behind)


def _face_from_arrays(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path) -> Face:
    eyes = [
        Eye(
            eye["first"],
            eye["count"],
            np.array(eye["centre"], np.float32),
            {name: np.array(turn, np.float32) for name, turn in eye["turns"].items()},
        )
        for eye in header["eyes"]
    ]
    textures = _read_textures(arrays, path)
    hairdo = header.get("hairdos", {}).get("")
    contents = Contents(path, KIND, arrays, header)
    return model_of(
        Face,
        contents,
        parts=tuple(_read_part(part, len(textures)) for part in header["parts"]),
        shape_names=tuple(header["shape_names"]),
        shapes=unpack_shapes(arrays, len(arrays["vertices"])),
        eyes=tuple(eyes),
        textures=textures,
        hairdo=None if hairdo is None else Hairdo(*hairdo),
        occlusion=_read_occlusion(arrays, header, path),
        metadata=header["metadata"],
        scores=score_map_of(contents, tuple(header.get(SCORE_INPUTS, ()))),
        opened_by=header.get(OPENED_BY, WIDE_OPEN),
        lip_tolerance_mm=float(header.get(LIP_TOLERANCE, 0.0)),
        light=_read_light(arrays, header, path),
    )


def _apply_identity(face: Face, arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], number: int) -> Face:
    displacement = arrays[f"identity{number}"] * arrays[f"identity{number}_step"][0]
    name, tints, _ = header["identities"][number]
    hairdo = header.get("hairdos", {}).get(name)
    eyes = [
        replace(
            eye, centre=eye.centre + displacement[eye.first : eye.first + eye.count].mean(axis=0).astype(np.float32)
        )
        for eye in face.eyes
    ]
    return replace(
        tint_parts(face, tints),
        vertices=(face.vertices + displacement).astype(np.float32),
        eyes=tuple(eyes),
        hairdo=face.hairdo if hairdo is None else Hairdo(*hairdo),
        metadata={**face.metadata, "identity": name},
    )
