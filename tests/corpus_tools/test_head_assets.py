"""Parts of the head's builder that read assets and make haircuts, on small synthetic meshes."""

import hashlib
import io
import json
import tarfile

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from corpus_tools.dense.grids import grid_triangles
from corpus_tools.shipped.head import assets
from corpus_tools.shipped.head.assets import Asset, asset_files, parse_asset, unpack_assets
from corpus_tools.shipped.head.haircut import (
    AXIS_Z,
    BROW_Y,
    BUST_Y,
    choose_anchors,
    cut_at_bust,
    smooth_sheet,
    split_seams,
    trim_fringe,
)
from corpus_tools.shipped.head.strands import Cards, StrandStyle, bake_strands, strand_angles, strand_tangents
from corpus_tools.shipped.head.teeth import LOWER, UPPER, follow_lips
from corpus_tools.shipped.head.tongue import shape_tip
from lexicon.errors import DataError

BASE = np.array([[-1, 7, 0], [1, 7, 0], [1, 9, 0], [-1, 9, 0], [0, 8, 1], [0, 8, -1]], float)
AHEAD = np.array([0.0, 0.0, 0.1])
PICTURE = np.full((4, 4, 4), 255, np.uint8)


def square(**changed) -> str:
    """A JSON mesh of one quad that lies 0.1 in front of four vertices of `BASE`."""
    offsets = [[0, 0, 0.1]] * 4
    content = {
        "ref_vIdxs": [[0, 1, 2], [1, 2, 3], [2, 3, 0], [3, 0, 1]],
        "weights": [[1, 0, 0]] * 4,
        "offsets": offsets,
        "vertices": (BASE[:4] + offsets).ravel().tolist(),
        "faces": [11, 0, 1, 2, 3, 0, 0, 1, 2, 3],
        "uvs": [[0, 0, 1, 0, 1, 1, 0, 1]],
    }
    return json.dumps(content | changed)


def test_an_asset_follows_the_mesh_that_it_is_bound_to():
    asset = parse_asset(square(), PICTURE, BASE)
    assert asset.fit(BASE, BASE) == pytest.approx(BASE[:4] + AHEAD, abs=1e-9)
    assert asset.fit(2 * BASE, BASE) == pytest.approx(
        2 * BASE[:4] + [0, 0, 0.2], abs=1e-9
    )  # offsets grow with the head
    assert asset.uv.tolist() == [[0, 1], [1, 1], [1, 0], [0, 0]]
    assert asset.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_offsets_made_on_a_larger_head_shrink():
    wide = BASE[:4] * [1.1, 1.1, 1.0] + [0.1, 0, 0.1]
    offsets = [[0.1, 0, 0.1]] * 4
    asset = parse_asset(square(offsets=offsets, vertices=wide.ravel().tolist()), PICTURE, BASE)
    assert asset.offsets[0] == pytest.approx([0.1 / 1.1, 0, 0.1], rel=0.3)
    assert asset.offsets[0, 0] == pytest.approx(0.1 / 1.1)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"ref_vIdxs": None}, "no binding"),
        ({"faces": [11, 0, 1, 2]}, "no binding, vertices or quads"),
        ({"faces": [10, 0, 1, 2, 3, 0, 0, 1, 2, 3]}, "a face of another kind"),
    ],
)
def test_a_mesh_without_what_is_needed_is_refused(changed, reason):
    text = square(**changed)
    if changed.get("ref_vIdxs", 0) is None:
        text = json.dumps({key: value for key, value in json.loads(text).items() if key != "ref_vIdxs"})
    with pytest.raises(DataError, match=reason):
        parse_asset(text, PICTURE, BASE)


