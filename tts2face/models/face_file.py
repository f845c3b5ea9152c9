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
from tts2face.models.codec import stored_arrays
from tts2face.models.face import VERTEX_COLOURS, Eye, Face, FacePart, Hairdo, Late, Texture
from tts2face.models.face_schema import (
    FOLLOW,
    LIGHT,
    MAX_TEXTURES,
    PHOTO_ALPHA,
    PHOTO_BEHIND,
    PHOTOGRAPH,
    SCORE_INPUTS,
    WIDE_OPEN,
    check_face,
    decode_occlusion,
    decode_tangents,
    decode_uv,
    encode_occlusion,
    encode_tangents,
    encode_uv,
    texture_number,
)
from tts2face.models.light import Baked, Lamps, Light, Photographed
from tts2face.models.light_coding import decode_light, encode_light, pack_shapes, quantise, unpack_shapes
from tts2face.models.photo_view import PhotoView
from tts2face.models.score_map import SCORES, score_map_of
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
MAX_BRIGHTENED_LEVEL = 150  # upper limit of texels brightened by a tint: keeps skin colours at the edge of dark hair


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
    arrays: dict[str, NDArray[Any]] = {
        "vertices": face.vertices.astype(np.float32),
        "triangles": face.triangles.astype(np.int32),
        "limits": face.limits.astype(np.float32),
        "colours": face.colours,
        "landmarks": face.landmarks.astype(np.int32),
        "landmark_vertices": face.landmark_vertices.astype(np.int32),
        "landmark_weights": face.landmark_weights.astype(np.float32),
        "pivot": face.pivot.astype(np.float32),
    }
    least_mm = LEAST_STEP * float(np.ptp(face.vertices, axis=0).max())
    arrays |= pack_shapes(face.shapes, least_mm)
    arrays |= _picture_arrays(face)
    if face.tangents is not None:
        arrays["tangents"] = encode_tangents(face.tangents)
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
    if face.scores is not None:
        arrays |= stored_arrays(face.scores, SCORES)
        header[SCORE_INPUTS] = list(face.scores.inputs)
    if not isinstance(face.light, Lamps):
        arrays[LIGHT], header[LIGHT] = encode_light(face.light.baked)
    if isinstance(face.light, Photographed):
        view = face.light.view
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


def _picture_arrays(face: Face) -> dict[str, NDArray[Any]]:
    """Textures of a face, and the places of its vertices in them or in a photograph."""
    arrays: dict[str, NDArray[Any]] = {}
    if face.uv is not None and (face.textures or face.light.is_flat):
        arrays["uv"] = encode_uv(face.uv)
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
    known = {key: value for key, value in fields.items() if key != "textured"}
    return FacePart(**known | {"texture": number if number < n_textures else VERTEX_COLOURS})


def _read_occlusion(
    arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path
) -> NDArray[np.uint8] | None:
    if "occlusion" not in arrays:
        return None
    n_poses = 2 if WIDE_OPEN in header["shape_names"] else 1
    shape = (n_poses, len(arrays["vertices"]), header.get("occlusion_bytes", 0))
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
    return Face(
        vertices=arrays["vertices"],
        triangles=arrays["triangles"],
        parts=tuple(_read_part(part, len(textures)) for part in header["parts"]),
        shape_names=tuple(header["shape_names"]),
        shapes=unpack_shapes(arrays, len(arrays["vertices"])),
        limits=arrays["limits"],
        eyes=tuple(eyes),
        colours=arrays["colours"],
        uv=decode_uv(arrays["uv"]) if "uv" in arrays else None,
        textures=textures,
        tangents=decode_tangents(arrays["tangents"]) if "tangents" in arrays else None,
        hairdo=None if hairdo is None else Hairdo(*hairdo),
        occlusion=_read_occlusion(arrays, header, path),
        landmarks=arrays["landmarks"],
        landmark_vertices=arrays["landmark_vertices"],
        landmark_weights=arrays["landmark_weights"],
        pivot=arrays["pivot"],
        metadata=header["metadata"],
        scores=score_map_of(Contents(path, KIND, arrays, header), tuple(header.get(SCORE_INPUTS, ()))),
        light=_read_light(arrays, header, path),
    )


def _part_texel_levels(face: Face, part: FacePart, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Levels (H, W): 255 on the texels of a part, 0 elsewhere, with a soft edge."""
    from PIL import Image, ImageDraw, ImageFilter
    from scipy.ndimage import maximum_filter

    mask = Image.new("L", (shape[1], shape[0]))
    pen = ImageDraw.Draw(mask)
    places = np.asarray(face.uv, np.float64) * [shape[1], shape[0]] - 0.5
    for corners in places[face.triangles[part.first : part.first + part.count]].tolist():
        pen.polygon([tuple(corner) for corner in corners], fill=255, outline=255)
    wide = maximum_filter(np.asarray(mask), 9, mode="nearest")  # the bytes of Pillow's MaxFilter, 90 ms sooner
    return np.asarray(Image.fromarray(wide).filter(ImageFilter.GaussianBlur(1.5)))


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


def tint_parts(face: Face, tints: Mapping[str, Any]) -> Face:
    """A face whose parts, by name, have their sRGB colours multiplied by three factors, of vertices and textures."""
    colours = face.colours.copy()
    for part in face.parts:
        used = np.unique(face.triangles[part.first : part.first + part.count])
        colours[used] = np.clip(face.colours[used] * _tint(tints, part), 0, 255).astype(np.uint8)
    return replace(face, colours=colours, textures=Late(len(face.textures), lambda: _tinted(face, tints)))


def _tint(tints: Mapping[str, Any], part: FacePart) -> NDArray[np.float32]:
    return np.array(tints.get(part.name, (1.0, 1.0, 1.0)), np.float32)


def _tinted_levels(tint: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Levels (3, 256, 256) of each channel that a tint (3,) makes, by those of the part's share and of the texel."""
    share, own = np.arange(256, dtype=np.float32)[:, None] / np.float32(255), np.arange(256, dtype=np.float32)
    tinted = own * (1 + share * (tint[:, None, None] - 1))
    return np.clip(tinted, 0, np.maximum(own, MAX_BRIGHTENED_LEVEL)).astype(np.uint8)


def _tinted(face: Face, tints: Mapping[str, Any]) -> Iterator[Texture]:
    """The textures of a face in the tints of its parts."""
    textures = [texture.pixels for texture in face.textures]
    for part in face.parts:
        tint = _tint(tints, part)
        if part.is_textured and not np.all(tint == 1):
            texture = textures[part.texture]
            shares = 256 * _part_texel_levels(face, part, texture.shape).astype(np.int64)
            levels = _tinted_levels(tint)
            tinted = [levels[c].take(shares + texture[:, :, c]) for c in range(3)]
            textures[part.texture] = np.stack(tinted, axis=2)
    for pixels, old in zip(textures, face.textures, strict=True):
        yield Texture(pixels, old.alpha)
