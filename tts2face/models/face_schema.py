"""Schema of ``.face`` files (docs/file-formats.md), checked when a file is read."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.values.checks import Check, choice, flag, free, list_of, number, record, row, table, text, whole
from tts2face.models.baked_light import LIP_RING
from tts2face.models.codec import stored_tensors
from tts2face.models.face import PART_KINDS, SUM_WITHIN, VERTEX_COLOURS, WIDE_OPEN, Face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.mesh_coding import MAX_OCCLUSION_BYTES
from tts2face.models.score_map import check_score_map
from tts2face.models.shape_coding import MAX_STEP_MM, SHAPE_TENSORS, check_shapes
from tts2face.storage.model_pictures import texture_tensors
from tts2face.storage.schema import MAX_MM, Contents, ModelPlace, Tensor

SCORE_INPUTS = "score_inputs"  # key of the metadata: names of the shapes that the score map reads
# Key of the metadata, and arrays, of the view of a photographed face.
PHOTOGRAPH, FOLLOW = "photograph", "follow"
PHOTO_LAYERS = PHOTO_ALPHA, PHOTO_BEHIND = "photo_alpha", "photo_behind"
CHARACTER = "character"  # array of the file that a face was imported from, and the key of its metadata about it
LIGHT = "light"  # array of baked light, and the key of the metadata that describes it
# of a face; a shipped one has three
MAX_TEXTURES = 16
MAX_PHOTO_PX = 8192  # side of a photograph
MIN_EXTENT_MM = 1.0  # least width and height of a face
# Triangles' area over that of the box around them: 0.5 of a head; shuffled vertices have 200, and take minutes to draw.
MOST_AREA = 10.0
MEASURED = 4000  # triangles, spread over all, of which the area is measured: all of a head would take 10 ms
OPENED_BY, LIT_POSES = "opened_by", "occlusion_poses"  # keys: the shape that opens the mouth; rest, and rest and open
LIP_TOLERANCE = "lip_tolerance_mm"  # key: by which gestures may change the gap of lips that touch
MAX_LIP_TOLERANCE_MM = 10.0

_INDEX, _POINT = whole(0, 2**31 - 1), list_of(number(-MAX_MM, MAX_MM), 3)
_PART = record(
    {"name": text, "first": _INDEX, "count": _INDEX},
    {
        "specular": number(0.0, 100.0),
        "shininess": number(0.0, 1e4),
        "wrap": number(0.0, 10.0),
        "opacity": number(1e-3, 1.0),
        "texture": whole(-1, MAX_TEXTURES - 1),
        "cutout": flag,
        "kind": choice(*PART_KINDS),
    },
)
_EYE = record(
    {"first": _INDEX, "count": _INDEX, "centre": _POINT, "turns": table(list_of(number(-math.pi, math.pi), 3))}
)
_PHOTOGRAPH = record(
    {
        "size": list_of(whole(1, MAX_PHOTO_PX), 2),
        "view": list_of(list_of(number(-MAX_MM, MAX_MM), 4), 3),
        "lens": list_of(number(-1e6, 1e6), 3),
        "corner": list_of(whole(-MAX_PHOTO_PX, MAX_PHOTO_PX), 2),
    }
)
_IDENTITY = row(text, table(list_of(number(0.0, 100.0), 3)), text)
METADATA: Mapping[str, Check] = {
    "parts": list_of(_PART),
    "shape_names": list_of(text),
    "eyes": list_of(_EYE),
    "identities": list_of(_IDENTITY),
    "metadata": free,
}
OWN = stored_tensors(Face, "", {})
TENSORS: Mapping[str, Tensor] = {
    **{name: OWN[name] for name in ("vertices", "triangles")},
    **SHAPE_TENSORS,
    **OWN,
    **{
        name: Tensor("uint8", (f"bytes of {name}",), is_optional=True)
        for name in ("occlusion", LIGHT, CHARACTER, *PHOTO_LAYERS)
    },
    FOLLOW: Tensor("uint8", ("vertices",), is_optional=True),
}


def check_face(path: Path, arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any]) -> None:
    """Check the arrays and metadata of a face file.

    Raises
    ------
    DataError
        A part is missing, has the wrong type or shape, is out of range or not finite, or contradicts another part.
    """
    contents = Contents(path, "face", arrays, header)
    contents.metadata(METADATA)
    table(row(text, text))(header.get("hairdos", {}), ModelPlace(f"{path}: metadata: hairdos"))
    whole(0, MAX_OCCLUSION_BYTES)(header.get("occlusion_bytes", 0), ModelPlace(f"{path}: metadata: occlusion_bytes"))
    number(0.0, MAX_LIP_TOLERANCE_MM)(header.get(LIP_TOLERANCE, 0.0), ModelPlace(f"{path}: metadata: {LIP_TOLERANCE}"))
    contents.tensors(TENSORS)
    _check_poses(contents)
    presets = range(len(header["identities"]))
    contents.tensors({f"identity{n}": Tensor("int16", ("vertices", 3)) for n in presets})
    contents.tensors({f"identity{n}_step": Tensor("float32", (1,), 0.0, MAX_STEP_MM) for n in presets})
    contents.tensors(
        {
            name: Tensor("uint8", (f"bytes of {name}",), is_optional=True)
            for at in range(MAX_TEXTURES)
            for name in texture_tensors(at)
        }
    )
    _check_scores(contents)
    contents.only_known()
    n_vertices = contents.sizes["vertices"]
    for name in ("triangles", "landmark_vertices"):
        contents.indices(name, n_vertices, "vertices")
    contents.indices("landmarks", N_LANDMARKS, "landmarks of the face mesh")
    contents.distinct("landmarks")
    _check_light(contents)
    _check_photograph(contents)
    _check_textures(contents)
    _check_places(contents)
    _check_shapes(contents)
    _check_parts(contents, n_vertices)
    _check_area(contents)


def _check_poses(contents: Contents) -> None:
    header, place = contents.header, f"{contents.path}: metadata: "
    text(header.get(OPENED_BY, ""), ModelPlace(place + OPENED_BY))
    whole(1, 2)(header.get(LIT_POSES, 1), ModelPlace(place + LIT_POSES))
    opening = header.get(OPENED_BY, WIDE_OPEN)
    # without the key the opening shape is ARKit's, of faces that have it
    needed = OPENED_BY in header or header.get(LIT_POSES, 1) > 1
    contents.require(
        not needed or opening in header["shape_names"],
        f"states its occlusion for the shape {opening[:60]!r}, which is not one of its shapes",
    )


def lit_poses(header: Mapping[str, Any]) -> int:
    """Number of the poses of a file's occlusion: 1 at rest, 2 with an open mouth, too."""
    return int(header.get(LIT_POSES, 1 + (header.get(OPENED_BY, WIDE_OPEN) in header["shape_names"])))


