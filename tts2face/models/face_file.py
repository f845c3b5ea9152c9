"""Reading and writing of ``.face`` files: a face in compact form, with identity presets."""

import io
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.face import Eye, Face, Part
from tts2face.models.face_layout import check_face
from tts2face.storage.files import find_file
from tts2face.storage.tensors import read_tensors, write_tensors

KIND = "face"
FORMAT_VERSION = 1
STEPS_PER_SHAPE = 32000.0  # 16-bit steps of a shape's largest displacement: below 0.002 mm for 60 mm
JPEG_QUALITY = 92
MAX_TEXTURE_SIDE_PX = 8192  # pixels per side: 200 MB when decoded
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
    """

    displacement: NDArray[np.float32]
    tints: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    summary: str = ""


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
    arrays |= _pack_shapes(face.shapes)
    if face.uv is not None and face.texture is not None:
        arrays["uv"] = np.rint(np.clip(face.uv, 0, 1) * 65535).astype(np.uint16)
        arrays["texture"] = _encode_picture(face.texture, "JPEG", quality=JPEG_QUALITY, subsampling=0)
        if face.alpha is not None:
            arrays["alpha"] = _encode_picture(face.alpha, "PNG")
    presets = dict(identities or {})
    for number, preset in enumerate(presets.values()):
        steps, step = _quantise(preset.displacement)
        arrays[f"identity{number}"] = steps
        arrays[f"identity{number}_step"] = np.array([step], np.float32)
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
        "metadata": dict(face.metadata),
    }
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header)


def read_face(path: Path, identity: str | None = None) -> Face:
    """Read a ``.face`` file, with an identity preset if given.

    Raises
    ------
    InputError
        The file or the identity does not exist.
    DataError
        The file is damaged, of another kind or version, or invalid (`tts2face.models.face_layout`).
    """
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    check_face(path, arrays, header)
    names = [name for name, _, _ in header["identities"]]
    if identity is not None and identity not in names:
        offered = ", ".join(names) or "none"
        raise InputError(f"the face {path.stem} has no identity {identity!r}; it has: {offered}")
    face = _face_from_arrays(arrays, header, path)
    return face if identity is None else _apply_identity(face, arrays, header, names.index(identity))


def load_face(name: str, identity: str | None = None) -> Face:
    """Load a shipped face by name (head, cartoon), or one from a file; errors as `find_file` and `read_face`."""
    return read_face(find_file(name, KIND), identity)


def _quantise(values: NDArray[np.floating]) -> tuple[NDArray[np.int16], float]:
    step = max(float(np.abs(values).max(initial=0.0)) / STEPS_PER_SHAPE, 1e-9)
    return np.rint(values / step).astype(np.int16), step


def _pack_shapes(shapes: NDArray[np.floating]) -> dict[str, NDArray[Any]]:
    steps, sizes, moved = [], [], []
    for shape in shapes:
        quantised, step = _quantise(shape)
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


def _unpack_shapes(arrays: Mapping[str, NDArray[Any]], n_vertices: int) -> NDArray[np.float32]:
    counts, steps = arrays["shape_counts"], arrays["shape_steps"]
    shapes = np.zeros((len(counts), n_vertices, 3), np.float32)
    bounds = np.concatenate([[0], np.cumsum(counts)])
    for number, step in enumerate(steps):
        span = slice(bounds[number], bounds[number + 1])
        shapes[number, arrays["shape_vertices"][span]] = arrays["shape_deltas"][span] * step
    return shapes


def _part_fields(part: Part) -> dict[str, Any]:
    """Fields of a part; ``cutout`` only where it is set, as older files have it."""
    fields = asdict(part)
    return fields if part.cutout else {key: value for key, value in fields.items() if key != "cutout"}


def _encode_picture(pixels: NDArray[np.uint8], kind: str, **options: Any) -> NDArray[np.uint8]:
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(pixels).save(content, kind, **options)
    return np.frombuffer(content.getvalue(), np.uint8)


def _decode_picture(content: NDArray[np.uint8], kind: str, mode: str, path: Path) -> NDArray[np.uint8]:
    """Pixels of an image of one kind of file, in a mode of Pillow (RGB or L)."""
    from PIL import Image

    try:
        with Image.open(io.BytesIO(content.tobytes()), formats=[kind]) as image:
            if max(image.size) > MAX_TEXTURE_SIDE_PX:
                raise DataError(
                    f"{path}: the texture has {image.size} pixels; reduce it to at most {MAX_TEXTURE_SIDE_PX} per side"
                )
            return np.array(image.convert(mode))
    except (OSError, SyntaxError) as error:
        raise DataError(f"{path}: the texture cannot be decoded ({error}); build or copy the face again") from error


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
    texture = _decode_picture(arrays["texture"], "JPEG", "RGB", path) if "texture" in arrays else None
    alpha = _decode_picture(arrays["alpha"], "PNG", "L", path) if "alpha" in arrays else None
    if alpha is not None and (texture is None or alpha.shape != texture.shape[:2]):
        raise DataError(f"{path}: texture and alpha differ in size; build or copy the face again")
    return Face(
        vertices=arrays["vertices"],
        triangles=arrays["triangles"],
        parts=tuple(Part(**part) for part in header["parts"]),
        shape_names=tuple(header["shape_names"]),
        shapes=_unpack_shapes(arrays, len(arrays["vertices"])),
        limits=arrays["limits"],
        eyes=tuple(eyes),
        colours=arrays["colours"],
        uv=(arrays["uv"] / 65535).astype(np.float32) if "uv" in arrays else None,
        texture=texture,
        alpha=alpha,
        landmarks=arrays["landmarks"],
        landmark_vertices=arrays["landmark_vertices"],
        landmark_weights=arrays["landmark_weights"],
        pivot=arrays["pivot"],
        metadata=header["metadata"],
    )


def _part_texel_weights(face: Face, part: Part, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Weights (H, W): 1 on the texels of a part, 0 elsewhere, with a soft edge."""
    from PIL import Image, ImageDraw, ImageFilter

    mask = Image.new("L", (shape[1], shape[0]))
    pen = ImageDraw.Draw(mask)
    places = np.asarray(face.uv, np.float64) * [shape[1], shape[0]] - 0.5
    for corners in places[face.triangles[part.first : part.first + part.count]].tolist():
        pen.polygon([tuple(corner) for corner in corners], fill=255, outline=255)
    soft = mask.filter(ImageFilter.MaxFilter(3)).filter(ImageFilter.GaussianBlur(1.5))
    share: NDArray[np.float32] = np.asarray(soft, np.float32) / np.float32(255)
    return share


