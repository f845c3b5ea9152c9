"""The heat map with its dendrogram as a PNG."""

from functools import cache
from io import BytesIO
from itertools import pairwise
from typing import TYPE_CHECKING

from corpus_tools.report.plots import ticks
from corpus_tools.similarity.figure import TableFigure

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont

CELL, LETTER = 24, 14  # px
TREE, LABEL, HEAD, FOOT, MARGIN = 200, 74, 40, 62, 12  # px
LEGEND = (280, 14)
INK, SOFT, CUT = (29, 35, 41), (102, 112, 122), (184, 134, 11)
# Fonts of Linux, Windows and macOS that have the IPA letters; Pillow's own has not.
IPA_FONTS = ("DejaVuSans.ttf", "segoeui.ttf", "arial.ttf", "LucidaGrande.ttc", "Arial Unicode.ttf")


@cache
def ipa_font_name() -> str | None:
    """The first of `IPA_FONTS` on this machine, None where there is none."""
    from PIL import ImageFont

    for name in IPA_FONTS:
        try:
            ImageFont.truetype(name, LETTER)
        except OSError:
            continue
        return name
    return None


def table_png(figure: TableFigure) -> bytes:
    """The figure as PNG bytes; letters need `ipa_font_name` where labels are not ASCII."""
    from PIL import Image, ImageDraw

    n = len(figure.names)
    left = MARGIN + (TREE if figure.brackets else 0) + LABEL
    top = MARGIN + HEAD + LABEL
    width = left + max(n * CELL, LEGEND[0] + 300) + MARGIN
    image = Image.new("RGB", (width, top + n * CELL + FOOT), "white")
    pen = ImageDraw.Draw(image)
    font = _font(LETTER)
    pen.text((MARGIN, MARGIN), figure.title, INK, font=_font(LETTER + 5))
    _draw_cells(pen, figure, left, top)
    for at, name in enumerate(figure.names):
        middle = top + (at + 0.5) * CELL
        pen.text((left - 7, middle), name, INK, font=font, anchor="rm")
        _upright(image, name, left + round((at + 0.5) * CELL), top - 7)
    _draw_tree(pen, figure, top)
    _draw_legend(pen, figure, left, top + n * CELL + 16)
    file = BytesIO()
    image.save(file, "PNG", optimize=True)
    return file.getvalue()


def _font(size: int) -> "FreeTypeFont":
    from PIL import ImageFont

    name = ipa_font_name()
    if name is not None:
        return ImageFont.truetype(name, size)
    return ImageFont.load_default(size)  # type: ignore[return-value]


def _upright(image: "Image", name: str, x: int, bottom: int) -> None:
    """Draw a word that reads from below to above, centred on x."""
    from PIL import Image, ImageDraw

    strip = Image.new("RGB", (LABEL - 8, CELL - 4), "white")
    ImageDraw.Draw(strip).text((0, strip.height / 2), name, INK, font=_font(LETTER), anchor="lm")
    turned = strip.transpose(Image.Transpose.ROTATE_90)
    image.paste(turned, (x - turned.width // 2, bottom - turned.height))


def _draw_cells(pen: "ImageDraw", figure: TableFigure, left: int, top: int) -> None:
    for i in range(len(figure.names)):
        for j in range(len(figure.names)):
            x, y = left + j * CELL, top + i * CELL
            pen.rectangle((x, y, x + CELL - 1, y + CELL - 1), fill=figure.ramp.colour(figure.values[i, j]))
    for first, last in pairwise(figure.blocks):
        a, b = first * CELL, last * CELL - 1
        pen.rectangle((left + a, top + a, left + b, top + b), outline="white", width=2)


def _draw_tree(pen: "ImageDraw", figure: TableFigure, top: int) -> None:
    if not figure.brackets:
        return
    highest = figure.brackets[-1].height * 1.04
    foot = top + len(figure.names) * CELL

    def x(height: float) -> float:
        return MARGIN + TREE - 6 - height / highest * (TREE - 12)

    for bracket in figure.brackets:
        (a, b), (at_a, at_b) = bracket.rows, bracket.heights
        corner, low, high = x(bracket.height), top + a * CELL, top + b * CELL
        pen.line([(x(at_a), low), (corner, low), (corner, high), (x(at_b), high)], fill=INK, width=2)
    if figure.cut is not None:
        for y in range(top, foot, 11):
            pen.line([(x(figure.cut), y), (x(figure.cut), min(y + 6, foot))], fill=CUT, width=2)
    pen.line([(x(highest), foot + 5), (x(0.0), foot + 5)], fill=SOFT)
    for value in ticks(0.0, highest):
        pen.line([(x(value), foot + 5), (x(value), foot + 10)], fill=SOFT)
        pen.text((x(value), foot + 21), f"{value:g}", INK, font=_font(LETTER - 2), anchor="mm")
    pen.text((MARGIN + TREE / 2, foot + 42), "1 - similarity", INK, font=_font(LETTER), anchor="mm")


def _draw_legend(pen: "ImageDraw", figure: TableFigure, left: int, top: int) -> None:
    width, high = LEGEND
    ramp = figure.ramp
    pen.text((left + width + 14, top + high / 2), figure.scale, INK, font=_font(LETTER), anchor="lm")
    for at in range(width):
        pen.line(
            [(left + at, top), (left + at, top + high)],
            fill=ramp.colour(ramp.low + (at + 0.5) / width * (ramp.high - ramp.low)),
        )
    for value in ticks(ramp.low, ramp.high):
        place = left + (value - ramp.low) / (ramp.high - ramp.low) * width
        pen.text((place, top + high + 11), f"{value:g}", INK, font=_font(LETTER - 2), anchor="mm")
