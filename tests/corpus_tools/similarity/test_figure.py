"""Figures: the geometry of the dendrogram, colours, axes, and that every number is there."""

import re
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from corpus_tools.report.plots import Axes, Point, bars, line_plot, scatter, ticks
from corpus_tools.report.ramps import Ramp, difference_ramp, likeness_ramp
from corpus_tools.similarity import picture
from corpus_tools.similarity.analysis import Named, Options, analyse
from corpus_tools.similarity.classes import cluster_tree
from corpus_tools.similarity.figure import brackets_of, similarity_figure
from corpus_tools.similarity.heatmap import heatmap
from corpus_tools.similarity.labels import label


@pytest.fixture(scope="module")
def found(talker):
    return analyse(Named("made", talker), Options(halves=2))


def test_the_brackets_of_three_phones_by_hand():
    tree = cluster_tree(np.array([[0.0, 0.9, 0.2], [0.9, 0.0, 0.7], [0.2, 0.7, 0.0]]))
    low, high = brackets_of(tree)
    rank = {int(phone): at + 0.5 for at, phone in enumerate(tree.order)}
    assert low.rows == tuple(sorted((rank[0], rank[2])))
    assert (low.heights, low.height) == ((0.0, 0.0), 0.2)
    assert high.height == pytest.approx((0.9 + 0.7) / 2)
    assert set(high.rows) == {rank[1], (rank[0] + rank[2]) / 2}
    assert dict(zip(high.rows, high.heights, strict=True))[rank[1]] == 0.0


def test_the_cut_crosses_as_many_branches_as_there_are_classes(found):
    figure = similarity_figure(found, "ipa")
    below = [h for bracket in figure.brackets for h in bracket.heights if h < figure.cut <= bracket.height]
    assert len(below) == found.best.n_classes == len(figure.blocks) - 1


def test_the_figure_is_the_table_in_another_order(found):
    figure = similarity_figure(found, "ipa")
    for i, a in enumerate(figure.names):
        for j, b in enumerate(figure.names):
            at = found.table.phones.index(a), found.table.phones.index(b)
            assert figure.values[i, j] == found.table.matrix[at]


def test_every_field_of_the_heat_map_tells_its_number(found):
    figure = similarity_figure(found, "both")
    titles = re.findall(r"<title>([^<]*) – ([^<]*): ([\d.]+)</title>", heatmap(figure))
    assert len(titles) == len(figure.names) ** 2
    told = {(a, b): float(value) for a, b, value in titles}
    for i, a in enumerate(figure.names):
        for j, b in enumerate(figure.names):
            assert told[a, b] == pytest.approx(figure.values[i, j], abs=5e-4)


def test_labels():
    assert [label("tʃ", labels) for labels in ("ipa", "arpabet", "both")] == ["tʃ", "CH", "tʃ CH"]
    assert label("ø", "arpabet") == label("ø", "both") == "ø"


def lightness(colour):
    return 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2]


def test_the_ramp_of_likeness_rises_in_lightness():
    shades = [lightness(likeness_ramp().colour(value)) for value in np.linspace(0, 1, 50)]
    assert (np.diff(shades) > 0).all()


def test_a_ramp_is_straight_between_its_stops_and_held_beyond():
    ramp = Ramp(0.0, 2.0, ((0, 0, 0), (100, 50, 10), (200, 0, 0)))
    assert ramp.colour(0.5) == (50, 25, 5)
    assert ramp.colour(-3) == (0, 0, 0)
    assert ramp.hexadecimal(9) == "#c80000"
    assert difference_ramp(0.3).colour(0.0) == difference_ramp(0.9).colour(0.0)


@pytest.mark.parametrize(
    ("span", "expected"),
    [((0, 1), [0, 0.2, 0.4, 0.6, 0.8, 1]), ((1, 33), [5, 10, 15, 20, 25, 30]), ((-0.4, 0.4), None)],
)
def test_ticks_are_round(span, expected):
    found = ticks(*span)
    assert 0.0 in found or span[0] > 0
    assert all(span[0] - 1e-9 <= value <= span[1] + 1e-9 for value in found)
    if expected is not None:
        np.testing.assert_allclose(found, expected)


def test_points_lie_where_their_numbers_say():
    axes = Axes("x", "y", (0.0, 10.0), (0.0, 1.0))
    found = scatter(axes, [Point(0.0, 0.0, "a < b"), Point(10.0, 1.0, "far")], (0.0, 0.1))
    circles = re.findall(r'cx="([\d.]+)" cy="([\d.]+)"', found)
    (x0, y0), (x1, y1) = ((float(x), float(y)) for x, y in circles)
    assert (x0, y0, x1, y1) == (56.0, 256.0, 546.0, 12.0)
    assert f"M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}" in found
    assert "a &lt; b" in found


def test_the_best_point_of_a_line_is_marked():
    axes = Axes("x", "y", (0.0, 3.0), (0.0, 1.0))
    points = [Point(x, 0.5, "") for x in (0.0, 1.0, 2.0)]
    radii = re.findall(r' r="([\d.]+)" fill="([^"]+)"', line_plot(axes, points, 1))
    assert [radius for radius, _ in radii] == ["3.5", "6", "3.5"]


def test_a_bar_is_as_long_as_its_number():
    widths = [float(width) for width in re.findall(r'width="([\d.]+)" height="14"', bars([("a", 0.25), ("b", 1.0)]))]
    whole = widths[0]
    assert widths == [whole, whole / 4, whole, whole]


def test_the_picture_shows_the_colours_of_the_table(found):
    figure = similarity_figure(found, "arpabet")
    image = Image.open(BytesIO(picture.table_png(figure))).convert("RGB")
    left = picture.MARGIN + picture.TREE + picture.LABEL
    top = picture.MARGIN + picture.HEAD + picture.LABEL
    for i in range(len(figure.names)):
        for j in range(len(figure.names)):
            middle = left + (j + 0.5) * picture.CELL, top + (i + 0.5) * picture.CELL
            assert image.getpixel((int(middle[0]), int(middle[1]))) == figure.ramp.colour(figure.values[i, j])
