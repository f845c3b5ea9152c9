"""Rough scans: winding, double walls, holes and coarse meshes at the mouth, added teeth; made of plates and balls."""

from dataclasses import replace

import numpy as np
import pytest

from lexicon.errors import DataError
from tests.interchange.characters.test_transfer import plate
from tts2face.interchange.characters.head_mesh import HeadMesh
from tts2face.interchange.characters.import_notes import place_notes
from tts2face.interchange.characters.transfer.cover import keep_covered
from tts2face.interchange.characters.transfer.first_look import _check_whole
from tts2face.interchange.characters.transfer.lids import keep_off_eyeballs
from tts2face.interchange.characters.transfer.lip_edges import smooth_edges
from tts2face.interchange.characters.transfer.mouth_cut import (
    LIP_EDGES,
    MOUTH,
    RELIEF,
    lip_relief,
    open_mouth,
    with_edges_apart,
)
from tts2face.interchange.characters.transfer.mouth_mesh import prepare_mouth
from tts2face.interchange.characters.transfer.skin import Skin, build_skin
from tts2face.interchange.characters.transfer.source import own_landmarks
from tts2face.interchange.characters.transfer.walls import without_inner_wall
from tts2face.interchange.characters.transfer.winding import facing_outwards
from tts2face.models.face import Face, FacePart
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT
from tts2face.numeric.arrays import vertex_normals