def test_only_files_with_the_pinned_hash_are_taken(tmp_path, monkeypatch):
    archive = tmp_path / "p.tgz"
    with tarfile.open(archive, "w:gz") as package:
        for name, content in (("hair/a/a.json", b"{}"), ("hair/curly/curly.json", b"x")):
            entry = tarfile.TarInfo(assets.PREFIX + name)
            entry.size = len(content)
            package.addfile(entry, io.BytesIO(content))
    table = tmp_path / "assets.tsv"
    monkeypatch.setattr(assets, "TABLE", table)
    table.write_text(f"asset\tfile\tsha256\nhair/a\thair/a/a.json\t{hashlib.sha256(b'y').hexdigest()}\n")
    with pytest.raises(DataError, match="has sha256"):
        unpack_assets(archive, tmp_path / "out")
    table.write_text(f"asset\tfile\tsha256\nhair/a\thair/a/a.json\t{hashlib.sha256(b'{}').hexdigest()}\n")
    unpack_assets(archive, tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").rglob("*") if path.is_file()] == ["a.json"]


def test_only_released_works_are_listed():
    """The works that their owners released under CC0 in 2020; the package also has community uploads."""
    released = {
        "hair": {"short01", "short02", "short03", "short04", "bob01", "bob02", "long01", "ponytail01",
                 "braid01", "afro01"},
        "brows": {f"eyebrow{number:03d}" for number in range(1, 13)},
        "lashes": {f"eyelashes{number:02d}" for number in range(1, 5)},
        "eyes": {"blue", "lightblue", "deepblue", "green", "bluegreen", "grey", "ice", "brownlight"},
    }  # fmt: skip
    for name in asset_files():
        kind, work = name.split("/")
        assert work in released[kind]


def test_seams_split_vertices():
    asset = Asset(
        np.zeros((3, 3), int), np.zeros((3, 3)), np.zeros((3, 3)), np.array([[0, 1, 2], [2, 1, 0]]),
        np.array([[0, 1, 2], [2, 3, 0]]), np.arange(8.0).reshape(4, 2), PICTURE,
    )  # fmt: skip
    places = np.arange(9.0).reshape(3, 3)
    cards = split_seams(asset, places)
    assert len(cards.vertices) == 4
    assert cards.weld.tolist() == [0, 1, 1, 2]
    assert np.array_equal(cards.vertices[cards.triangles[1]], places[[2, 1, 0]])


def strip(x: float) -> Cards:
    """A vertical card of unit width from y = 90 to -60 in front of the face, at x."""
    y = np.linspace(90.0, -60.0, 16)
    vertices = np.concatenate([np.column_stack([np.full(16, x + side), y, np.full(16, 60.0)]) for side in (0.0, 1.0)])
    uv = np.column_stack([np.repeat([0.0, 1.0], 16), np.tile(np.linspace(0, 1, 16), 2)])
    return Cards(vertices, grid_triangles(2, 16), uv, np.arange(32))


def test_a_trimmed_fringe_ends_above_the_brows():
    trimmed = trim_fringe(strip(0.0)).vertices
    assert trimmed[:, 1].min() == pytest.approx(BROW_Y)
    assert (np.diff(trimmed[:16, 1]) < 0).all()
    both = Cards(
        np.concatenate([strip(0.0).vertices, strip(0.0).vertices * [0, 1, 0] + [80.0, 0.0, AXIS_Z]]),
        strip(0.0).triangles,
        np.zeros((64, 2)),
        np.arange(64),
    )
    assert np.array_equal(trim_fringe(both).vertices[32:], both.vertices[32:])  # hair at the sides keeps its length


def test_hair_is_cut_at_the_bust() -> None:
    long = strip(0.0)
    long = Cards(long.vertices * [1, 5, 1], long.triangles, long.uv, long.weld)
    cut = cut_at_bust(long)
    assert cut.vertices[:, 1].min() > BUST_Y - 55  # a row of the strip
    assert cut.vertices[:, 1].max() == long.vertices[:, 1].max()


def test_the_crown_gets_smooth_and_keeps_its_height() -> None:
    x, z = (grid.ravel() for grid in np.meshgrid(np.arange(-50, 51, 10.0), np.arange(-120, -19, 10.0)))
    waves = 2.0 * np.where((np.arange(len(x)) % 2) == 0, 1.0, -1.0)
    vertices = np.column_stack([x, 120 + waves, z])
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(10), np.arange(10), indexing="ij"))
    a = row * 11 + column
    triangles = np.concatenate([np.stack([a, a + 1, a + 12], 1), np.stack([a, a + 12, a + 11], 1)])
    smooth = smooth_sheet(Cards(vertices, triangles, np.zeros((121, 2)), np.arange(121))).vertices
    inner = (np.abs(x) < 35) & (np.abs(z + 70) < 35)
    assert np.ptp(smooth[inner, 1]) < 0.3 * np.ptp(vertices[inner, 1])
    assert smooth[inner, 1].mean() == pytest.approx(120, abs=0.5)


