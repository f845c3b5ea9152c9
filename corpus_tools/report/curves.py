"""Curves of one utterance over its phones and words, as a picture inside a page."""

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.training.train_talker import lip_gap
from lexicon.sequence import SILENCE

PX_PER_S = 260
HEIGHT, PLOT = 92, (14, 62)  # of the picture; top and bottom of the curves in it
WIDEST_GAP = 0.35  # of the eye distance: a mouth opened wide in speech
LEVELS_DB = (25.0, 85.0)


def utterance_curves(seen: Observation) -> str:
    """Opening of the lips and loudness over time, words above, phones below (SVG)."""
    seconds = len(seen.landmarks) / seen.fps
    times = np.arange(len(seen.landmarks)) / seen.fps
    low, high = LEVELS_DB
    parts = [
        _line(times, (seen.intensity - low) / (high - low), "var(--second)"),
        _line(times, lip_gap(seen.landmarks) / WIDEST_GAP, "var(--first)"),
        *_words(seen),
        *_phones(seen),
    ]
    width = round(seconds * PX_PER_S)
    return f'<svg width="{width}" height="{HEIGHT}" viewBox="0 0 {width} {HEIGHT}">{"".join(parts)}</svg>'


def _line(times: NDArray[np.floating], heights: NDArray[np.floating], colour: str) -> str:
    """A curve of heights from 0 to 1."""
    top, bottom = PLOT
    ys = bottom - np.clip(heights, 0.0, 1.0) * (bottom - top)
    places = " ".join(f"{x * PX_PER_S:.0f},{y:.1f}" for x, y in zip(times, ys, strict=True))
    return f'<polyline points="{places}" fill="none" stroke="{colour}" stroke-width="1.5"/>'


def _words(seen: Observation) -> Sequence[str]:
    edges = seen.phones.edges
    return [_text(edges[word.first], edges[word.last], 10, word.text) for word in seen.words]


def _phones(seen: Observation) -> Sequence[str]:
    made, edges = [], seen.phones.edges
    for label, begin, end in zip(seen.phones.phones, edges, edges[1:], strict=False):
        x = begin * PX_PER_S
        made.append(f'<path d="M{x:.0f} {PLOT[1]}V{HEIGHT}" stroke="var(--line)"/>')
        if label != SILENCE:
            made.append(_text(begin, end, HEIGHT - 10, label))
    return made


def _text(begin: float, end: float, y: int, text: str) -> str:
    return f'<text x="{(begin + end) / 2 * PX_PER_S:.0f}" y="{y}" text-anchor="middle">{escape(text)}</text>'
