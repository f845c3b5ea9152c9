"""Surface of a character's head as a face: parts with materials, one texture, opacity, and colours."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.lip_constraints import SPEECH_SHAPE_PREFIXES
from tts2face.face.stand_in import VISEME_PREFIX
from tts2face.interchange.characters.atlas import CUTOUT, Atlas, build_atlas, srgb, triangle_opacity
from tts2face.interchange.characters.character import OPAQUE, Character, Material
from tts2face.interchange.characters.eyeballs import eyeball_centres, fit_sphere, gaze_turns
from tts2face.interchange.characters.head_mesh import LEFT_EYE, RIGHT_EYE, HeadMesh
from tts2face.interchange.characters.part_names import kind_by_name, shells_before_eyes
from tts2face.models.face import VERTEX_COLOURS, WIDE_OPEN, Eye, Face, FacePart, Texture
from tts2face.numeric.arrays import FloatArray

OPENING_SHAPES = (WIDE_OPEN, *(f"{VISEME_PREFIX}{vowel}" for vowel in ("aa", "oh", "ee", "ih", "ou")))  # widest first
DULL_TEETH = 0.12  # highlight of teeth in one image with the body: they hold the mouth, too, whose black would shine
# Highlights and softness of materials by kind, as on the default head: specular, shininess, wrap.
SHADING = {
    "eyes": (0.55, 140.0, 0.0),
    "teeth": (0.5, 60.0, 0.3),
    "tongue": (0.35, 30.0, 0.3),
    "lashes": (0.05, 20.0, 0.0),
    "brows": (0.05, 20.0, 0.1),
    "hair": (0.06, 9.0, 0.2),
    "skin": (0.16, 14.0, 0.35),
    "other": (0.06, 10.0, 0.1),
}
# sRGB of white materials without an image: they would hide the features of the face.
PLAIN = {
    "skin": (214, 164, 140),
    "eyes": (236, 234, 230),
    "other": (228, 222, 212),
    "tongue": (190, 98, 96),
    "lashes": (44, 34, 30),
    "brows": (78, 58, 46),
    "hair": (84, 64, 50),
    "teeth": (236, 230, 216),
}
IRIS_RAD, PUPIL_RAD = 0.50, 0.20  # angles of plain irises and pupils from the line of sight
IRIS, PUPIL = (86, 104, 96), (18, 16, 16)  # sRGB
MIN_BALL_VERTICES = 12  # of an eyeball that is painted
UNPAINTED = 0.9  # least linear value of each channel of a white material


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Transform from a head's units to a face's: ``mm = (place - origin) * scale``."""

    origin: FloatArray
    scale: float

    def millimetres(self, places: FloatArray) -> FloatArray:
        """Positions (N, 3) in mm."""
        moved: FloatArray = (places - self.origin) * self.scale
        return moved


def unwrap(head: HeadMesh, character: Character) -> HeadMesh:
    """Head whose texture coordinates lie in the image of their material, moved there by whole images."""
    uv = head.uv.copy()
    piece_of_vertex = np.zeros(len(uv), np.int64)
    piece_of_vertex[head.triangles] = head.piece_of[:, None]
    for number, piece in enumerate(character.pieces):
        rows, transform = piece_of_vertex == number, character.materials[piece.material].transform
        uv[rows] = uv[rows] @ transform[:, :2].T + transform[:, 2]
    lowest = uv[head.triangles].min(axis=1)
    # repeated textures: whole images are taken off, so that an atlas can hold them
    shift = np.where(np.isfinite(lowest), np.floor(lowest + 1e-6), 0.0)
    shift = np.clip(shift, -1e6, 1e6).astype(np.int64)
    corners = np.column_stack([head.triangles.reshape(-1), np.repeat(shift, 3, axis=0)])
    unique, places = np.unique(corners, axis=0, return_inverse=True)
    moved = replace(head, uv=uv).take(unique[:, 0])
    return replace(moved, uv=moved.uv - unique[:, 1:], triangles=places.reshape(-1, 3))


