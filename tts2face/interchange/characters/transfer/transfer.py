"""Transfer of a shipped head's shapes to a face without any: a column of steps, from landmarks to lids and teeth."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tts2face.face.eyelids import BLINK_SHAPES, SIDES
from tts2face.interchange.characters.landmarks import SKIN, part_triangles
from tts2face.interchange.characters.surface_points import nearest_points
from tts2face.interchange.characters.transfer.lids import (
    LID_SHAPES,
    MAX_CROSSING,
    SEEN_MM,
    closed_share,
    keep_off_eyeballs,
    lids_in_sight,
    seen_eyeball,
    shut_lids,
)
from tts2face.interchange.characters.transfer.parts import jaw_shares, move_cards, move_jaw, vertices_of
from tts2face.interchange.characters.transfer.registration import Registration, Similarity, register
from tts2face.interchange.characters.transfer.skin import Skin, build_skin
from tts2face.interchange.characters.transfer.source import Source, choose_source, load_source, own_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.numeric.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Transferred:
    """A face with the shapes of a shipped head, the name of that head, and what was done, in sentences."""

    face: Face
    source: str
    notes: tuple[str, ...]


def transfer_shapes(
    face: Face, source: str | None = None, *, is_tracked: bool = True, on_step: Callable[[], object] = bool
) -> Transferred:
    """Face with the shapes of a shipped head, by default of the one that is like it.

    Parameters
    ----------
    face
        Face in mm with landmarks; its own shapes are left out.
    is_tracked
        Whether its landmarks are those of the tracker, whose ways those of the source then share.
    on_step
        Called after each of seven steps.
    """
    landmarks = lids_in_sight(face, own_landmarks(face))
    face = _with_landmarks(face, landmarks)
    head = load_source(source or choose_source(landmarks), is_tracked=is_tracked)
    on_step()
    skin = build_skin(face, landmarks)
    registration = register(head.skin, skin, on_step)
    moves = head.moves()
    shapes = registration.carry(moves)
    shapes, notes = _lids(face, skin, head, shapes, registration)
    spread = skin.spread(shapes)
    move_jaw(face, spread, jaw_shares(face, landmarks), _lower_teeth(head, registration.similarity, landmarks))
    move_cards(face, spread, skin)
    made = replace(
        face,
        shape_names=head.shape_names,
        shapes=spread.astype(np.float32),
        limits=np.tile(np.array([0.0, 1.0], np.float32), (len(head.shape_names), 1)),
    )
    return Transferred(made, head.name, tuple(notes))


def _with_landmarks(face: Face, landmarks: FloatArray) -> Face:
    """Face with the landmarks of its skin at these places."""
    on_skin = face.landmarks < len(landmarks)
    numbers = face.landmarks[on_skin]
    points = nearest_points(landmarks[numbers], face.vertices.astype(np.float64), part_triangles(face, SKIN))
    vertices, weights = face.landmark_vertices.copy(), face.landmark_weights.copy()
    vertices[on_skin], weights[on_skin] = points.vertices, points.weights
    return replace(face, landmark_vertices=vertices, landmark_weights=weights)


def _lids(
    face: Face, skin: Skin, head: Source, shapes: FloatArray, registration: Registration
) -> tuple[FloatArray, list[str]]:
    """Shapes (K, S, 3) whose blinks shut the eyes; without eyeballs lids do not move."""
    lids = np.array([name.startswith(LID_SHAPES) for name in head.shape_names])
    if not len(vertices_of(face, "eyes")):
        shapes[lids] = 0.0
        return shapes, ["the eyes are in one piece with the skin: they neither blink nor turn"]
    blinks = [head.shape_names.index(name) for name in BLINK_SHAPES]
    if _shuts(face, skin, shapes, blinks):
        return shapes, []
    shut = shut_lids((head.skin, head.moves()), (skin, shapes), head.shape_names, registration.similarity)
    for blink in blinks:
        keep_off_eyeballs(face, skin, shut[blink])
    return shut, []


def _shuts(face: Face, skin: Skin, shapes: FloatArray, blinks: list[int]) -> bool:
    """Whether the blinks leave nothing of the eyeballs to be seen, and do not cross the lids."""
    for blink, side in zip(blinks, SIDES, strict=True):
        posed = face.vertices + skin.spread(shapes[blink : blink + 1])[0]
        if seen_eyeball(face, skin.landmarks, posed, side) > SEEN_MM:
            return False
        if closed_share(skin, shapes[blink], side) > MAX_CROSSING:
            return False
    return True


def _lower_teeth(head: Source, similarity: Similarity, landmarks: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places (N, 3) and displacements (K, N, 3) of the source's lower teeth, its line of lips on the target's."""
    lips = [UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID]
    shift = landmarks[lips].mean(axis=0) - similarity.places(head.skin.landmarks[lips].mean(axis=0))
    part = next(part for part in head.face.parts if part.name == "teeth_lower")
    rows = np.unique(head.face.triangles[part.first : part.first + part.count])
    places = similarity.places(head.face.vertices[rows].astype(np.float64)) + shift
    return places, similarity.moves(head.shapes(rows))
