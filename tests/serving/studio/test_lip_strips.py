"""Strips of lips as SVG."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from tts2face.serving.studio.pages.lip_strips import common_cell, opening_mm, strip_svg


def lips(width: float, gap: float) -> dict[str, list[list[float]]]:
    """Outlines of 20 points on ellipses: the outer 10 mm higher than the inner, whose height is the gap."""
    angles = np.pi + np.arange(20) * np.pi / 10
    outer = np.stack([width / 2 * np.cos(angles), (gap + 10) / 2 * np.sin(angles)], axis=1)
    inner = np.stack([width / 2 * np.cos(angles), gap / 2 * np.sin(angles)], axis=1)
    return {"outer": outer.tolist(), "inner": inner.tolist()}


def test_openings_are_those_of_the_inner_lips() -> None:
    assert opening_mm(lips(50, 8)) == pytest.approx(8)
    assert opening_mm(lips(50, -1)) == 0.0  # lips pressed into each other


def test_the_strip_holds_all_lips_within_its_cells() -> None:
    strips = [[lips(50, 2), lips(40, 12)], [lips(44, 0), lips(44, 3)]]
    cell = common_cell(strips)
    root = ElementTree.fromstring(strip_svg(strips[0], cell, "Lips of <a>"))
    _, _, width, height = (float(value) for value in root.attrib["viewBox"].split())
    assert root.attrib["aria-label"] == "Lips of <a>, from its beginning to its end: open by 2.0, 12.0 mm"
    assert root.attrib["role"] == "img"
    assert (width, height) == (pytest.approx(2 * 54, abs=0.01), pytest.approx(26, abs=0.01))  # 2 mm on each side
    for number, group in enumerate(root):
        dx, dy = (float(one) for one in re.findall(r"-?[\d.]+", group.attrib["transform"]))
        places = np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", group[0].attrib["d"]), float) + np.array([dx, dy])
        assert len(places) == 20
        assert (places >= (54 * number, 0)).all()
        assert (places <= (54 * (number + 1), height)).all()


def test_strips_of_a_talker_without_outlines_have_a_cell_too() -> None:
    assert common_cell([[], []]).half_width > 0