def _check_textures(contents: Contents) -> None:
    arrays = contents.arrays
    n_textures = sum(texture_tensors(at)[0] in arrays for at in range(MAX_TEXTURES))
    has_pictures = n_textures > 0 or PHOTOGRAPH in contents.header
    contents.require(("uv" in arrays) == has_pictures, "has only one of uv and texture")
    for at in range(MAX_TEXTURES):
        has_texture, has_alpha = (name in arrays for name in texture_tensors(at))
        contents.require(has_texture == (at < n_textures), f"lacks the texture before texture{at}")
        contents.require(has_texture or not has_alpha, "has alpha, but no texture")
    for part in contents.header["parts"]:
        own = texture_number(part)
        contents.require(own < n_textures or own <= 0, f"the part {part['name']!r} has no texture {own}")
        has_alpha = own >= 0 and texture_tensors(own)[1] in arrays
        contents.require(has_alpha or not part.get("cutout", False), "has a part with cutout, but no alpha")


def _check_light(contents: Contents) -> None:
    """Light itself is checked when it is inflated."""
    arrays, header = contents.arrays, contents.header
    contents.require((LIGHT in arrays) == (LIGHT in header), "has only one of light and what describes it")
    lacks = set(LIP_RING) - set(arrays["landmarks"].tolist())
    contents.require(LIGHT not in arrays or not lacks, f"has light, but not the landmark {min(lacks, default=0)}")


def _check_photograph(contents: Contents) -> None:
    arrays, header = contents.arrays, contents.header
    needs = {PHOTOGRAPH in header, FOLLOW in arrays}
    contents.require(len(needs) == 1, "has only one of photograph and follow")
    contents.require(PHOTOGRAPH in header or PHOTO_ALPHA not in arrays, "has the alpha of a photograph, but none")
    contents.require(
        PHOTO_ALPHA in arrays or PHOTO_BEHIND not in arrays, "has what lies behind a photograph, but not its alpha"
    )
    if PHOTOGRAPH in header:
        _PHOTOGRAPH(header[PHOTOGRAPH], ModelPlace(f"{contents.path}: metadata: {PHOTOGRAPH}"))
        contents.require(LIGHT in arrays, "has a photograph, but no light")
        contents.require(header[PHOTOGRAPH]["lens"][0] > 0, "has a photograph without a focal length")


