"""Building blocks of self-contained HTML pages."""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

STYLE = """
:root { color-scheme: light dark; --ink: #1d2329; --soft: #66707a; --line: #d5dae0; --paper: #fff;
  --first: #0b6cb0; --second: #b8860b; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ec; --soft: #9aa4ae; --line: #3b434b; --paper: #15191d;
  --first: #5ab0f0; --second: #e0b050; --bad: #ff8a80; } }
body { font: 15px/1.45 system-ui, sans-serif; color: var(--ink); background: var(--paper); margin: 2rem auto;
  max-width: 75rem; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
table { border-collapse: collapse; } td, th { padding: .25rem .8rem .25rem 0; text-align: left; vertical-align: top;
  border-bottom: 1px solid var(--line); } td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
section.item { display: flex; gap: 1rem; padding: .6rem 0; border-top: 1px solid var(--line); }
section.item > div { overflow-x: auto; } section.item > div:first-child { flex: none; }
p { margin: .2rem 0; } .soft { color: var(--soft); } .bad { color: var(--bad); }
img { border-radius: 4px; } .wide { overflow-x: auto; }
svg .tip { fill: transparent; } svg .tip:hover { stroke: var(--ink); stroke-width: 1.5px; }
""".strip()


def page(title: str, parts: Iterable[str]) -> str:
    """A complete page; the parts are HTML already."""
    body = "\n".join(parts)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{escape(title)}</title>\n'
        f'<meta name="viewport" content="width=device-width">\n<style>\n{STYLE}\n</style>\n</head>\n'
        f"<body>\n<h1>{escape(title)}</h1>\n{body}\n</body>\n</html>\n"
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Iterable[int] = ()) -> str:
    """A table of strings; the columns in `numbers` are aligned to the right."""
    right = set(numbers)

    def row(cells: Sequence[str], tag: str) -> str:
        row = (f"<{tag}{' class=n' if at in right else ''}>{escape(cell)}</{tag}>" for at, cell in enumerate(cells))
        return f"<tr>{''.join(row)}</tr>"

    return "\n".join(["<table>", row(head, "th"), *(row(cells, "td") for cells in rows), "</table>"])


def paragraphs(*sentences: str) -> str:
    """One paragraph for each sentence."""
    return "\n".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)


def note_paragraph(sentence: str) -> str:
    """A paragraph in a softer colour."""
    return f'<p class="soft">{escape(sentence)}</p>'


def scroll_box(element: str) -> str:
    """An element that scrolls horizontally in narrow windows."""
    return f'<div class="wide">{element}</div>'


def picture_tag(pixels: NDArray[np.uint8], height: int) -> str:
    """An (H, W, 3) sRGB picture as a JPEG of at most `height` px inside the page."""
    from PIL import Image

    shown = Image.fromarray(pixels)
    shown.thumbnail((4 * height, height))
    jpeg = BytesIO()
    shown.save(jpeg, "JPEG", quality=75)
    data = b64encode(jpeg.getvalue()).decode()
    return f'<img alt="" width="{shown.width}" height="{shown.height}" src="data:image/jpeg;base64,{data}">'