def build_face(head: HeadMesh, character: Character, placement: Placement) -> Face:
    """Face of a head without landmarks.

    Raises
    ------
    DataError
        No triangle of the head is visible.
    """
    kinds = _kinds(head, character)
    used = {character.pieces[n].material for n in np.unique(head.piece_of).tolist()}
    atlas = build_atlas({number % len(character.materials): character.materials[number] for number in used})
    material_of = np.array([piece.material % len(character.materials) for piece in character.pieces])[head.piece_of]
    opacity = np.ones(len(head.triangles))
    for number in np.unique(material_of).tolist():
        rows, material = material_of == number, character.materials[number]
        opacity[rows] = triangle_opacity(material, head.uv[head.triangles[rows]])
    opacity[np.isin(head.piece_of, shells_before_eyes(character))] = 0.0
    if not (opacity > 0).any():
        raise DataError("no triangle of the character is visible; check the alpha of its materials")
    kind_of = np.array([kinds[n] for n in range(len(character.pieces))])[head.piece_of]
    if head.kind_of is not None:
        kind_of = head.kind_of.copy()
    kind_of[head.eye_of[head.triangles].min(axis=1) > 0] = "eyes"
    # opaque first, skin first among these: what is translucent is drawn over what is behind it
    kind_rank = (kind_of != "skin").astype(np.int64)
    if head.kind_of is not None:  # kinds by places are those of triangles, not of materials
        kind_rank *= 1 + np.unique(kind_of, return_inverse=True)[1].reshape(-1)
    order = np.lexsort((material_of, kind_rank, -np.where(opacity == CUTOUT, 0.999, opacity)))
    order = order[opacity[order] > 0]
    keys = [(str(kind_of[t]), int(material_of[t]), float(opacity[t])) for t in order]
    names = tuple(sorted(head.shapes))
    uv, colours = _paint(head, character, atlas, material_of, kind_of)
    has_holes = bool((opacity == CUTOUT).any())
    return Face(
        vertices=placement.millimetres(head.vertices).astype(np.float32),
        triangles=head.triangles[order].astype(np.int32),
        parts=_parts(keys, character, atlas),
        shape_names=names,
        shapes=np.array([head.shapes[name] for name in names], np.float32).reshape(len(names), len(head.vertices), 3)
        * np.float32(placement.scale),
        limits=np.tile(np.array([0.0, 1.0], np.float32), (len(names), 1)),
        eyes=_eyes(head, character, placement, names),
        colours=colours,
        uv=None if atlas.texture is None else uv.astype(np.float32),
        textures=() if atlas.texture is None else (Texture(atlas.texture, atlas.alpha if has_holes else None),),
        landmarks=np.zeros(0, np.int32),
        landmark_vertices=np.zeros((0, 3), np.int32),
        landmark_weights=np.zeros((0, 3), np.float32),
        pivot=np.zeros(3, np.float32),
        opened_by=next((name for name in OPENING_SHAPES if name in names), WIDE_OPEN),
    )


def _parts(keys: list[tuple[str, int, float]], character: Character, atlas: Atlas) -> tuple[FacePart, ...]:
    parts: list[FacePart] = []
    first = 0
    while first < len(keys):
        kind, material, opacity = keys[first]
        end = next((at for at in range(first, len(keys)) if keys[at] != keys[first]), len(keys))
        specular, shininess, wrap = SHADING[kind]
        if kind == "teeth" and any(other == material and of != kind for of, other, _ in keys):
            specular = DULL_TEETH
        name = f"{kind}:{character.materials[material].name}"[:80]
        texture = 0 if material in atlas.places else VERTEX_COLOURS
        is_cut = opacity == CUTOUT
        opacity = 1.0 if is_cut else opacity
        parts.append(FacePart(name, first, end - first, specular, shininess, wrap, opacity, texture, is_cut))
        first = end
    return tuple(parts)


