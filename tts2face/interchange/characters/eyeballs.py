"""Eyeballs of a character: by eye bones, or by connected spheres behind the lids."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tts2face.face.expressions import GAZE_SHAPES
from tts2face.face.shape_transfer import default_head
from tts2face.interchange.characters.character import Character
from tts2face.interchange.characters.head_mesh import LEFT_EYE, RIGHT_EYE, HeadMesh
from tts2face.interchange.characters.part_names import kind_by_name
from tts2face.numeric.arrays import FloatArray, connected_pieces

BLINKS = {LEFT_EYE: "eyeBlinkLeft", RIGHT_EYE: "eyeBlinkRight"}
SIDE_NAMES = {LEFT_EYE: "Left", RIGHT_EYE: "Right"}
BONES = {LEFT_EYE: "leftEye", RIGHT_EYE: "rightEye"}
MAX_ROUNDNESS_ERROR = 0.12  # standard deviation of the distance from the centre over the radius; a cornea has 0.05
MIN_VERTICES = 20
LEAST_DEPTH, LEAST_WIDTH = 0.5, 1.4  # radii along the shortest and the middle axis of half an eyeball or more
LARGEST_RADIUS = 0.45  # of the distance of the lids: two eyeballs lie beside each other, hair lies round the head
WITHIN = 1.2  # radii: what lies wholly within is a part of an eyeball
MOVED_BY_LIDS = 0.2  # of the radius: what a blink moves further is no part of an eyeball
LID_REACH = 1.0  # radii between the centre of an eyeball and the middle of the vertices that its lid moves, in x and y
MOVED_BY_SHAPES = 0.02  # of the radius: a gaze shape that moves an eyeball's vertices further turns it itself


def mark_eyeballs(head: HeadMesh, character: Character, lids: Mapping[int, FloatArray] | None = None) -> HeadMesh:
    """Head whose vertices of eyeballs are marked and last; unchanged where shapes turn the eyes or none are found.

    `lids` are the middles (3,) of the eyes' lids; by default of what the blinks move.
    """
    marked = _by_bones(head, character)
    if not marked.any():
        marked = _by_spheres(head, _moved_lids(head) if lids is None else lids)
        marked[_named_otherwise(head, character)] = 0
    # eyes that shapes turn would turn twice
    if not marked.any() or _moved_by_gaze(head, marked):
        return head
    whole = marked[head.triangles]
    crossing = (whole.min(axis=1) != whole.max(axis=1)) & (whole.max(axis=1) > 0)
    if crossing.any():  # a vertex that skin and eyeball share belongs to the skin
        marked[np.unique(head.triangles[crossing])] = 0
    return replace(head, eye_of=marked).order_eyes_last()


def eyeball_centres(head: HeadMesh, character: Character) -> dict[int, FloatArray]:
    """Centre (3,) of each marked eyeball: of its sphere, else its bone, if that lies in it, or its middle."""
    places = [head.turn @ place for bone, place in character.bone_places.items() if bone in BONES.values()]
    centres = {}
    for eye in BONES:
        rows = head.vertices[head.eye_of == eye]
        if len(rows):
            centre, radius, error = fit_sphere(rows)
            is_round = error < MAX_ROUNDNESS_ERROR * radius
            low, high = rows.min(axis=0), rows.max(axis=0)
            # nodes named as eyes may lie at the origin, and hold the mesh of the eye
            inside = (place for place in places if ((place > low) & (place < high)).all())
            centres[eye] = centre if is_round else next(inside, (low + high) / 2)
    return centres


def gaze_turns(eye: int) -> dict[str, NDArray[np.float32]]:
    """Rotation vector of each gaze shape of an eye, as on the default head."""
    side = SIDE_NAMES[eye]
    model = next(eyeball for eyeball in default_head().eyes if any(name.endswith(side) for name in eyeball.turns))
    return dict(model.turns)


def fit_sphere(points: FloatArray) -> tuple[FloatArray, float, float]:
    """Centre (3,), radius, and standard deviation of the distances of points (N, 3) from the centre."""
    shift = points.mean(axis=0)
    local = points - shift
    table = np.column_stack([2 * local, np.ones(len(local))])
    solution, *_ = np.linalg.lstsq(table, (local**2).sum(axis=1), rcond=None)
    distances = np.linalg.norm(local - solution[:3], axis=1)
    return solution[:3] + shift, float(distances.mean()), float(distances.std())


def _by_bones(head: HeadMesh, character: Character) -> NDArray[np.int8]:
    """Marks (V,) of the vertices that follow the bone of an eye or one of its children."""
    marked = np.zeros(len(head.vertices), np.int8)
    if not all(bone in character.bones for bone in BONES.values()):
        return marked
    nodes = {number: _ancestors(number, character.parents) for number in np.unique(head.bones).tolist()}
    middle = float((head.vertices[:, 0].min() + head.vertices[:, 0].max()) / 2)
    for bone in BONES.values():
        follows = [number for number, above in nodes.items() if character.bones[bone] in above]
        is_on = np.isin(head.bones, follows)
        if is_on.any():  # the character's left is +x whatever the bone's name says
            marked[is_on] = LEFT_EYE if head.vertices[is_on, 0].mean() > middle else RIGHT_EYE
    return marked


def _ancestors(node: int, parents: Mapping[int, int]) -> set[int]:
    found = {node}
    while node in parents:
        node = parents[node]
        found.add(node)
    return found


def _moved_lids(head: HeadMesh) -> dict[int, FloatArray]:
    """Middle (3,) of the vertices that each blink moves; empty without both blinks."""
    moved = all(name in head.shapes for name in BLINKS.values())
    return {eye: _middle_of_motion(head, blink) for eye, blink in BLINKS.items()} if moved else {}


def _by_spheres(head: HeadMesh, lids: Mapping[int, FloatArray]) -> NDArray[np.int8]:
    """Marks (V,) of connected spheres in the places of the eyes, behind the middles (3,) of their lids."""
    marked = np.zeros(len(head.vertices), np.int8)
    if not lids:
        return marked
    component = mesh_components(head)
    sizes = np.bincount(component)
    largest = LARGEST_RADIUS * float(np.linalg.norm(lids[LEFT_EYE] - lids[RIGHT_EYE]))
    for eye, lid in lids.items():
        balls: list[tuple[FloatArray, float]] = []
        for number in np.flatnonzero(sizes >= MIN_VERTICES):
            rows = component == number
            centre, radius, error = fit_sphere(head.vertices[rows])
            near = float(np.hypot(*(centre - lid)[:2])) < LID_REACH * radius and abs(centre[2] - lid[2]) < 3 * radius
            near &= radius < largest and _is_ball(head.vertices[rows], radius)
            if near and error < MAX_ROUNDNESS_ERROR * radius:
                balls.append((centre, radius))
        if not balls:
            continue
        # irises and corneas are round pieces of their own within the eyeball
        centre, radius = max(balls, key=lambda ball: ball[1])
        far, lifted = np.zeros(len(sizes)), np.zeros(len(sizes))
        np.maximum.at(far, component, np.linalg.norm(head.vertices - centre, axis=1))
        if BLINKS[eye] in head.shapes:  # lashes lie on the lid that moves them
            np.maximum.at(lifted, component, np.linalg.norm(head.shapes[BLINKS[eye]], axis=1))
        marked[((far <= WITHIN * radius) & (lifted <= MOVED_BY_LIDS * radius))[component]] = eye
    return marked


def _middle_of_motion(head: HeadMesh, shape: str) -> FloatArray:
    """Mean place (3,) of the vertices that a shape moves, weighted by how far."""
    moved = np.linalg.norm(head.shapes[shape], axis=1)
    middle: FloatArray = (head.vertices * moved[:, None]).sum(axis=0) / max(float(moved.sum()), 1e-12)
    return middle


def _is_ball(points: FloatArray, radius: float) -> bool:
    """Whether points (N, 3) on a sphere are half of one or more, not a strip as lashes are, which move with the lid."""
    flat, middle, _ = np.sort(np.ptp(points, axis=0))
    return bool(flat > LEAST_DEPTH * radius and middle > LEAST_WIDTH * radius)


def _named_otherwise(head: HeadMesh, character: Character) -> NDArray[np.int64]:
    """Vertices of pieces whose names say that they are no eyes."""
    kinds = [kind_by_name(piece, character) for piece in character.pieces]
    is_other = np.array([kind not in (None, "eyes") for kind in kinds])
    return np.unique(head.triangles[is_other[head.piece_of]])


def mesh_components(head: HeadMesh) -> NDArray[np.int32]:
    """Number (V,) of the connected part that each vertex belongs to; vertices at one place are connected."""
    size = float(np.ptp(head.vertices, axis=0).max())
    # vertices along a seam of the texture lie at one place, to rounding
    _, place = np.unique(np.rint(head.vertices / size * 1e5).astype(np.int64), axis=0, return_inverse=True)
    return connected_pieces(place.ravel()[head.triangles], int(place.max()) + 1)[place.ravel()]


def _moved_by_gaze(head: HeadMesh, marked: NDArray[np.int8]) -> bool:
    rows = marked > 0
    radius = fit_sphere(head.vertices[marked == marked[rows][0]])[1]
    moved = [np.linalg.norm(head.shapes[name][rows], axis=1).max() for name in GAZE_SHAPES if name in head.shapes]
    return bool(max(moved, default=0.0) > MOVED_BY_SHAPES * radius)