def ball(radius: float, n: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Places and triangles of a ball that face outwards."""
    down, around = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, 2 * n), indexing="ij")
    places = np.stack([np.sin(down) * np.sin(around), np.cos(down), np.sin(down) * np.cos(around)], axis=-1)
    at = np.arange(places[..., 0].size).reshape(places.shape[:2])
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    corners = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    _, first, number = np.unique(np.rint(places.reshape(-1, 3) * 1e6), axis=0, return_index=True, return_inverse=True)
    corners = number.reshape(-1)[corners]
    is_whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)  # at the poles corners meet
    return radius * places.reshape(-1, 3)[first], corners[is_whole]


def outwards(head: HeadMesh) -> np.ndarray:
    points = head.vertices[head.triangles]
    flat = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    found: np.ndarray = (flat * points.mean(axis=1)).sum(axis=1) > 0
    return found


def mesh(places: np.ndarray, triangles: np.ndarray) -> HeadMesh:
    n = len(places)
    return HeadMesh(
        places, triangles, np.zeros(len(triangles), np.int64), np.full((n, 2), np.nan), np.ones((n, 3)), {},
        np.zeros(n, np.int64), np.zeros(n, np.int8), np.eye(3),
    )  # fmt: skip


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_triangles_that_face_inwards_are_turned_over(share: float) -> None:
    places, triangles = ball(1.0)
    is_turned = np.random.default_rng(2).random(len(triangles)) < share
    turned = np.where(is_turned[:, None], triangles[:, ::-1], triangles)
    assert outwards(facing_outwards(mesh(places, turned))).all()


def test_vertices_of_their_own_are_joined_for_it() -> None:
    places, triangles = ball(1.0)
    soup = np.arange(triangles.size).reshape(-1, 3)
    soup[::3] = soup[::3, ::-1]
    assert outwards(facing_outwards(mesh(places[triangles.ravel()], soup))).all()


def test_the_inner_wall_of_a_hollow_statue_still_faces_inwards() -> None:
    places, triangles = ball(1.0)
    both = mesh(np.concatenate([places, 0.95 * places]), np.concatenate([triangles, len(places) + triangles[:, ::-1]]))
    assert outwards(facing_outwards(both)).tolist() == outwards(both).tolist()


def ball_face(*radii: float) -> Face:
    """Face of balls within each other, of which every second one faces inwards."""
    shells = [ball(radius) for radius in radii]
    places = np.concatenate([shell[0] for shell in shells])
    first = np.cumsum([0, *(len(shell[0]) for shell in shells)])
    corners = np.concatenate(
        [at + f[:, :: (-1) ** k] for k, (at, (_, f)) in enumerate(zip(first, shells, strict=False))]
    )
    face, _ = plate()
    return replace(
        face, vertices=places.astype(np.float32), triangles=corners.astype(np.int32),
        parts=(FacePart("skin:balls", 0, len(corners)),), colours=np.full((len(places), 3), 200, np.uint8),
        shapes=np.zeros((0, len(places), 3), np.float32),
    )  # fmt: skip


def test_the_inner_wall_is_left_out_and_a_solid_head_is_not_changed() -> None:
    solid, is_hollow = without_inner_wall(ball_face(90.0))
    assert not is_hollow
    whole = ball_face(90.0, 86.0)
    found, is_hollow = without_inner_wall(whole)
    assert is_hollow
    assert found.triangles.tolist() == solid.triangles.tolist()
    assert found.parts[0].count == solid.parts[0].count


def coarse_plate() -> tuple[Face, np.ndarray]:
    """A plate with edges of 12 mm, a seam of its texture along x = 0, and a hole of a scan at its lips."""
    face, landmarks = plate(11)
    corners = face.triangles.astype(np.int64)
    middles = face.vertices[corners].mean(axis=1)
    corners = corners[~((np.abs(middles[:, 0] - 6) < 5) & (np.abs(middles[:, 1] - 6) < 7))]
    # the seam: vertices at one place with texture coordinates of their own
    is_left = middles[: len(corners), 0] < 0
    twin = np.arange(len(face.vertices)) + len(face.vertices)
    corners = np.where((face.vertices[corners].mean(axis=1)[:, 0] < 0)[:, None], twin[corners], corners)
    assert is_left.any()
    return replace(
        face, vertices=np.tile(face.vertices, (2, 1)), colours=np.tile(face.colours, (2, 1)),
        triangles=corners.astype(np.int32), parts=(replace(face.parts[0], count=len(corners)),),
        shapes=np.zeros((0, 2 * len(face.vertices), 3), np.float32),
    ), landmarks  # fmt: skip


def _area(face: Face) -> float:
    points = face.vertices[face.triangles].astype(np.float64)
    flat = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    assert (flat[:, 2] > 0).all()  # none is turned over
    return float(flat[:, 2].sum() / 2)


def test_a_hole_at_the_lips_is_filled_and_long_edges_are_divided() -> None:
    face, landmarks = coarse_plate()
    found = prepare_mouth(face, landmarks)
    assert _area(face) < 120 * 120 - 50
    assert _area(found) == pytest.approx(120 * 120, rel=1e-5)
    points = found.vertices[found.triangles]
    length = np.linalg.norm(points - np.roll(points, 1, axis=1), axis=2)
    assert length[np.abs(points[:, :, 1]).max(axis=1) < 4].max() < 6.0
    # no vertex of one triangle lies within an edge of its neighbour
    place = np.unique(np.rint(found.vertices * 1e3), axis=0, return_inverse=True)[1].reshape(-1)[found.triangles]
    edges = np.concatenate([place[:, [0, 1]], place[:, [1, 2]], place[:, [2, 0]]])
    _, first, counts = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    ends = found.vertices[np.concatenate([found.triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])]
    rim = np.abs(ends[first[counts == 1]].mean(axis=1) - [0, 1, 0]).max(axis=1)
    np.testing.assert_allclose(rim, 60.0)
    assert counts.max() == 2


def test_a_face_without_holes_and_long_edges_is_not_changed() -> None:
    face, landmarks = plate(121)
    found = prepare_mouth(face, landmarks)
    np.testing.assert_array_equal(found.triangles, face.triangles)


def test_a_mouth_and_its_teeth_stay_behind_the_skin_in_every_shape() -> None:
    face, landmarks = plate()
    opened = open_mouth(face, build_skin(face, landmarks), 1.0)
    assert opened is not None
    n, n_teeth = len(opened.face.vertices), 30
    teeth = np.column_stack([np.linspace(-15, 15, n_teeth), np.full(n_teeth, 6.0), np.full(n_teeth, 2.0)])
    pressed = np.zeros((2, n + n_teeth, 3), np.float32)
    pressed[:, : len(face.vertices), 2] = -2.0  # each side moves the lips back by 2 mm, both by 4
    made = replace(
        opened.face, vertices=np.concatenate([opened.face.vertices, teeth]).astype(np.float32),
        colours=np.full((n + n_teeth, 3), 200, np.uint8), shape_names=("mouthPressLeft", "mouthPressRight"),
        shapes=pressed, limits=np.tile(np.array([0, 1], np.float32), (2, 1)),
    )  # fmt: skip
    found = keep_covered(made, opened.rows, np.arange(n, n + n_teeth), 1.0)
    assert found.vertices[n:, 2].max() == pytest.approx(-5.0, abs=0.01)  # a millimetre behind both
    assert np.ptp(found.vertices[n:, 2]) < 1e-6  # as one
    np.testing.assert_array_equal(found.vertices[: len(face.vertices)], made.vertices[: len(face.vertices)])
    inner = found.vertices[opened.rows[0, 2:]]
    assert inner[..., 2].max() < -4.0


def test_rolled_edges_have_vertices_of_their_own_which_leave_the_light_on_the_lips_alone() -> None:
    face, landmarks = plate()
    opened = open_mouth(face, build_skin(face, landmarks), 1.0)
    assert opened is not None
    made = replace(opened.face, shapes=np.zeros((0, len(opened.face.vertices), 3), np.float32))
    found = with_edges_apart(made, opened.rolled)
    names = [part.name for part in found.parts]
    assert names == ["skin:plate", LIP_EDGES, MOUTH]
    assert sum(part.count for part in found.parts) == len(found.triangles) == len(made.triangles)
    np.testing.assert_array_equal(found.vertices[found.triangles], made.vertices[made.triangles])
    skin, edges, _ = (np.unique(found.triangles[part.first : part.first + part.count]) for part in found.parts)
    assert not np.intersect1d(skin, edges).size
    flat = vertex_normals(found.vertices.astype(np.float64), found.triangles[: found.parts[0].count])
    assert flat[skin, 2].min() > 0.99  # the rolled edges turned the normals of the lips


def test_a_fold_that_touches_a_lip_in_one_vertex_does_not_hold_the_lips_together() -> None:
    face, landmarks = plate()
    below = int(np.abs(face.vertices - [2.5, -1.5, 0]).sum(axis=1).argmin())
    assert face.vertices[below, 1] < 0
    tips = face.vertices[below] + np.array([[-0.5, 2.5, 0.3], [0.5, 2.5, 0.3], [0.0, 3.0, 0.5]])
    n = len(face.vertices)
    fan = np.array([[below, n, n + 1], [below, n + 1, n + 2], [below, n + 2, n]])
    held = replace(
        face, vertices=np.concatenate([face.vertices, tips]).astype(np.float32),
        colours=np.full((n + 3, 3), 200, np.uint8), shapes=np.zeros((0, n + 3, 3), np.float32),
        triangles=np.concatenate([face.triangles, fan]).astype(np.int32),
        parts=(replace(face.parts[0], count=len(face.triangles) + 3),),
    )  # fmt: skip
    opened = open_mouth(held, build_skin(held, landmarks), 1.0)
    assert opened is not None
    part = opened.face.parts[0]
    corners = opened.face.triangles[part.first : part.first + part.count - len(opened.rolled)]
    places = opened.face.vertices[corners]
    crosses = (places[..., 1].max(axis=1) > 0.2) & (places[..., 1].min(axis=1) < -0.2)
    assert not (crosses & (np.abs(places[..., 0]).max(axis=1) < 20)).any()


def test_displacements_along_a_cut_become_smooth_and_lines_stay() -> None:
    face, landmarks = plate()
    skin = build_skin(face, landmarks)
    edge = np.flatnonzero((np.abs(skin.vertices[:, 1]) < 2) & (np.abs(skin.vertices[:, 0]) < 26))
    line = np.zeros((1, len(skin.vertices), 3))
    line[0, :, 1] = 0.1 * skin.vertices[:, 0]
    none = np.zeros(0, np.int64)
    np.testing.assert_allclose(smooth_edges(skin, line, (edge, none)), line, atol=1e-9)
    jagged = line.copy()
    jagged[0, edge, 1] += 0.5 * (-1.0) ** np.arange(len(edge))
    found = smooth_edges(skin, jagged, (edge, none))
    assert np.abs(found - line)[0, edge].mean() < 0.2


def test_shut_lids_lie_before_the_eyeball_and_their_inner_side_behind_them() -> None:
    eye = ball_face(10.0)
    face = replace(eye, parts=(replace(eye.parts[0], name="eyes:balls"),))
    sheet, landmarks = plate(25)
    flat = (sheet.vertices * [0.2, 0.2, 0.0]).astype(np.float64)
    n, corners = len(flat), sheet.triangles.astype(np.int64)
    skin = Skin(
        np.concatenate([flat + depth * np.eye(3)[2] for depth in (11.0, 10.6)]), np.concatenate([corners, n + corners]),
        np.full(len(face.vertices), -1), np.arange(2 * n) < n, landmarks, np.full(2 * n, 3),
    )  # fmt: skip
    shape = np.zeros((2 * n, 3))
    shape[:n, 2], shape[n:, 2] = -4.0, 3.0  # the outer side into the eyeball, the inner one before it
    keep_off_eyeballs(face, skin, shape)
    outer, inner = (skin.vertices + shape)[:n], (skin.vertices + shape)[n:]
    over = np.linalg.norm(outer[:, :2], axis=1) < 8.0
    assert (outer[over, 2] > np.sqrt(100.0 - (outer[over, :2] ** 2).sum(axis=1)) - 0.05).all()
    assert (inner[over, 2] < outer[over, 2]).all()
    assert np.abs(shape[:, :2]).max() == 0.0


def test_half_a_face_is_refused() -> None:
    landmarks = own_landmarks(load_face("head"))
    _check_whole(landmarks)
    landmarks[EYE_OUTER_LEFT, 0] = landmarks[1, 0] + 6.0
    with pytest.raises(DataError, match=r"only one side of a face is there: .* mirror the half"):
        _check_whole(landmarks)


def test_what_is_guessed_of_a_head_is_said() -> None:
    apart = {EYE_OUTER_LEFT: np.array([0.045, 0, 0]), EYE_OUTER_RIGHT: np.array([-0.045, 0, 0])}
    assert place_notes(np.eye(3), apart, 90.0) == []
    lying = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    inches = {number: place * 39.37 for number, place in apart.items()}
    axes, unit = place_notes(lying, inches, 92.0)
    assert axes == (
        "by its pictures the head looks along -y with +z up, and is turned; a table of --landmarks sets its place"
    )
    assert unit.startswith("its unit is not the metre (the eyes' outer corners are 3.54 units apart)")
    turn = np.array([[np.cos(0.4), 0, np.sin(0.4)], [0, 1, 0], [-np.sin(0.4), 0, np.cos(0.4)]])
    assert place_notes(turn, apart, 90.0) == [
        "by its pictures the head looks along +z with +y up, 23 degrees off, and is turned; --front sets its axis"
    ]


@pytest.mark.parametrize("name", ["head", "ben"])
def test_lips_of_shipped_faces_are_no_painted_ones(name: str) -> None:
    face = load_face(name)
    assert lip_relief(face, own_landmarks(face)) > 2 * RELIEF
