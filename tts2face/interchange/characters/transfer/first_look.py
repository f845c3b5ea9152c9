"""Head of a character without shapes: found in pictures of the whole mesh, turned to the front and cropped."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lexicon.errors import DataError
from tts2face.face.landmarks import procrustes_rotation
from tts2face.face.shape_transfer import default_head
from tts2face.interchange.characters.character import Character
from tts2face.interchange.characters.eyeballs import mark_eyeballs
from tts2face.interchange.characters.head_mesh import LEFT_EYE, RIGHT_EYE, HeadMesh, crop_head, join_pieces
from tts2face.interchange.characters.landmarks import CharacterViews
from tts2face.interchange.characters.surface import Placement, add_gaze_shapes, build_face, unwrap
from tts2face.interchange.characters.transfer.kinds import drop_shells, sort_kinds
from tts2face.interchange.characters.transfer.registration import FEATURES
from tts2face.interchange.characters.transfer.source import own_landmarks
from tts2face.interchange.characters.transfer.winding import facing_outwards
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    CHIN,
    EYE_OUTER_LEFT,
    EYE_OUTER_RIGHT,
    LEFT_LIDS,
    N_MESH_LANDMARKS,
    RIGHT_LIDS,
)
from tts2face.numeric.arrays import FloatArray, Mask
from tts2face.picture.occlusion import N_DIRECTIONS
from tts2face.video.tracking import MIN_SCORE

FOREHEAD = 10  # landmark at the top of the forehead
EYE_RINGS = {LEFT_EYE: LEFT_LIDS, RIGHT_EYE: RIGHT_LIDS}
HEIGHT_MM = 180.0  # from chin to the top of the forehead, until the distance of the eyes is known
# Heights of the crops in which a face is sought, as shares of the mesh's: heads, busts, half and whole bodies.
CROPS = (1.0, 0.5, 0.3, 0.2, 0.14)
TALL = 2.0  # height over width or depth from which the mesh is no head alone, and crops are tried first
BESIDE_DEG = (0.0, 40.0, -40.0)  # turns from an axis at which a head that looks aside is seen
LEVEL_DEG = 3.0  # a head that is turned less is not turned back
NOSE = (168, 6, 197, 1, 2)  # landmarks of its line
HALF = 0.5  # of the distance from the nose to an eye's outer corner: the other side has less where it is missing
BESIDE_HEIGHTS, BESIDE_SHARE = 1.1, 0.3  # of a face's height and triangles: another head beside it
N_PICTURES = 3  # pictures after which the turn of a head is final


@dataclass(frozen=True, slots=True, eq=False)
class FoundHead:
    """A head that looks along z, the transform of its units to mm, and where its landmarks (468, 3) roughly lie."""

    mesh: HeadMesh
    placement: Placement
    landmarks: FloatArray


def find_head(character: Character, fronts: Sequence[float], model: Path | None) -> FoundHead:
    """Head of a character, sought along the axes with these turns in degrees, upright, then lying."""
    whole = facing_outwards(drop_shells(join_pieces(character, {}, np.eye(3)), character))
    best = 0.0
    n_pictures = 0
    doubtful: tuple[HeadMesh, _Sighting] | None = None
    for turn in _turns(fronts):
        turned = replace(whole, vertices=whole.vertices @ turn.T, turn=turn)
        for crop in _crops(turned):
            seen = _sight(turned.keep(crop), character, model)
            n_pictures += 1
            best = max(best, seen.score)
            if seen.score < MIN_SCORE:
                continue
            # a part of a bald scalp may look like a face, and the whole head around it does not
            if not _is_confirmed(turned, seen, character, model):
                doubtful = doubtful or (turned, seen)
                continue
            _check_alone(turned, seen.landmarks, character, model)
            return _settled(turned, seen, character, model)
    if doubtful is not None:
        return _settled(*doubtful, character, model)
    raise DataError(
        f"no face is recognised in {n_pictures} pictures of the mesh from its sides and of its upper parts (highest "
        f"score {best:.2f} of the {MIN_SCORE:g} that a face has); give the axis that it looks along with --front, or "
        "the positions of its landmarks with --landmarks"
    )


def placed_head(character: Character, front: float, table: Mapping[int, FloatArray]) -> FoundHead:
    """Head of a character whose landmarks are known in the units and axes of its file."""
    turn = _yaw(front)
    landmarks = np.full((N_MESH_LANDMARKS, 3), np.nan)
    for number, place in table.items():
        if number < N_MESH_LANDMARKS:
            landmarks[number] = turn @ place
    whole = facing_outwards(drop_shells(join_pieces(character, {}, turn), character))
    back = _level_turn(landmarks)
    whole = replace(whole, vertices=whole.vertices @ back.T, turn=back @ turn)
    return _finish(whole, landmarks @ back.T, character)


@dataclass(frozen=True, slots=True, eq=False)
class _Sighting:
    """Score of the tracker in a picture, and the landmarks (468, 3) that it shows, in the units of the mesh."""

    score: float
    landmarks: FloatArray


def _turns(fronts: Sequence[float]) -> Iterator[FloatArray]:
    """Rotations (3, 3) in which a face may look along z, the likely ones first."""
    lying = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # z up, as scanners and Blender count
    for upright in (np.eye(3), lying):
        for beside in BESIDE_DEG:
            for front in fronts:
                yield (_yaw(front + beside) @ upright).round(12)


def _yaw(degrees: float) -> FloatArray:
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]).round(12)


def _crops(head: HeadMesh) -> Iterator[Mask]:
    """Triangles (F,) of the upper parts of a mesh, about as wide as high; the whole first unless it is tall."""
    places = head.vertices[head.triangles].mean(axis=1)
    low, high = head.vertices.min(axis=0), head.vertices.max(axis=0)
    height = float(high[1] - low[1])
    is_tall = height > TALL * min(float(high[0] - low[0]), float(high[2] - low[2]))
    for share in CROPS[::-1] if is_tall else CROPS:
        above = places[:, 1] > high[1] - share * height
        if not above.any():  # long triangles have their middles lower
            continue
        middle = np.median(places[above, 0])
        kept = above & (np.abs(places[:, 0] - middle) < 0.6 * share * height) if share < 1.0 else above
        if kept.sum() > 100:
            yield kept


def _sight(head: HeadMesh, character: Character, model: Path | None) -> _Sighting:
    """The tracker's view of a head from the front, without shadows and without the colours of hair and brows."""
    used = head.keep(np.ones(len(head.triangles), bool))
    low, high = used.vertices.min(axis=0), used.vertices.max(axis=0)
    placement = Placement((low + high) / 2, 1.5 * HEIGHT_MM / float(high[1] - low[1]))
    face = build_face(unwrap(used, character), character, placement)
    face = unshaded(face)
    views = CharacterViews(face, model)
    pixels, score = views.read((0, 0), np.zeros(0, np.float32))
    if score < MIN_SCORE or not np.isfinite(pixels).all():
        return _Sighting(score, np.zeros((N_MESH_LANDMARKS, 3)))
    points, _ = views.points(
        (0, 0), np.zeros(0, np.float32), pixels[:N_MESH_LANDMARKS], face.triangles.astype(np.int64)
    )
    return _Sighting(score, points.places(face.vertices) / placement.scale + placement.origin)


