"""Transfer of a shipped head's shapes to a face without any: a column of steps, from landmarks to lids and teeth."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from lexicon.errors import DataError
from tts2face.face.eyelids import BLINK_SHAPES, SIDES
from tts2face.interchange.characters.landmarks import SKIN, part_triangles
from tts2face.interchange.characters.lip_line import find_lip_line
from tts2face.interchange.characters.surface_points import SurfacePoints, nearest_points
from tts2face.interchange.characters.transfer.cards import move_cards
from tts2face.interchange.characters.transfer.cover import keep_covered
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
from tts2face.interchange.characters.transfer.lip_edges import smooth_edges
from tts2face.interchange.characters.transfer.lip_sight import lips_in_sight
from tts2face.interchange.characters.transfer.mouth_cut import (
    RELIEF,
    OpenedMouth,
    is_closed,
    lip_relief,
    open_mouth,
    with_edges_apart,
)
from tts2face.interchange.characters.transfer.mouth_mesh import prepare_mouth
from tts2face.interchange.characters.transfer.parts import add_teeth, jaw_shares, move_jaw, vertices_of
from tts2face.interchange.characters.transfer.registration import Registration, Similarity, register
from tts2face.interchange.characters.transfer.skin import Skin, build_skin
from tts2face.interchange.characters.transfer.source import Source, choose_source, load_source, own_landmarks
from tts2face.interchange.characters.transfer.walls import without_inner_wall
from tts2face.models.face import WIDE_OPEN, Face
from tts2face.models.landmarks import (
    EYE_OUTER_LEFT,
    EYE_OUTER_RIGHT,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LOWER_LIP_INNER_MID,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    N_LANDMARKS,
    UPPER_LIP_INNER_MID,
)
from tts2face.numeric.arrays import FloatArray

BLINK_GAINS = (1.0, 1.05, 1.1, 1.15)  # by which a blink that leaves a slit may grow before its lids are moved apart
OPEN_SHARE = 0.09  # of the mouth's width: gap of lips that are not shut at rest
N_SMOOTHED = 3  # rounds in which displacements of cut lips become smooth


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
    given, landmarks = face, lids_in_sight(face, own_landmarks(face))
    face = _with_landmarks(_without_shapes(face), landmarks)
    head = load_source(source or choose_source(landmarks), is_tracked=is_tracked)
    on_step()
    face, is_hollow = without_inner_wall(face)
    face, skin, opened = _with_parted_lips(face, landmarks, head)
    skin = lips_in_sight(skin)
    registration = register(head.skin, skin, head.modes(), on_step)
    carried = registration.carry(head.moves())
    if opened is not None:
        carried = smooth_edges(skin, _smoothed(skin, carried), opened.edges(skin))
    shapes, notes = _lids(face, skin, head, carried, registration)
    if is_hollow:
        notes = [*notes, "its skin has two sides, as a hollow statue's; the inner one is left out"]
    similarity = _at_lips(registration.similarity, head, skin.landmarks)
    shares = np.zeros(len(face.vertices))
    if opened is not None:
        shares[opened.rows.ravel()] = opened.jaw
        notes = [*notes, *_notes_of_lips(landmarks)]
    spread = skin.spread(shapes)
    n_added = 0
    if opened is not None:
        spread[:, opened.rows.ravel()] = 0.0
    if opened is not None and not len(vertices_of(face, "teeth", "tongue")):
        face = add_teeth(face, head.face, similarity)
        n_added = len(face.vertices) - len(shares)
        shares, spread = np.pad(shares, (0, n_added)), np.pad(spread, ((0, 0), (0, n_added), (0, 0)))
    move_jaw(face, spread, np.maximum(shares, jaw_shares(face, skin.landmarks)), _lower_teeth(head, similarity))
    if opened is not None:
        spread[:, opened.rows.ravel()] += opened.shares[:, None] * spread[:, opened.lips]
    move_cards(face, spread, skin)
    made = replace(
        face,
        shape_names=head.shape_names,
        shapes=spread.astype(np.float32),
        limits=np.tile(np.array([0.0, 1.0], np.float32), (len(head.shape_names), 1)),
        eyes=given.eyes,
    )
    if opened is not None:
        added = np.arange(len(made.vertices) - n_added, len(made.vertices))
        made = with_edges_apart(keep_covered(made, opened.rows, added, opened.scale), opened.rolled)
    return Transferred(_with_lip_line(made), head.name, tuple(notes))


def _notes_of_lips(landmarks: FloatArray) -> list[str]:
    """Notes about lips that were one surface: that they are cut, and whether they are open at rest."""
    ends = [UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID, MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT]
    gap, width = np.linalg.norm(landmarks[ends[::2]] - landmarks[ends[1::2]], axis=1).tolist()
    notes = ["the mouth was closed: its lips are cut apart, and a mouth with teeth lies behind them"]
    if gap > OPEN_SHARE * width:
        notes.append(
            f"its lips are open by {gap:.0f} mm, in one surface with what lies behind them, which shows as the mouth "
            "opens; close them in its program"
        )
    return notes


def _without_shapes(face: Face) -> Face:
    return replace(
        face, shape_names=(), shapes=np.zeros((0, *face.vertices.shape), np.float32), occlusion=None,
        limits=np.zeros((0, 2), np.float32), eyes=tuple(replace(eye, turns={}) for eye in face.eyes),
    )  # fmt: skip


def _with_parted_lips(face: Face, landmarks: FloatArray, head: Source) -> tuple[Face, Skin, OpenedMouth | None]:
    """The face and its skin, whose lips are cut apart where they were one surface."""
    skin = build_skin(face, landmarks)
    if not is_closed(skin):
        return face, skin, None
    relief = lip_relief(face, landmarks)
    if relief < RELIEF:
        raise DataError(
            f"the mouth has no relief (lips and groove rise by {100 * relief:.1f} % of the distance of the eyes' "
            f"corners, of at least {100 * RELIEF:.1f} %): it is painted, so it cannot open; take a head with lips"
        )
    corners = [EYE_OUTER_LEFT, EYE_OUTER_RIGHT]
    apart = [float(np.linalg.norm(np.subtract(*places[corners]))) for places in (landmarks, head.skin.landmarks)]
    prepared = prepare_mouth(face, landmarks)
    opened = open_mouth(prepared, build_skin(prepared, landmarks), apart[0] / apart[1])
    if opened is None:
        return face, skin, None
    found = landmarks.copy()
    lips = list({*INNER_LIP_UPPER, *INNER_LIP_LOWER})
    found[lips] = own_landmarks(opened.face)[lips]
    parted = build_skin(opened.face, found, opened.sides)
    # there is no inside of a mouth: the bottom of the groove between the lips is their edge
    is_lip = (parted.side == 1) | (parted.side == 2)
    return opened.face, replace(parted, is_seen=parted.is_seen | is_lip), opened


def _with_landmarks(face: Face, landmarks: FloatArray) -> Face:
    """Face with the landmarks of its skin at these places."""
    on_skin = face.landmarks < len(landmarks)
    numbers = face.landmarks[on_skin]
    points = nearest_points(landmarks[numbers], face.vertices.astype(np.float64), part_triangles(face, SKIN))
    vertices, weights = face.landmark_vertices.copy(), face.landmark_weights.copy()
    vertices[on_skin], weights[on_skin] = points.vertices, points.weights
    return replace(face, landmark_vertices=vertices, landmark_weights=weights)


def _with_lip_line(face: Face) -> Face:
    """Face whose inner lips lie where its lips touch; its open mouth separates the upper from the lower."""
    vertices, weights = np.zeros((N_LANDMARKS, 3), np.int64), np.zeros((N_LANDMARKS, 3))
    vertices[face.landmarks], weights[face.landmarks] = face.landmark_vertices, face.landmark_weights
    opened = face.shapes[face.shape_names.index(WIDE_OPEN)]
    found = find_lip_line(SurfacePoints(vertices, weights), face.vertices, part_triangles(face, SKIN), opened)
    return replace(
        face, landmark_vertices=found.vertices[face.landmarks].astype(np.int32),
        landmark_weights=found.weights[face.landmarks].astype(np.float32),
    )  # fmt: skip


def _lids(
    face: Face, skin: Skin, head: Source, shapes: FloatArray, registration: Registration
) -> tuple[FloatArray, list[str]]:
    """Shapes (K, S, 3) whose blinks shut the eyes; without eyeballs lids do not move."""
    lids = np.array([name.startswith(LID_SHAPES) for name in head.shape_names])
    if not len(vertices_of(face, "eyes")):
        shapes[lids] = 0.0
        return shapes, ["the eyes are in one piece with the skin: they neither blink nor turn"]
    blinks = [head.shape_names.index(name) for name in BLINK_SHAPES]
    for gain in BLINK_GAINS:
        grown = shapes.copy()
        grown[blinks] *= gain
        for blink in blinks:
            keep_off_eyeballs(face, skin, grown[blink])
        if _shuts(face, skin, grown, blinks):
            return grown, []
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


def _smoothed(skin: Skin, shapes: FloatArray) -> FloatArray:
    """Shapes (K, S, 3) whose displacements of the lips are smooth along each of them, for edges that were cut."""
    is_lip = (skin.side == 1) | (skin.side == 2)
    graph = skin.graph(is_weighted=False)
    mean = sp.diags(1.0 / np.maximum(np.asarray(graph.sum(axis=1)).ravel(), 1.0)) @ graph
    flat = np.moveaxis(shapes, 1, 0).reshape(len(skin.vertices), -1)
    for _ in range(N_SMOOTHED):
        flat = np.where(is_lip[:, None], (flat + mean @ flat) / 2, flat)
    return np.moveaxis(flat.reshape(len(skin.vertices), len(shapes), 3), 1, 0)


def _at_lips(similarity: Similarity, head: Source, landmarks: FloatArray) -> Similarity:
    """The similarity, moved so that the source's line of lips lies on the target's."""
    lips = [UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID]
    off = landmarks[lips].mean(axis=0) - similarity.places(head.skin.landmarks[lips].mean(axis=0))
    return replace(similarity, shift=similarity.shift + off)


def _lower_teeth(head: Source, similarity: Similarity) -> tuple[FloatArray, FloatArray]:
    """Places (N, 3) and displacements (K, N, 3) of the source's lower teeth in the target's millimetres."""
    part = next(part for part in head.face.parts if part.name == "teeth_lower")
    rows = np.unique(head.face.triangles[part.first : part.first + part.count])
    return similarity.places(head.face.vertices[rows].astype(np.float64)), similarity.moves(head.shapes(rows))