def test_strands_run_along_the_streaks_of_a_picture():
    rng = np.random.default_rng(0)
    columns = rng.integers(40, 200, 64)
    picture = np.dstack([np.tile(columns, (64, 1))] * 3 + [np.full((64, 64), 255)]).astype(np.uint8)
    angles = strand_angles(picture, np.ones((64, 64)), StrandStyle())
    assert np.abs(np.cos(angles[16:48, 16:48])).max() < 0.1  # upright
    tangents = strand_tangents(strip(0.0), angles)
    assert tangents == pytest.approx(np.tile([0.0, -1.0, 0.0], (32, 1)), abs=0.1)


def test_baked_strands_keep_the_mean_and_lose_wide_highlights():
    light = np.linspace(40, 220, 128)
    picture = np.dstack([np.tile(light[:, None], (1, 128))] * 3 + [np.full((128, 128), 255)]).astype(np.uint8)
    relief, alpha, _ = bake_strands(picture, StrandStyle(), 128, np.random.default_rng(1))
    assert relief.mean() == pytest.approx(128, abs=3)
    assert alpha.min() > 240
    rows = gaussian_filter1d(relief.mean(axis=1), 8.0)[20:-20]
    assert rows.max() / rows.min() < 1.5  # 4.9 in the picture's light


def test_anchors_are_spread():
    points = np.random.default_rng(3).uniform(-100, 100, (2000, 3))
    chosen = choose_anchors(points)
    assert len(np.unique(chosen)) == len(chosen)
    apart = np.linalg.norm(points[chosen][:, None] - points[chosen][None], axis=2)
    assert apart[~np.eye(len(chosen), dtype=bool)].min() > 15


def test_front_teeth_follow_the_lips_and_molars_stay():
    points = np.array([[0.0, 0, 25.0], [28.0, 0, -18.0]])
    moved = follow_lips(points, points, 2.0)
    assert moved[:, 2].tolist() == [27.0, -18.0]
    assert follow_lips(points, points, 50.0)[0, 2] == 30.0  # at most 5 mm


def test_upper_incisors_stand_before_the_lower_ones():
    assert UPPER.curve[0, 1] - LOWER.curve[0, 1] == pytest.approx(3.0, abs=1.0)


def test_the_tongue_narrows_towards_its_tip():
    along = np.linspace(-50, 10, 200)
    around = np.linspace(0, 2 * np.pi, 24)
    z, turn = (grid.ravel() for grid in np.meshgrid(along, around))
    tube = np.column_stack([15 * np.cos(turn), -68 + 5 * np.sin(turn), z])
    shaped, tip = shape_tip(tube)
    front, back = shaped[tip > 0.95], shaped[tip == 0]
    assert np.ptp(front[:, 0]) < 0.7 * np.ptp(back[:, 0])
    assert np.ptp(front[:, 1]) < 0.7 * np.ptp(back[:, 1])
    assert shaped[:, 2].max() > tube[:, 2].max()