def unshaded(face: Face) -> Face:
    """Face without shadows of its own, whose first picture takes no second."""
    return replace(face, occlusion=np.zeros((1, len(face.vertices), N_DIRECTIONS // 8), np.uint8))


def _is_confirmed(whole: HeadMesh, seen: _Sighting, character: Character, model: Path | None) -> bool:
    """Whether a face is recognised in a picture of the whole head, turned to the front, that was seen."""
    back = _level_turn(seen.landmarks)
    turned = replace(whole, vertices=whole.vertices @ back.T, turn=back @ whole.turn)
    head = crop_head(turned, *_face_box(seen.landmarks @ back.T))
    return _sight(head, character, model).score >= MIN_SCORE


def _settled(whole: HeadMesh, seen: _Sighting, character: Character, model: Path | None) -> FoundHead:
    """The head of a first look, turned until it looks along z."""
    for _ in range(N_PICTURES):
        back = _level_turn(seen.landmarks)
        angle = np.degrees(np.arccos(np.clip((np.trace(back) - 1) / 2, -1, 1)))
        if angle < LEVEL_DEG:
            break
        whole = replace(whole, vertices=whole.vertices @ back.T, turn=back @ whole.turn)
        turned = replace(seen, landmarks=seen.landmarks @ back.T)
        again = _sight(crop_head(whole, *_face_box(turned.landmarks)), character, model)
        # a picture of the turned head that shows less is not believed
        seen = again if again.score >= MIN_SCORE else turned
    return _finish(whole, seen.landmarks, character)


def _check_alone(turned: HeadMesh, landmarks: FloatArray, character: Character, model: Path | None) -> None:
    """Refuse a mesh in which another face stands beside that with these landmarks (468, 3)."""
    low, high = _face_box(landmarks)
    height, middle = float(high[1] - low[1]), (low + high) / 2
    off = turned.vertices[turned.triangles].mean(axis=1) - middle
    is_level = np.abs(off[:, 1]) < BESIDE_HEIGHTS * height
    n_own = int((np.abs(off).max(axis=1) < height).sum())
    for side in (off[:, 0], -off[:, 0]):
        beside = is_level & (side > BESIDE_HEIGHTS * height)
        if beside.sum() < BESIDE_SHARE * n_own:
            continue
        other = _sight(turned.keep(beside), character, model)
        if other.score >= MIN_SCORE:
            apart = float(np.linalg.norm(np.mean(_face_box(other.landmarks), axis=0) - middle))
            raise DataError(
                f"two faces are recognised, {apart:.3g} units of the file apart; leave one head in the file, or give "
                "the positions of its landmarks with --landmarks"
            )


def _check_whole(landmarks: FloatArray) -> None:
    """Refuse a face of which one side is missing: landmarks of what is not there lie at the rim of what is."""
    middle = landmarks[list(NOSE), 0].mean()
    sides = sorted(abs(float(landmarks[corner, 0] - middle)) for corner in (EYE_OUTER_LEFT, EYE_OUTER_RIGHT))
    if sides[0] < HALF * sides[1]:
        raise DataError(
            f"only one side of a face is there: from the nose to the eyes' outer corners are {sides[0]:.2g} and "
            f"{sides[1]:.2g} units of the file; mirror the half in its program, or take a whole head"
        )


def _level_turn(landmarks: FloatArray) -> FloatArray:
    """Rotation (3, 3) from a head with these landmarks (468, 3) to the shipped head."""
    model = own_landmarks(default_head())
    known = FEATURES[np.isfinite(landmarks[FEATURES, 0]) & np.isfinite(model[FEATURES, 0])]
    return procrustes_rotation(landmarks[known], model[known])


def _face_box(landmarks: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Corners (3,) of a face from its chin to the top of its forehead."""
    known = landmarks[np.isfinite(landmarks[:, 0])]
    low, high = known.min(axis=0), known.max(axis=0)
    low[1] = landmarks[CHIN, 1] if np.isfinite(landmarks[CHIN, 1]) else low[1]
    high[1] = landmarks[FOREHEAD, 1] if np.isfinite(landmarks[FOREHEAD, 1]) else high[1]
    return low, high


def _finish(whole: HeadMesh, landmarks: FloatArray, character: Character) -> FoundHead:
    """Cropped head with its parts distinguished by their places, and eyeballs marked."""
    _check_whole(landmarks)
    low, high = _face_box(landmarks)
    head = unwrap(crop_head(whole, low, high), character)
    lids = {eye: landmarks[list({*ring[0], *ring[1]})].mean(axis=0) for eye, ring in EYE_RINGS.items()}
    head = mark_eyeballs(head, character, lids)
    head = sort_kinds(head, character, landmarks)
    placement = Placement((low + high) / 2, HEIGHT_MM / float(high[1] - low[1]))
    return FoundHead(add_gaze_shapes(head), placement, landmarks)
