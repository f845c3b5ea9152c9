"""Building blocks of self-contained HTML pages, and the choice of a report's format by its suffix.

Short videos in a page: the recording beside the default head with the synthesised motion.
"""

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.reference import ReferenceUtterance
from corpus_tools.studies.evaluation.evaluate import SplitResult
from corpus_tools.studies.plots import load_matplotlib
from lexicon.errors import DataError, InputError
from tts2face.lips.retargeting import build_retargeter
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.talker import speech_channels
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, mesh_renderer
from tts2face.storage.output_paths import check_name
from tts2face.types import Trajectory
from tts2face.video.media import read_frames

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


Writer = TypeVar("Writer")
PLOT_SUFFIXES = (".html", ".png", ".svg")  # kinds of file that hold plots


def report_writer(out: Path, writers: Mapping[str, Writer]) -> Writer:
    """The writer for a file's suffix; checks the path before the analysis starts.

    Raises
    ------
    InputError
        There is no writer for the suffix; or as `check_name`.
    BackendError
        The format contains plots and matplotlib is not installed; or as `check_name`.
    """
    suffix = out.suffix.lower()
    if suffix not in writers:
        raise InputError(f"a report is written as {', '.join(writers)}, not {out.name}")
    check_name(out)
    if suffix in PLOT_SUFFIXES:
        load_matplotlib()
    return writers[suffix]


SIDE_PX = 240
SETTINGS = {"crf": "26", "preset": "veryfast"}  # about 100 kB per sentence
NOTE = "Left: the recording; right: {method} on the default head. No sound."


class MethodVideos:
    """Videos of the motion synthesised by one method; the head is loaded on first use."""

    def __init__(self, method: str) -> None:
        """Videos of the motion synthesised by `method`."""
        self._method = method

    @cached_property
    def _face(self) -> Face:
        return load_face("head")

    @cached_property
    def _renderer(self) -> MeshRenderer:
        return mesh_renderer(self._face, Picture(size=f"{SIDE_PX}x{SIDE_PX}", camera="close"))

    def render_tag(self, run: SplitResult, at: int) -> str:
        """Video of one utterance (HTML); empty if the recording is missing or too short."""
        one = run.real[at]
        observation = list(evaluated_pictures(one))
        if len(observation) < one.evaluated.stop - one.evaluated.start:
            return ""
        speech = Trajectory(speech_channels(run.model), run.synthesised[self._method][at], one.observation.fps)
        weights = build_retargeter(run.talker, self._face).retarget(speech).values
        sides = [
            np.concatenate([letterbox(pixels), self._renderer.draw(row)], axis=1)
            for pixels, row in zip(observation, weights[one.evaluated], strict=False)
        ]
        return video_tag(sides, one.observation.fps, NOTE.format(method=self._method))


def evaluated_pictures(one: ReferenceUtterance) -> Iterator[NDArray[np.uint8]]:
    """The pictures of an utterance's evaluated frames; fewer if the video cannot be read."""
    observation = one.observation
    instants = observation.quality.cut + (np.arange(one.evaluated.start, one.evaluated.stop) - 0.5) / observation.fps
    at = 0
    try:
        for picture in read_frames(observation.video):
            while at < len(instants) and picture.time >= instants[at]:
                yield picture.pixels
                at += 1
            if at == len(instants):
                return
    except (DataError, InputError):
        return  # the video was removed after the evaluation; the page shows its curves only


def letterbox(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """An (H, W, 3) picture scaled to fit a black square of `SIDE_PX`."""
    from PIL import Image

    shown = Image.fromarray(pixels)
    shown.thumbnail((SIDE_PX, SIDE_PX))
    square = Image.new("RGB", (SIDE_PX, SIDE_PX))
    square.paste(shown, ((SIDE_PX - shown.width) // 2, (SIDE_PX - shown.height) // 2))
    return np.asarray(square)


def video_tag(pictures: Sequence[NDArray[np.uint8]], fps: float, text: str) -> str:
    """A silent looping video embedded in the page, with a note below it."""
    import av

    height, width = pictures[0].shape[:2]
    content = BytesIO()
    with av.open(content, "w", format="mp4") as container:
        stream: Any = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1001), options=SETTINGS)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for pixels in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))
        container.mux(stream.encode())
    data = b64encode(content.getvalue()).decode()
    return (
        f'<video autoplay loop muted playsinline controls width="{width}" height="{height}" '
        f'src="data:video/mp4;base64,{data}"></video>\n{note_paragraph(text)}'
    )
