"""Panels: histograms by hand, lines where their numbers say, the same in both kinds of picture."""

import re
from io import BytesIO

import numpy as np
from PIL import Image

from corpus_tools.report.panels import DOWN, HEAD, Line, Panel, histogram, panel_svg, panels_png
from corpus_tools.report.plots import BOTTOM, TOP, Axes

AXES = Axes("x", "y", (0.0, 10.0), (0.0, 1.0), 300, 200)


def panel(line: Line, *, is_logarithmic: bool = False, axes: Axes = AXES) -> Panel:
    return Panel("a < b", axes, (line,), is_logarithmic)


def test_the_outline_of_a_histogram_by_hand():
    x, y = histogram(np.array([0.5, 0.6, 1.5, 9.0]), np.array([0.0, 1.0, 2.0]))
    np.testing.assert_array_equal(x, [0, 1, 1, 2])
    np.testing.assert_array_equal(y, [0.5, 0.5, 0.5, 0.5])  # what lies beyond is in the last bin


def test_lines_lie_where_their_numbers_say():
    line = Line("rising", "first", np.array([0.0, 10.0, 11.0]), np.array([0.0, 2.0, 0.5]))
    (places,) = re.findall(r'points="([^"]*)"', panel_svg(panel(line)))
    assert places == "56.0,156.0 286.0,12.0"  # what is higher than the plot runs along its top; beyond x it ends
    assert "a &lt; b" in panel_svg(panel(line))


def test_a_logarithmic_axis_names_powers_of_ten():
    line = Line("power", "ink", np.array([0.0, 10.0]), np.array([-2.0, 0.0]))
    axes = Axes("Hz", "power", (0.0, 10.0), (-2.0, 0.0), 300, 200)
    words = re.findall(r">([^<>]+)</text>", panel_svg(panel(line, is_logarithmic=True, axes=axes)))
    assert {"0.01", "0.1", "1"} <= set(words)
    assert "-1.5" not in words


def test_the_picture_shows_the_line_in_its_colour():
    flat = Line("flat", "first", np.array([0.0, 10.0]), np.array([0.5, 0.5]))
    image = Image.open(BytesIO(panels_png("title", [panel(flat)] * 3, 2))).convert("RGB")
    assert image.size == (600, 2 * (200 + HEAD) + HEAD)
    middle = HEAD + DOWN + (TOP + 200 - BOTTOM) / 2
    for left, top in ((0, 0), (300, 0), (0, 200 + HEAD)):
        column = [image.getpixel((left + 150, round(top + middle) + k)) for k in (-2, -1, 0, 1, 2)]
        assert any(blue > 150 > red for red, _, blue in column)
