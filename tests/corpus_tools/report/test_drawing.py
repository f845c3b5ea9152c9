"""Figures: numbers where they belong, the same bytes every time, nothing outside the user's cache."""

import os
import re
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from corpus_tools.studies.plots import FIRST, PNG_SCALE, Tip, draw_png, draw_svg, load_matplotlib, open_figure
from lexicon.errors import BackendError
from lexicon.phones import PHONES

SCRIPT = """
import os, sys
import corpus_tools.studies.evaluation.page, corpus_tools.studies.recordings_page
import corpus_tools.studies.similarity.write, corpus_tools.studies.gestures.write
assert "matplotlib" not in sys.modules and "sklearn" not in sys.modules
before = dict(os.environ)
from corpus_tools.studies.plots import draw_png
draw_png(lambda figure: figure.subplots() and (), 100, 100)
assert dict(os.environ) == before and "matplotlib.pyplot" not in sys.modules
"""


def diagonal(figure):
    """A line from (0, 0) to (10, 1) across the axes, and three tips."""
    axes = figure.subplots()
    axes.plot([0, 10], [0, 1], color=FIRST)
    axes.set(xlim=(0, 10), ylim=(0, 1), xlabel="a < $b$ $")
    return [Tip(axes, 0, 0, "from < here"), Tip(axes, 10, 1, "to"), Tip(axes, 0, 0, "all", 10, 1)]


@pytest.mark.needs("matplotlib")
def test_lines_and_tooltips_are_at_their_values():
    svg = draw_svg(diagonal, 300, 200, "a & b")
    (path,) = re.findall(r'<path d="M ([^"]*)" clip-path="[^"]*" style="fill: none; stroke: var\(--first\)', svg)
    line = np.array(path.replace("L", "").split(), float).reshape(2, 2)
    tips = np.array(re.findall(r'class="tip" x="(.*?)" y="(.*?)" width="(.*?)" height="(.*?)"', svg), float)
    np.testing.assert_allclose(tips[:2, :2] + tips[:2, 2:] / 2, line, atol=0.1)  # px
    np.testing.assert_allclose(tips[2], [line[0, 0], line[1, 1], *np.abs(line[1] - line[0])], atol=0.1)
    assert 0 < line[0, 0] < line[1, 0] < 300
    assert 0 < line[1, 1] < line[0, 1] < 200
    assert "<title>from &lt; here</title>" in svg
    assert 'aria-label="a &amp; b"' in svg


@pytest.mark.needs("matplotlib")
def test_text_stays_text_and_colours_follow_the_theme():
    svg = draw_svg(diagonal, 300, 200, "")
    assert ">a &lt; $b$ $</text>" in svg
    assert FIRST not in svg
    assert not re.search(r'http|xmlns|<metadata|<g id="', svg)


@pytest.mark.needs("matplotlib")
def test_figures_are_the_same_whatever_the_settings_of_the_user():
    load_matplotlib()
    import matplotlib as mpl

    plain = draw_svg(diagonal, 300, 200, ""), draw_png(diagonal, 300, 200)
    with mpl.rc_context({"lines.linewidth": 9.0, "svg.hashsalt": None, "figure.dpi": 300.0}):
        before = dict(mpl.rcParams)
        assert (draw_svg(diagonal, 300, 200, ""), draw_png(diagonal, 300, 200)) == plain
        assert dict(mpl.rcParams) == before


@pytest.mark.needs("matplotlib")
def test_a_picture_has_its_size_and_no_date():
    with Image.open(BytesIO(draw_png(diagonal, 300, 200))) as image:
        assert image.size == (300 * PNG_SCALE, 200 * PNG_SCALE)
        assert set(image.info) == {"dpi"}
        colours = {colour[:3] for _, colour in image.getcolors(1 << 20)}
    assert tuple(bytes.fromhex(FIRST[1:])) in colours
    assert (255, 255, 255) in colours


@pytest.mark.needs("matplotlib")
def test_every_phone_can_be_drawn():
    def glyphs(figure):
        from matplotlib.font_manager import FontProperties, findfont, get_font

        known.update(get_font(findfont(FontProperties())).get_charmap())
        return ()

    known: dict[int, int] = {}
    with open_figure(glyphs, 100, 100):
        assert {letter for phone in PHONES for letter in phone if ord(letter) not in known} == set()


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(BackendError, match=r"plots need matplotlib, .*; run: pip install 'tts2face\[report\]'"):
        draw_svg(diagonal, 300, 200, "")


@pytest.mark.needs("matplotlib")
def test_matplotlib_is_imported_late_and_writes_to_the_cache_of_tts2face_alone(tmp_path: Path):
    home, cache = tmp_path / "home", tmp_path / "cache"
    home.mkdir()
    places = {"HOME": home, "XDG_CACHE_HOME": cache, "LOCALAPPDATA": cache, "NUMBA_CACHE_DIR": tmp_path / "numba"}
    environment = {**os.environ, **{name: str(place) for name, place in places.items()}}
    environment.pop("MPLCONFIGDIR", None)
    subprocess.run([sys.executable, "-c", SCRIPT], env=environment, check=True)
    written = [file.relative_to(tmp_path) for file in (*home.rglob("*"), *cache.rglob("*")) if file.is_file()]
    assert {file.parent.name for file in written} == {"matplotlib"}
    assert all("tts2face" in file.parts for file in written)
