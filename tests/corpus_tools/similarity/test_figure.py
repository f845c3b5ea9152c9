"""Figures: the geometry of the dendrogram, colours, axes, and every number in its place."""

import re
from html import unescape
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from corpus_tools.studies.plots import open_figure
from corpus_tools.studies.similarity.analysis import NamedTalker, SimilarityOptions, analyse
from corpus_tools.studies.similarity.figures import (
    FREEDOM,
    LIKENESS,
    articulation_svg,
    draw_table,
    freedom_svg,
    shares_svg,
    silhouettes_svg,
    similarity_figure,
    table_plot,
    tree_joins,
)
from corpus_tools.studies.similarity.tables import cluster_tree, distances, phone_label
from tests.packages import needs


@pytest.fixture(scope="module")
def found(talker):
    needs("matplotlib", "sklearn")
    return analyse(NamedTalker("made", talker), SimilarityOptions(halves=2))


def test_the_joins_of_three_phones_by_hand():
    tree = cluster_tree(np.array([[0.0, 0.9, 0.2], [0.9, 0.0, 0.7], [0.2, 0.7, 0.0]]))
    joins = tree_joins(tree.links)
    low, high = sorted(joins, key=lambda join: join[:, 0].max())
    rank = {int(phone): at for at, phone in enumerate(tree.order)}
    assert sorted(low[[0, 3], 1]) == sorted((rank[0], rank[2]))
    assert low[:, 0].tolist() == [0.0, 0.2, 0.2, 0.0]
    np.testing.assert_allclose(high[1:3, 0], (0.9 + 0.7) / 2)
    assert {row: height for height, row in high[[0, 3]]} == {rank[1]: 0.0, (rank[0] + rank[2]) / 2: 0.2}


def test_the_leaves_of_the_joins_are_in_the_dendrogram_s_order():
    matrix = np.random.default_rng(6).uniform(size=(12, 12))
    tree = cluster_tree(distances((matrix + matrix.T) / 2))
    joins = tree_joins(tree.links)
    lowest = tree.links[0]
    (first,) = (join for join in joins if join[1, 0] == lowest[2])
    assert sorted(tree.order[first[[0, 3], 1].astype(int)]) == sorted(lowest[:2])


def test_the_cut_crosses_as_many_branches_as_there_are_classes(found):
    figure = similarity_figure(found, "ipa")
    below = [join for join in figure.joins for height in join[[0, 3], 0] if height < figure.cut <= join[1, 0]]
    assert len(below) == found.best.n_classes == len(figure.blocks) - 1


def test_the_figure_is_the_table_in_another_order(found):
    figure = similarity_figure(found, "ipa")
    for i, a in enumerate(figure.names):
        for j, b in enumerate(figure.names):
            at = found.table.phones.index(a), found.table.phones.index(b)
            assert figure.values[i, j] == found.table.matrix[at]


def test_every_field_of_the_heat_map_tells_its_number(found):
    figure = similarity_figure(found, "both")
    titles = re.findall(r"<title>([^<]*) – ([^<]*): ([\d.]+)</title>", table_plot(figure).svg())
    assert len(titles) == len(figure.names) ** 2
    shown = {(a, b): float(value) for a, b, value in titles}
    for i, a in enumerate(figure.names):
        for j, b in enumerate(figure.names):
            assert shown[a, b] == pytest.approx(figure.values[i, j], abs=5e-4)


def test_labels():
    assert [phone_label("tʃ", labels) for labels in ("ipa", "arpabet", "both")] == ["tʃ", "CH", "tʃ CH"]
    assert phone_label("ø", "arpabet") == phone_label("ø", "both") == "ø"


@pytest.mark.parametrize("colours", [LIKENESS, FREEDOM])
@pytest.mark.needs("matplotlib")
def test_sequential_colours_rise_in_lightness(colours):
    import matplotlib as mpl

    shades = mpl.colormaps[colours](np.linspace(0, 1, 50))[:, :3] @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(shades) > 0).all()


def words_of(svg):
    return [unescape(word) for word in re.findall(r">([^<>]+)</text>", svg)]


def tips_of(svg):
    return [unescape(tip) for tip in re.findall(r"<title>([^<]*)</title>", svg)]


def test_the_silhouettes_have_a_point_for_each_number_of_classes(found):
    tips = tips_of(silhouettes_svg(found))
    assert tips == [f"{classes.n_classes} classes: {classes.silhouette:.3f}" for classes in found.curve]
    assert {"number of classes", "mean silhouette"} <= set(words_of(silhouettes_svg(found)))


def test_articulation_has_a_point_for_each_pair(found):
    svg = articulation_svg(found, "ipa")
    assert len(tips_of(svg)) == len(found.table.phones) * (len(found.table.phones) - 1) / 2
    a, b = found.table.phones[:2]
    assert tips_of(svg)[0] == f"{a} – {b}: {found.table.matrix[0, 1]:.3f}"
    assert {"two consonants", "one of each", "two vowels", "similarity"} <= set(words_of(svg))


@pytest.mark.needs("matplotlib")
def test_a_bar_is_as_long_as_its_number():
    svg = shares_svg(["a", "b"], np.array([0.25, 1.0]))
    bars = re.findall(r'<path d="([^"]*)"[^>]*style="fill: var\(--first\)', svg)
    ends = [np.array(re.findall(r"[ML] ([\d.]+) ", bar), float) for bar in bars]
    short, long = (np.ptp(end) for end in ends)
    assert short == pytest.approx(long / 4, rel=1e-4)
    assert {"0.25", "1.00", "a", "b", "share of the variance"} <= set(words_of(svg))


@pytest.mark.needs("matplotlib")
def test_the_spreads_within_phones_are_written_in_their_cells():
    words = words_of(freedom_svg(["p", "b"], ["opening", "width"], np.array([[0.31, 0.5], [1.0, 1.15]])))
    assert {"0.31", "0.50", "1.00", "1.15", "p", "b", "opening", "width"} <= set(words)


def test_the_picture_shows_the_colours_of_the_table(found):
    import matplotlib as mpl

    table = similarity_figure(found, "arpabet")
    image = Image.open(BytesIO(table_plot(table).png())).convert("RGB")
    with open_figure(lambda figure: draw_table(figure, table), *image.size) as (_, tips):
        middles = [tip.axes.transData.transform((tip.x + 0.5, tip.y + 0.5)) for tip in tips]
    expected = mpl.colormaps[LIKENESS](table.values.ravel(), bytes=True)[:, :3]
    for (x, y), colour in zip(middles, expected, strict=True):
        assert image.getpixel((int(x), int(image.height - y))) == tuple(colour)
