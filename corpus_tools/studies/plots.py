"""Matplotlib figures as SVG inside a page and as PNG files; nothing else in the project imports matplotlib."""

import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lexicon.errors import BackendError
from tts2face.storage.user_folders import user_cache

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


INK, SOFT, RULE, FIRST, SECOND = "#1d2329", "#66707a", "#d5dae0", "#0b6cb0", "#b8860b"
# In a page these colours follow the page's light or dark theme.
THEME = {INK: "var(--ink)", SOFT: "var(--soft)", RULE: "var(--line)", FIRST: "var(--first)", SECOND: "var(--second)"}
# Okabe and Ito 2008 from the fourth on: distinguishable by colour-blind readers, and by their dashes in grey.
SERIES = (
    (INK, "solid"), (FIRST, "solid"), (SECOND, "dashed"), ("#009e73", "dotted"), ("#cc79a7", "dashdot"),
    ("#d55e00", (0, (1, 1))), ("#56b4e9", (0, (5, 1))),
)  # fmt: skip
PX_PER_INCH = 72  # of SVG: one unit is one CSS pixel
PNG_SCALE = 2  # PNG pixels for one SVG unit
LEAST_TIP = 8  # px; a smaller area is hard to point at
STYLE = {
    "svg.fonttype": "none", "svg.hashsalt": "tts2face", "figure.dpi": PX_PER_INCH, "savefig.facecolor": "white",
    "font.family": ["DejaVu Sans"], "font.size": 10, "axes.titlesize": 11, "axes.titlecolor": INK,
    "text.color": INK, "text.parse_math": False,
    "axes.edgecolor": SOFT, "axes.labelcolor": INK, "xtick.color": SOFT, "ytick.color": SOFT,
    "xtick.labelcolor": INK, "ytick.labelcolor": INK, "axes.grid": True, "axes.axisbelow": True, "grid.color": RULE,
    "axes.spines.top": False, "axes.spines.right": False, "axes.formatter.useoffset": False, "lines.linewidth": 1.5,
    "legend.frameon": False, "axes.xmargin": 0.0,
}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Tip:
    """Text shown while the mouse is over a rectangle from (x, y) to (x + width, y + height) in data coordinates."""

    axes: "Axes"
    x: float
    y: float
    text: str
    width: float = 0.0
    height: float = 0.0


Draw = Callable[["Figure"], Sequence[Tip] | None]


class Plot(NamedTuple):
    """A figure: the function that draws it, its size in px, and its accessible name."""

    draw: Draw
    width: float
    height: float
    name: str = ""

    def svg(self) -> str:
        """The figure as an element of a page."""
        return draw_svg(*self)

    def svg_file(self) -> bytes:
        """The figure as an SVG file on white."""
        return draw_svg_file(*self)

    def png(self) -> bytes:
        """The figure as PNG bytes."""
        return draw_png(self.draw, self.width, self.height)


def load_matplotlib() -> None:
    """Import matplotlib with its font list in the user's cache folder of tts2face.

    ``MPLCONFIGDIR`` is set during the import only; it is not changed if the caller set it or imported matplotlib.

    Raises
    ------
    BackendError
        matplotlib is not installed.
    """
    is_first = "matplotlib" not in sys.modules and "MPLCONFIGDIR" not in os.environ
    if is_first:
        os.environ["MPLCONFIGDIR"] = str(user_cache() / "matplotlib")
    try:
        import matplotlib.figure
        import matplotlib.style  # noqa: F401 - the import is the purpose
    except ImportError as missing:
        raise BackendError("plots need matplotlib, which is not installed; run: pip install 'tts2face[report]'") from (
            missing
        )
    finally:
        if is_first:
            del os.environ["MPLCONFIGDIR"]


@contextmanager
def open_figure(draw: Draw, width: float, height: float) -> Iterator[tuple["Figure", Sequence[Tip]]]:
    """A figure of a size in px and its tips, in the style of this module regardless of the user's matplotlib settings.

    The style applies inside the block; save the figure there.
    """
    load_matplotlib()
    from matplotlib import style
    from matplotlib.figure import Figure

    with style.context(["default", STYLE]):
        figure = Figure(figsize=(width / PX_PER_INCH, height / PX_PER_INCH), layout="constrained")
        yield figure, draw(figure) or ()


def draw_svg(draw: Draw, width: float, height: float, name: str) -> str:
    """A figure of a size in px as an SVG element; `name` is its accessible name."""
    file = BytesIO()
    with open_figure(draw, width, height) as (figure, tips):
        figure.savefig(
            file, format="svg", transparent=True, metadata=dict.fromkeys(("Date", "Creator", "Format", "Type"))
        )
    content = file.getvalue().decode()
    content = content[content.index(">", content.index("<svg")) + 1 : content.rindex("</svg>")]
    content = re.sub(r"\n\s+", "\n", content)
    content = re.sub(r"<[^>]+>", _shorten_tag, content)
    areas = "".join(_tip_area(tip, height) for tip in tips)
    return (
        f'<svg role="img" aria-label="{escape(name)}" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">{content}{areas}</svg>'
    )


def draw_svg_file(draw: Draw, width: float, height: float, name: str) -> bytes:
    """A figure of a size in px as an SVG file on white; `name` is its accessible name."""
    element = draw_svg(draw, width, height, name)
    for colour, variable in THEME.items():
        element = element.replace(variable, colour)
    head, _, content = element.partition(">")
    return (
        f'{head} xmlns="http://www.w3.org/2000/svg"><rect width="100%" height="100%" fill="white"/>{content}'.encode()
    )


def draw_png(draw: Draw, width: float, height: float) -> bytes:
    """A figure of a size in px as PNG bytes, `PNG_SCALE` pixels per px, on white."""
    file = BytesIO()
    with open_figure(draw, width, height) as (figure, _):
        figure.savefig(
            file, format="png", dpi=PNG_SCALE * PX_PER_INCH, metadata={"Software": None}, pil_kwargs={"optimize": True}
        )
    return file.getvalue()


def _shorten_tag(tag: re.Match[str]) -> str:
    """A tag without ids, which are not unique within a page, with the page's colours and numbers to 0.01 px."""
    content = re.sub(r'(?<=<g) id="[^"]*"| transform="rotate\(-0 [^"]*"', "", tag[0])
    content = re.sub(r"(\.\d\d)\d+(?=[ \n\")])", r"\1", content)
    content = content.replace("'DejaVu Sans'", "'DejaVu Sans', sans-serif")
    for colour, variable in THEME.items():
        content = content.replace(colour, variable)
    return content


def _tip_area(tip: Tip, height: float) -> str:
    """A transparent rectangle with a title, at least `LEAST_TIP` px wide and high."""
    corners = tip.axes.transData.transform([(tip.x, tip.y), (tip.x + tip.width, tip.y + tip.height)])
    middle, size = corners.mean(axis=0), np.maximum(np.abs(corners[1] - corners[0]), LEAST_TIP)
    left, top = middle[0] - size[0] / 2, height - middle[1] - size[1] / 2
    return (
        f'<rect class="tip" x="{left:.1f}" y="{top:.1f}" width="{size[0]:.1f}" height="{size[1]:.1f}">'
        f"<title>{escape(tip.text)}</title></rect>"
    )
