"""Drawn characters: their tables, the map of space, and the surfaces of locks and rolls."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial import cKDTree

from corpus_tools.dense.grids import grid_triangles, wind_outward
from corpus_tools.shipped.drawn.build_drawn import CAST
from corpus_tools.shipped.drawn.character import CharacterColours, DrawnCharacter, Hairstyle
from corpus_tools.shipped.drawn.clothes import _roll
from corpus_tools.shipped.drawn.fields import Front, smooth_line
from corpus_tools.shipped.drawn.hair import (
    LOWEST_DEG,
    MIDDLE,
    N_DOWN,
    N_ROUND,
    Scalp,
    curled_tube,
    height_over_hairline,
    lock_tube,
    on_volume,
    other_palettes,
)
from corpus_tools.shipped.drawn.paint import _brow_hairs, paint_eye
from corpus_tools.shipped.drawn.sculpt import apply_proportions
from corpus_tools.shipped.drawn.tiles import COLLAR, MARGIN, SHIRT, cut_seam, hair_tiles, in_tile
from corpus_tools.shipped.drawn.worn import HAIRCUTS, comb, cut, grow, lay_closer
from corpus_tools.shipped.head.skin import HeadSkin
from lexicon.errors import DataError
from tests.face.people import DRAWN
from tts2face.models.face_loading import load_face

ROUND = np.linspace(-180, 180, N_ROUND + 1)
EYES = [np.array([31.0, 0.0, 0.0]), np.array([-31.0, 0.0, 0.0])]
WITH_COLLAR = [name for name, one in CAST.items() if one.collar]
EVERYBODY = pytest.mark.parametrize("character", CAST.values(), ids=list(CAST))
STYLES = {f"{name} {style.name}": style for name, one in CAST.items() for style in (one.hair, *HAIRCUTS.get(name, ()))}
EVERY_STYLE = pytest.mark.parametrize("style", STYLES.values(), ids=list(STYLES))


def ball(radius: float = 70.0) -> HeadSkin:
    """A ball about the middle of the hair, in place of a skull."""
    n_down, n_around = 24, 48
    down, around = np.meshgrid(np.linspace(0.05, np.pi - 0.05, n_down), np.arange(n_around) / n_around * 2 * np.pi)
    towards = np.stack([np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)], axis=-1)
    points = MIDDLE + radius * towards.reshape(-1, 3)
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(n_around), np.arange(n_down - 1), indexing="ij"))
    here, beside = row * n_down + column, (row + 1) % n_around * n_down + column
    quads = np.stack([here, beside, beside + 1, here + 1], axis=1)
    return HeadSkin(points, {}, quads, np.zeros((len(points), 2)), points)


def closed_sides(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """How many triangles use each side of a surface; vertices at one place are one, sides of no length left out."""
    _, weld = np.unique(np.rint(points * 1e4).astype(np.int64), axis=0, return_inverse=True)
    corners = weld.ravel()[triangles]
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    return np.unique(sides[sides[:, 0] != sides[:, 1]], axis=0, return_counts=True)[1]


@EVERYBODY
def test_tables_are_within_their_ranges(character: DrawnCharacter) -> None:
    for one in fields(CharacterColours):
        value = getattr(character.palette, one.name)
        if isinstance(value, tuple) and one.name not in ("tints", "ears", "lids"):
            assert all(0 <= part <= 1 for part in value), one.name
    brow = character.brow
    assert bool(brow.hairs) != bool(brow.thickness)  # painted or solid
    for profile in filter(None, (brow.half_width, brow.thickness, character.lashes)):
        shares = [share for share, _ in profile]
        assert (shares[0], shares[-1], shares) == (0, 1, sorted(set(shares)))
        assert min(value for _, value in profile) >= 0
    names = set(load_face("head").shape_names)
    assert {f"{name}{side}" for name in character.rest for side in ("Left", "Right")} <= names


@EVERYBODY
def test_the_map_of_space_turns_nothing_inside_out(character: DrawnCharacter) -> None:
    """Its Jacobian determinant stays above 0 where faces are, so that surfaces neither fold nor meet."""
    axes = np.linspace(-85, 85, 35), np.linspace(-140, 120, 53), np.linspace(-120, 60, 37)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    step = 0.01
    columns = [
        apply_proportions(points + step * axis, EYES, character.proportions)
        - apply_proportions(points - step * axis, EYES, character.proportions)
        for axis in np.eye(3)
    ]
    jacobian = np.stack(columns, axis=-1) / (2 * step)
    on_midline = np.abs(points[:, 0]) < 2 * step  # cheeks part there by some hundredths of a millimetre
    assert np.linalg.det(jacobian)[~on_midline].min() > 0.05


def test_every_drawn_character_has_three_haircuts_with_names_of_their_own() -> None:
    for name in DRAWN:
        names = [CAST[name].hair.name, *(style.name for style in HAIRCUTS[name])]
        assert len(set(names)) == len(names) >= 3
        assert all(style.summary for style in HAIRCUTS[name])


@EVERY_STYLE
def test_hair_grows_from_the_hairline_to_the_crown(style: Hairstyle) -> None:
    turns = [turn for turn, _ in style.hairline]
    assert (turns[0], turns[-1], turns) == (-180, 180, sorted(set(turns)))
    assert all(2 * -LOWEST_DEG <= height <= 90 for lock in style.locks for _, height, _ in lock.path)
    assert len(hair_tiles(1 + len(style.locks) + (style.curls is not None))) > 1


@EVERY_STYLE
def test_locks_are_closed_and_face_outwards(style: Hairstyle) -> None:
    scalp = Scalp(ball(), style)
    for lock in style.locks:
        tube = lock_tube(lock, scalp)
        assert (closed_sides(tube.points, tube.triangles) == 2).all()
        a, b, c = tube.points[tube.triangles].transpose(1, 0, 2)
        assert np.einsum("fc,fc->f", a, np.cross(b, c)).sum() > 0  # six times the volume
        assert np.isfinite(tube.points).all()
        assert (tube.places.min(), tube.places.max()) == (0, 1)
        assert np.abs(np.linalg.norm(tube.tangents, axis=1) - 1).max() < 1e-6
        assert np.ptp(tube.along) == 1


@pytest.mark.parametrize("style", [one for one in STYLES.values() if one.curls], ids=["curls", "afro"])
def test_curls_stand_off_the_head_and_sink_into_it_at_their_edge(style: Hairstyle) -> None:
    tube, curls = curled_tube(style.curls, Scalp(ball(), style)), style.curls
    height = np.linalg.norm(tube.points - MIDDLE, axis=1) - 70
    on_volume_mm = np.linalg.norm([on_volume(turn, 89, 0.0) - MIDDLE for turn in (0, 90)], axis=1).mean() - 70
    rows = height.reshape(N_DOWN, N_ROUND + 1)
    assert rows[:10].mean() == pytest.approx(on_volume_mm + curls.lift, abs=curls.height)
    assert np.ptp(rows[5:25]) > 0.7 * curls.height
    edge = np.linalg.norm(tube.points.reshape(N_DOWN, -1, 3)[-1] - MIDDLE, axis=1)
    skin = np.linalg.norm(
        [
            on_volume(turn, low, 0.0) - MIDDLE
            for turn, low in zip(ROUND, Scalp(ball(), style).hairline(ROUND), strict=True)
        ],
        axis=1,
    )
    assert (edge < skin).all()
    a, b, c = (tube.points[tube.triangles] - MIDDLE).transpose(1, 0, 2)
    assert np.einsum("fc,fc->f", a, np.cross(b, c)).sum() > 0


def test_locks_are_cut_grown_and_combed() -> None:
    hanging = next(lock for lock in CAST["ada"].hair.locks if lock.path[-1][1] < -50)
    short = cut(hanging, -14.0)
    assert short.path[-1][1] == -14
    assert all(height > -14 for _, height, _ in short.path[:-1])
    assert cut(short, -30.0) is short
    long = grow(hanging, (0, -70, 20), (5, -100, 40))
    assert long.path[-1] == (hanging.path[-2][0] + 5, -100, 40)
    assert long.path[: len(hanging.path) - 1] == hanging.path[:-1]
    assert grow(short, (0, -70, 20)) is short
    flat = comb(hanging, 0.5)
    assert [lift for _, _, lift in flat.path if lift > 0] == [lift / 2 for _, _, lift in hanging.path if lift > 0]


def test_other_colours_lie_on_both_sides_of_the_own_one() -> None:
    for character in CAST.values():
        own = np.mean(character.palette.hair)
        others = [np.mean(one.hair) for one in other_palettes(character.palette)]
        assert min(own, *others) < 0.13
        assert max(own, *others) > 0.5
        assert np.abs(np.array(others) - own).min() > 0.05
        assert all(0 <= part <= 1 for one in other_palettes(character.palette) for part in one.hair_tip)


def test_the_volume_of_hair_is_continuous_and_lift_is_its_distance() -> None:
    for turn in range(-180, 180, 15):
        above, below = (on_volume(turn, height, 0.0) for height in (1e-6, -1e-6))
        assert np.linalg.norm(above - below) < 1e-3
        for height in (-50.0, -10.0, 20.0, 70.0):
            assert np.linalg.norm(on_volume(turn, height, 7.0) - on_volume(turn, height, 0.0)) == pytest.approx(7.0)


@EVERY_STYLE
def test_hair_grows_over_the_crown_and_not_in_the_face_or_on_the_ears(style: Hairstyle) -> None:
    crown, chin, forehead, ear = np.array([[0.0, 120, -58], [0, -80, 20], [0, 40, 40], [78, -8, -66]])
    heights = height_over_hairline(np.stack([crown, chin, forehead, ear]), style)
    assert heights[0] > 20
    assert (heights[1:] < 0).all()


def test_hair_stays_outside_of_the_skin() -> None:
    scalp = Scalp(ball(), CAST["ada"].hair)
    inside = MIDDLE + 20 * np.random.default_rng(3).normal(size=(50, 3)) + [0, 60, 0]
    away = np.linalg.norm(scalp.keep_outside(inside, 3.0) - MIDDLE, axis=1)
    assert (away > np.minimum(70.0, np.linalg.norm(inside - MIDDLE, axis=1)) - 1e-9).all()
    near = MIDDLE + 68.0 * (inside - MIDDLE) / np.linalg.norm(inside - MIDDLE, axis=1, keepdims=True)
    assert np.abs(np.linalg.norm(scalp.keep_outside(near, 3.0) - MIDDLE, axis=1) - 73.0).max() < 1.0


def test_a_lock_is_laid_closer_to_the_head() -> None:
    lock = next(lock for lock in CAST["ada"].hair.locks if lock.path[-1][1] < -50)
    lower = lay_closer(lock, 4.0)
    assert [a[2] - b[2] for a, b in zip(lock.path, lower.path, strict=True)] == [
        4.0 if up > -50 else 0.0 for _, up, _ in lock.path
    ]
    rooted = lay_closer(lock, 4.0, root_mm=9.0, root_deg=2.0)
    assert (lower.path[0][1] - rooted.path[0][1], lower.path[0][2] - rooted.path[0][2]) == (2.0, 9.0)
    assert rooted.path[1:] == lower.path[1:]


@pytest.mark.parametrize("character", [one for one in CAST.values() if one.collar], ids=[*WITH_COLLAR])
def test_a_roll_goes_around_the_neck(character: DrawnCharacter) -> None:
    points, triangles, places = _roll(character.collar)
    assert (closed_sides(points, triangles) == 2).all()
    assert (places.min(), places.max()) == (0, 1)
    front, back = points[points[:, 2].argmax()], points[points[:, 2].argmin()]
    assert front[1] < back[1]  # higher behind


@EVERYBODY
def test_an_iris_has_a_dark_ring_and_a_black_pupil(character: DrawnCharacter) -> None:
    pixels = paint_eye(character.eyes, character.palette).astype(int)
    row = pixels[len(pixels) // 2].sum(axis=1)
    half = len(row) // 2
    light = [row[half], row[half + int(0.7 * character.eyes.iris / 2.2 * len(row))], row[-20]]
    assert light[0] < light[1] < light[2]
    limbus = row[half + int(0.96 * character.eyes.iris / 2.2 * len(row))]
    assert limbus < light[1]


def test_brows_are_painted_hair_by_hair_along_their_line() -> None:
    brow = CAST["mara"].brow
    across, up = np.meshgrid(np.arange(-70, 70.1, 0.5), np.arange(0, 45.1, 0.5))
    place = np.stack([across, up, np.full_like(up, 20.0)], axis=-1).reshape(-1, 3)
    cover = _brow_hairs(place, brow)
    on_line = [np.linalg.norm(place[:, :2] - [x, y], axis=1).argmin() for x, y in smooth_line(brow.line, 30)[5:25]]
    near = cKDTree(place[:, :2]).query_ball_point(place[on_line, :2], 2.0)
    assert min(cover[rows].mean() for rows in near) > 0.3
    far = cKDTree(np.abs(smooth_line(brow.line, 100))).query(np.abs(place[:, :2]))[0] > 12
    assert cover[far].max() < 0.01
    left, right = (cover[sign * place[:, 0] > 0].sum() for sign in (1, -1))
    assert left == pytest.approx(right, rel=0.1)
    assert _brow_hairs(place - [0, 0, 40], brow).max() == 0  # behind the face


def test_surfaces_in_rows() -> None:
    open_grid, closed = grid_triangles(3, 4), grid_triangles(3, 4, is_closed=True)
    assert (len(open_grid), len(closed), closed.max()) == (12, 16, 11)
    line = smooth_line([(0, 0), (1, 1), (3, 1)], 9)
    assert np.allclose(line[[0, -1]], [[0, 0], [3, 1]])
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    inward = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    assert np.array_equal(wind_outward(corners, inward, corners.mean(axis=0)), inward[:, ::-1])


def test_lines_come_in_front_of_a_surface() -> None:
    wall = Front(np.array([[x, y, 0.0] for x in range(10) for y in range(10)]))
    line = np.array([[x, 5.0, -1.0] for x in range(10)])
    assert np.allclose(wall.lacking(line, 0.5), 1.5)
    assert np.allclose(wall.lacking(line + np.array([0, 0, 9]), 0.5), 0.0)


def test_tiles_of_the_texture_do_not_overlap() -> None:
    tiles = [*hair_tiles(24), SHIRT, COLLAR]
    area = sum((right - left) * (bottom - top) for left, right, top, bottom in tiles)
    assert area == pytest.approx(1.0)
    corners = np.array([[0.0, 0.0], [1.0, 1.0]])
    spans = [in_tile(tile, *corners.T) for tile in tiles]
    assert all(span.min() > 0 and span.max() < 1 and (np.diff(span, axis=0) > 0.02).all() for span in spans)
    for number, one in enumerate(spans):
        for other in spans[:number]:
            apart = np.maximum(one[0] - other[1], other[0] - one[1]).max()
            assert apart > MARGIN
    with pytest.raises(DataError, match="tiles for 24 locks, not 25"):
        hair_tiles(25)


def test_a_surface_around_an_axis_is_cut_where_its_turn_jumps() -> None:
    turn = np.array([0.05, 0.3, 0.5, 0.7, 0.95])
    triangles = np.array([[0, 4, 3], [1, 2, 3], [0, 1, 2]])
    vertices, cut, turns = cut_seam(triangles, turn)
    assert vertices.tolist() == [0, 1, 2, 3, 4, 0]
    assert np.array_equal(vertices[cut], triangles)
    assert cut.tolist() == [[5, 4, 3], [1, 2, 3], [0, 1, 2]]
    assert turns[5] == pytest.approx(1.05)
