"""HTML page about recordings: kept and refused ones, reasons, and quality measures."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.limits import LIMITS, Limit
from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import Observations
from corpus_tools.studies.evaluation.page import label_phones
from corpus_tools.studies.pages import note_paragraph, page, paragraphs, picture_tag, table
from corpus_tools.studies.plots import FIRST, SECOND, draw_svg
from lexicon.errors import DataError, InputError
from lexicon.phones import ARPABET
from lexicon.sequence import SILENCE
from tts2face.models.landmarks import lip_opening
from tts2face.video.media import read_frames

if TYPE_CHECKING:
    from matplotlib.figure import Figure


THUMBNAIL_PX = 92
PX_PER_S, SIDES, HEIGHT = 260, 84, 124  # px: a second of the curves, both margins together, the height
TICK_S = 0.5
GAP_RANGE = (0.0, 0.35)  # of the eye distance: up to a mouth wide open in speech
DB_RANGE = (25.0, 85.0)
MEASURES = {
    "fit": ("fit of the words", "%", 100.0),
    "score": ("lowest face score", "", 1.0),
    "n_filled": ("interpolated frames", "", 1.0),
    "lag": ("audio delay, corrected", "ms", 1000.0),
    "clipped": ("clipped speech", "%", 100.0),
    "snr_db": ("signal-to-noise ratio", "dB", 1.0),
    "crowded": ("frames with several faces", "%", 100.0),
    "turn_deg": ("head turn", "degrees", 1.0),
    "frozen_s": ("frozen picture", "s", 1.0),
    "frame_rate": ("pictures", "a second", 1.0),
    "eye_px": ("distance of the outer eye corners", "px", 1.0),
    "jitter": ("jitter of the lip opening", "of its deviation", 1.0),
    "brightness": ("brightness of the face", "of 255", 1.0),
    "glare": ("overexposed part of the face", "%", 100.0),
    "contrast": ("contrast of the face", "of 255", 1.0),
    "sharpness": ("sharpness of the face", "detail over contrast", 1.0),
}


def recordings_page(name: str, found: Observations) -> str:
    """The page (HTML)."""
    pictures = thumbnails(found)
    return page(
        f"Recordings of {name}",
        [
            _summary(found),
            "<h2>Measures of the kept recordings</h2>",
            _measures(found.kept),
            "<h2>Phones spoken</h2>",
            _phones(found.kept),
            f"<h2>Warnings ({len(found.warnings)})</h2>",
            *(paragraphs(f"{warning.name}: {warning.message}") for warning in found.warnings),
            f"<h2>Refused ({len(found.refused)})</h2>",
            *(
                _item(refusal.name, f'<p class="bad">{escape(refusal.reason)}</p>', pictures.get(refusal.name))
                for refusal in found.refused
            ),
            f"<h2>Kept ({len(found.kept)})</h2>",
            note_paragraph("Blue: lip gap relative to the eye distance. Ochre: sound intensity, 25 to 85 dB."),
            *(_kept_item(observation, pictures.get(observation.name)) for observation in found.kept),
        ],
    )


def thumbnails(found: Observations) -> dict[str, NDArray[np.uint8]]:
    """A frame of each recording by name; recordings that cannot be read are missing."""
    wanted: dict[Path, list[tuple[float, str]]] = {}
    for observation in found.kept:
        middle = observation.quality.cut + len(observation.landmarks) / observation.fps / 2
        wanted.setdefault(observation.video, []).append((middle, observation.name))
    for refusal in found.refused:
        wanted.setdefault(refusal.video, []).append((refusal.at, refusal.name))
    return {
        name: picture for video, moments in wanted.items() for name, picture in _read_pictures(video, sorted(moments))
    }


def _read_pictures(video: Path, moments: Sequence[tuple[float, str]]) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    # the next one is last, where it is popped
    remaining = list(reversed(moments))
    try:
        for picture in read_frames(video):
            while remaining and picture.time >= remaining[-1][0]:
                yield remaining.pop()[1], picture.pixels
            if not remaining:
                return
    except (DataError, InputError):
        return  # a video that cannot be read has no frame; the list of refusals has its reason


def _summary(found: Observations) -> str:
    minutes = sum(len(observation.landmarks) / observation.fps for observation in found.kept) / 60
    recognised = sum(observation.is_recognised for observation in found.kept)
    lags = sorted({observation.quality.lag for observation in found.kept} - {0.0})
    lines = [f"{len(found.kept)} recordings kept, {minutes:.1f} minutes; {len(found.refused)} refused."]
    if found.kept:
        lines.append(f"Frames per second: {found.kept[0].fps:g}.")
    if recognised:
        lines.append(f"{recognised} have no transcript; their phones were recognised automatically and contain errors.")
    if lags:
        lines.append(f"Audio delays corrected: {', '.join(f'{1000 * lag:+.0f} ms' for lag in lags)}.")
    return paragraphs(*lines)


def _measures(kept: Sequence[Observation]) -> str:
    if not kept:
        return paragraphs("No recordings were kept.")
    limits = {limit.measure: limit for limit in LIMITS}
    rows = []
    for measure, (label, unit, factor) in MEASURES.items():
        values = factor * np.array([getattr(observation.quality, measure) for observation in kept], np.float64)
        limit = limits.get(measure)
        bound = "" if limit is None else _limit_text(limit, factor)
        rows.append((label, unit, *(f"{value:.3g}" for value in np.quantile(values, [0, 0.5, 1])), bound))
    return table(("measure", "unit", "lowest", "median", "highest", "limit"), rows, numbers=(2, 3, 4))


def _limit_text(limit: Limit, factor: float) -> str:
    side = "at least" if limit.is_minimum else "at most"
    return f"{side} {factor * limit.warning:g}, refused beyond {factor * limit.refusal:g}"


def _phones(kept: Iterable[Observation]) -> str:
    counts = Counter(phone for observation in kept for phone in observation.phones.phones if phone != SILENCE)
    spoken = ", ".join(f"{phone} {count}" for phone, count in counts.most_common()) or "none"
    missing = ", ".join(sorted({phone for phone in ARPABET.values() if phone not in counts})) or "none"
    return paragraphs(spoken, f"English phones that do not occur: {missing}")


def _kept_item(observation: Observation, picture: NDArray[np.uint8] | None) -> str:
    texts = []
    for measure, (label, unit, factor) in MEASURES.items():
        value = factor * getattr(observation.quality, measure)
        # 0 is a finding of these; of the others it says that nothing is wrong
        if measure in {"fit", "snr_db", "turn_deg"} or (value != 0 and measure != "score"):
            texts.append(f"{label} {value:.3g} {unit}".strip())
    how = " (phones recognised)" if observation.is_recognised else ""
    return _item(observation.name, note_paragraph("; ".join(texts) + how) + utterance_curves(observation), picture)


def _item(name: str, content: str, picture: NDArray[np.uint8] | None) -> str:
    image = picture_tag(picture, THUMBNAIL_PX) if picture is not None else ""
    return f'<section class="item"><div>{image}</div><div><b>{escape(name)}</b>{content}</div></section>'


def utterance_curves(observation: Observation) -> str:
    """Plot of lip gap and intensity over time, with words and phones above (SVG)."""
    times = np.arange(len(observation.landmarks)) / observation.fps
    width = len(times) / observation.fps * PX_PER_S + SIDES

    def draw(figure: "Figure") -> None:
        figure.set_layout_engine("none")
        axes = figure.add_axes((SIDES / 2 / width, 0.3, 1 - SIDES / width, 0.38))
        axes.plot(times, np.clip(lip_opening(observation.landmarks), *GAP_RANGE), color=FIRST)
        axes.set(xlim=(0, len(times) / observation.fps), ylim=GAP_RANGE, yticks=GAP_RANGE)
        axes.set_xticks(np.arange(0, len(times) / observation.fps, TICK_S))
        axes.set_xlabel("seconds", loc="left")
        axes.grid(visible=False)
        axes.set_ylabel("gap", color=FIRST)
        sound = axes.twinx()
        sound.plot(times, np.clip(observation.intensity, *DB_RANGE), color=SECOND)
        sound.set(ylim=DB_RANGE, yticks=DB_RANGE)
        sound.grid(visible=False)
        sound.set_ylabel("dB", color=SECOND)
        label_phones(axes, observation.phones, times[-1])
        edges = observation.phones.edges
        for word in observation.words:
            middle = (edges[word.first] + edges[word.last]) / 2
            axes.text(middle, 1.35, word.text, ha="center", transform=axes.get_xaxis_transform())

    return draw_svg(draw, width, HEIGHT, f"lips and sound of {observation.name}")