def _apply_identity(face: Face, arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], number: int) -> Face:
    displacement = arrays[f"identity{number}"] * arrays[f"identity{number}_step"][0]
    name, tints, _ = header["identities"][number]
    colours, texture = face.colours.copy(), None if face.texture is None else face.texture.copy()
    for part in face.parts:
        tint = np.array(tints.get(part.name, (1.0, 1.0, 1.0)), np.float32)
        used = np.unique(face.triangles[part.first : part.first + part.count])
        colours[used] = np.clip(face.colours[used] * tint, 0, 255).astype(np.uint8)
        if part.textured and texture is not None and not np.all(tint == 1):
            share = _part_texel_weights(face, part, texture.shape)[:, :, None]
            tinted = texture * (1 + share * (tint - 1))
            texture = np.clip(tinted, 0, np.maximum(texture, MAX_BRIGHTENED_LEVEL)).astype(np.uint8)
    eyes = [
        replace(
            eye, centre=eye.centre + displacement[eye.first : eye.first + eye.count].mean(axis=0).astype(np.float32)
        )
        for eye in face.eyes
    ]
    return replace(
        face,
        vertices=(face.vertices + displacement).astype(np.float32),
        eyes=tuple(eyes),
        colours=colours,
        texture=texture,
        metadata={**face.metadata, "identity": name},
    )