def texture_number(part: Mapping[str, Any]) -> int:
    """Number of the texture of a part in a file."""
    return int(part.get("texture", VERTEX_COLOURS))


def _check_scores(contents: Contents) -> None:
    inputs = contents.header.get(SCORE_INPUTS, [])
    list_of(text)(inputs, ModelPlace(f"{contents.path}: metadata: {SCORE_INPUTS}"))
    unknown = sorted(set(inputs) - set(contents.header["shape_names"]))
    contents.require(not unknown, f"{SCORE_INPUTS} holds {unknown[:1]}, which is not one of its shapes")
    check_score_map(contents, len(inputs))


def _check_places(contents: Contents) -> None:
    across, up, _ = (float(size) for size in np.ptp(contents.arrays["vertices"], axis=0))
    contents.require(
        min(across, up) >= MIN_EXTENT_MM, f"vertices span {across:g} x {up:g} mm; a face needs 1 mm or more"
    )
    off = np.abs(contents.arrays["landmark_weights"].sum(axis=1) - 1.0).max(initial=0.0)
    contents.require(float(off) <= SUM_WITHIN, f"landmark_weights of a landmark add up to 1 with an error of {off:g}")


def _check_shapes(contents: Contents) -> None:
    arrays, header = contents.arrays, contents.header
    names = header["shape_names"]
    check_shapes(contents, names)
    reversed_ = np.flatnonzero(arrays["limits"][:, 0] > arrays["limits"][:, 1])
    contents.require(
        not len(reversed_), f"limits of the shape {names[reversed_[0]] if len(reversed_) else ''} are reversed"
    )


def _check_parts(contents: Contents, n_vertices: int) -> None:
    header, first = contents.header, 0
    for part in header["parts"]:
        contents.require(part["first"] == first, f"the part {part['name']!r} begins at {part['first']}, not at {first}")
        first += part["count"]
    n_triangles = contents.sizes["triangles"]
    contents.require(first == n_triangles, f"parts cover {first} triangles, but there are {n_triangles}")
    for number_, eye in enumerate(header["eyes"]):
        end = eye["first"] + eye["count"]
        contents.require(eye["count"] > 0 and end <= n_vertices, f"eye {number_} reaches beyond {n_vertices} vertices")
        unknown = sorted(eye["turns"].keys() - set(header["shape_names"]))
        contents.require(not unknown, f"eye {number_} turns with {unknown[:1]}, which is not one of its shapes")
    names = [name for name, _, _ in header["identities"]]
    contents.require(len(set(names)) == len(names), "has two identities of the same name")


def _check_area(contents: Contents) -> None:
    """Refuse a face whose triangles, at rest or with its mouth wide open, lie crosswise through each other."""
    arrays, names = contents.arrays, contents.header["shape_names"]
    poses = {"at rest": arrays["vertices"]}
    opening = contents.header.get(OPENED_BY, WIDE_OPEN)
    if opening in names:
        number_ = names.index(opening)
        first = int(arrays["shape_counts"][:number_].sum(dtype=np.int64))
        moved = slice(first, first + int(arrays["shape_counts"][number_]))
        opened = arrays["vertices"].copy()
        opened[arrays["shape_vertices"][moved]] += arrays["shape_deltas"][moved] * arrays["shape_steps"][number_]
        poses[f"with {opening}"] = opened
    size = np.ptp(arrays["vertices"], axis=0).astype(np.float64)
    box = 2.0 * float(size @ np.roll(size, 1))
    every = len(arrays["triangles"]) // MEASURED + 1
    for pose, vertices in poses.items():
        a, b, c = (vertices[corner] for corner in arrays["triangles"][::every].T)
        (ux, uy, uz), (vx, vy, vz) = (b - a).T, (c - a).T
        squared = (uy * vz - uz * vy) ** 2 + (uz * vx - ux * vz) ** 2 + (ux * vy - uy * vx) ** 2
        share = every * float(np.sqrt(squared).sum(dtype=np.float64)) / 2.0 / box
        contents.require(share <= MOST_AREA, f"triangles {pose} cover {share:.0f} times the box around the face")
