"""A page about recordings: what was kept, what was refused and why, and how good each one is."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.limits import LIMITS
from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import Observations, Refusal
from corpus_tools.report.curves import utterance_curves
from corpus_tools.report.page import page, picture_tag, table
from lexicon.errors import DataError, InputError
from lexicon.phones import ARPABET
from lexicon.sequence import SILENCE
from tts2face.video.media import read_pictures

THUMBNAIL_PX = 92
MEASURES = {
    "confidence": ("fit of the words", "log likelihood / s", 1.0),
    "score": ("least face score", "", 1.0),
    "n_filled": ("frames filled in", "", 1.0),
    "lag": ("sound late by, taken out", "ms", 1000.0),
    "clipped": ("clipped speech", "%", 100.0),
    "snr_db": ("speech over noise", "dB", 1.0),
    "crowded": ("pictures with more faces", "%", 100.0),
    "turn_deg": ("face turned away", "degrees", 1.0),
    "frozen_s": ("picture stood still", "s", 1.0),
}


def recordings_page(name: str, found: Observations) -> str:
    """The page (HTML)."""
    pictures = thumbnails(found)
    return page(
        f"Recordings of {name}",
        [
            _summary(found),
            "<h2>Measures of what was kept</h2>",
            _measures(found.kept),
            "<h2>Phones spoken</h2>",
            _phones(found.kept),
            f"<h2>Refused ({len(found.refused)})</h2>",
            *(_refused(refusal, pictures.get(refusal.name)) for refusal in found.refused),
            f"<h2>Kept ({len(found.kept)})</h2>",
            '<p class="soft">Blue: gap of the lips over the distance of the eyes. Ochre: loudness.</p>',
            *(_kept(seen, pictures.get(seen.name)) for seen in found.kept),
        ],
    )


def thumbnails(found: Observations) -> dict[str, NDArray[np.uint8]]:
    """A picture of each recording by its name, none of those that cannot be read."""
    wanted: dict[Path, list[tuple[float, str]]] = {}
    for seen in found.kept:
        middle = seen.quality.cut + len(seen.landmarks) / seen.fps / 2
        wanted.setdefault(seen.video, []).append((middle, seen.name))
    for refusal in found.refused:
        wanted.setdefault(refusal.video, []).append((refusal.at, refusal.name))
    return {name: picture for video, moments in wanted.items() for name, picture in _at(video, sorted(moments))}


def _at(video: Path, moments: Sequence[tuple[float, str]]) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    waiting = list(reversed(moments))
    try:
        for picture in read_pictures(video):
            while waiting and picture.time >= waiting[-1][0]:
                yield waiting.pop()[1], picture.pixels
            if not waiting:
                return
    except (DataError, InputError):
        return  # what cannot be read has no picture; its refusal stands in the list


def _summary(found: Observations) -> str:
    minutes = sum(len(seen.landmarks) / seen.fps for seen in found.kept) / 60
    recognised = sum(seen.is_recognised for seen in found.kept)
    lags = sorted({seen.quality.lag for seen in found.kept} - {0.0})
    lines = [f"{len(found.kept)} recordings kept, {minutes:.1f} minutes; {len(found.refused)} refused."]
    if found.kept:
        lines.append(f"Frames per second: {found.kept[0].fps:g}.")
    if recognised:
        lines.append(f"{recognised} have no transcript: their phones were recognised, and some are wrong.")
    if lags:
        lines.append(f"Sound and picture were put together: {', '.join(f'{1000 * lag:+.0f} ms' for lag in lags)}.")
    return "\n".join(f"<p>{escape(line)}</p>" for line in lines)


def _measures(kept: Sequence[Observation]) -> str:
    if not kept:
        return "<p>Nothing was kept.</p>"
    limits = {limit.measure: limit for limit in LIMITS}
    rows = []
    for measure, (label, unit, factor) in MEASURES.items():
        values = factor * np.array([getattr(seen.quality, measure) for seen in kept], np.float64)
        limit = limits.get(measure)
        bound = "" if limit is None else f"{'at least' if limit.is_least else 'at most'} {factor * limit.bound:g}"
        rows.append((label, unit, *(f"{value:.3g}" for value in np.quantile(values, [0, 0.5, 1])), bound))
    return table(("measure", "unit", "lowest", "median", "highest", "limit"), rows, numbers=(2, 3, 4))


def _phones(kept: Iterable[Observation]) -> str:
    counts = Counter(phone for seen in kept for phone in seen.phones.phones if phone != SILENCE)
    spoken = ", ".join(f"{phone} {count}" for phone, count in counts.most_common()) or "none"
    missing = ", ".join(sorted({phone for phone in ARPABET.values() if phone not in counts})) or "none"
    return f"<p>{escape(spoken)}</p>\n<p>English phones never spoken: {escape(missing)}</p>"


def _refused(refusal: Refusal, picture: NDArray[np.uint8] | None) -> str:
    return _item(refusal.name, f'<p class="bad">{escape(refusal.reason)}</p>', picture)


def _kept(seen: Observation, picture: NDArray[np.uint8] | None) -> str:
    texts = []
    for measure, (label, unit, factor) in MEASURES.items():
        value = factor * getattr(seen.quality, measure)
        if measure in {"confidence", "snr_db", "turn_deg"} or (value != 0 and measure != "score"):
            texts.append(f"{label} {value:.3g} {unit}".strip())
    how = " (phones recognised)" if seen.is_recognised else ""
    about = f'<p class="soft">{escape("; ".join(texts))}{how}</p>'
    return _item(seen.name, about + utterance_curves(seen), picture)


def _item(name: str, content: str, picture: NDArray[np.uint8] | None) -> str:
    image = picture_tag(picture, THUMBNAIL_PX) if picture is not None else ""
    return f'<section class="item"><div>{image}</div><div><b>{escape(name)}</b>{content}</div></section>'