def _kinds(head: HeadMesh, character: Character) -> dict[int, str]:
    """Kind of each piece of the character: by its name and material, otherwise skin where shapes move it."""
    moved, spoken = np.zeros(len(head.vertices), bool), np.zeros(len(head.vertices), bool)
    for name, shape in head.shapes.items():
        moved |= shape.any(axis=1)
        if name.startswith(SPEECH_SHAPE_PREFIXES):
            spoken |= shape.any(axis=1)
    kinds = {}
    for number, piece in enumerate(character.pieces):
        by_name = kind_by_name(piece, character)
        corners = head.triangles[head.piece_of == number]
        # what shapes of speech move is no eyeball, whatever its name
        if by_name == "eyes" and spoken[corners].any():
            by_name = None
        kinds[number] = by_name or ("skin" if moved[corners].any() else "other")
    return kinds


def _paint(
    head: HeadMesh, character: Character, atlas: Atlas, material_of: NDArray[np.int64], kind_of: NDArray[np.str_]
) -> tuple[FloatArray, NDArray[np.uint8]]:
    """Texture coordinates (V, 2) in the atlas, and colours (V, 3), sRGB."""
    uv, colours = np.zeros((len(head.vertices), 2)), np.zeros((len(head.vertices), 3), np.uint8)
    for number in np.unique(material_of).tolist():
        material = character.materials[number]
        for kind in np.unique(kind_of[material_of == number]).tolist():
            rows = np.unique(head.triangles[(material_of == number) & (kind_of == kind)])
            if number in atlas.places:
                uv[rows] = atlas.coordinates(number, np.nan_to_num(head.uv[rows]))
            light = head.colours[rows] * np.array(material.colour[:3])
            colours[rows] = srgb(light)
            if material.image is None and (light > UNPAINTED).all() and kind in PLAIN:
                colours[rows] = PLAIN[kind]
                if kind == "eyes":
                    _paint_irises(head, rows, colours)
    return uv, colours


def _paint_irises(head: HeadMesh, rows: NDArray[np.int64], colours: NDArray[np.uint8]) -> None:
    """Paint plain irises on the vertices `rows` of eyeballs, about the middle of the ball on each side."""
    is_left = head.vertices[rows, 0] > head.vertices[rows, 0].mean()
    for on in (rows[is_left], rows[~is_left]):
        if len(on) < MIN_BALL_VERTICES:
            continue
        towards = head.vertices[on] - fit_sphere(head.vertices[on])[0]
        angle = np.arccos(np.clip(towards[:, 2] / np.maximum(np.linalg.norm(towards, axis=1), 1e-12), -1, 1))
        colours[on[angle < IRIS_RAD]] = IRIS
        colours[on[angle < PUPIL_RAD]] = PUPIL


def _eyes(head: HeadMesh, character: Character, placement: Placement, names: tuple[str, ...]) -> tuple[Eye, ...]:
    eyes = []
    for eye, centre in eyeball_centres(head, character).items():
        rows = np.flatnonzero(head.eye_of == eye)
        turns = {name: turn for name, turn in gaze_turns(eye).items() if name in names}
        place = placement.millimetres(centre[None])[0].astype(np.float32)
        eyes.append(Eye(int(rows[0]), len(rows), place, turns))
    return tuple(eyes)


def add_gaze_shapes(head: HeadMesh) -> HeadMesh:
    """Head with every gaze shape of its marked eyeballs; those that it lacks move no vertex, but turn the eyeball."""
    shapes = dict(head.shapes)
    for eye in (LEFT_EYE, RIGHT_EYE):
        if (head.eye_of == eye).any():
            for name in gaze_turns(eye):
                shapes.setdefault(name, np.zeros(head.vertices.shape, np.float32))
    return replace(head, shapes=shapes)


def is_plain(material: Material) -> bool:
    """Whether a material is white without an image, so that `PLAIN` colours replace it."""
    return material.image is None and min(material.colour[:3]) > UNPAINTED and material.alpha_mode == OPAQUE
