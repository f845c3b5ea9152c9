"""Speaking rate and level of a voice under a style of gestures."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType

from lexicon.marked_text import StyleRun
from lexicon.sentences import Phrase
from tts2face.gesture.notation import parse_style
from tts2face.models.palette import FEATURES, PLAIN, Delivery
from tts2face.request import Request

Deliveries = Mapping[str, Delivery]  # of a palette's styles, by name
NO_DELIVERIES: Deliveries = MappingProxyType({})


def delivery_of(part: Phrase, runs: Sequence[StyleRun], request: Request, deliveries: Deliveries) -> Delivery:
    """Delivery of a phrase: that of the style of most of its letters, if the style is one of the whole face.

    A rate or volume that the request or a mark sets replaces that of the style.
    """
    if request.plain_delivery:
        return PLAIN
    found = deliveries.get(_whole_style(request.style, _longest_run(part, runs).styles), PLAIN)
    has_volume = request.volume != 1.0 or any(run.volume != 1.0 for run in runs)
    return Delivery(
        1.0 if request.rate != 1.0 or part.rate != 1.0 else found.rate, 0.0 if has_volume else found.level_db
    )


def _longest_run(part: Phrase, runs: Sequence[StyleRun]) -> StyleRun:
    """The run with most letters of a phrase; the first of equal ones."""
    ends = [*(run.start for run in runs[1:]), part.last]
    lengths = [min(end, part.last) - max(run.start, part.first) for run, end in zip(runs, ends, strict=True)]
    return runs[lengths.index(max(lengths))]


@lru_cache(maxsize=1000)
def _whole_style(base: str | None, nested: tuple[str, ...]) -> str:
    """Name of the style that all features have; empty if they differ or have none."""
    chosen: dict[str, str] = {}
    for written in ([base] if base is not None else []) + list(nested):
        chosen |= parse_style(written)
    names = {chosen.get(feature, "") for feature in FEATURES}
    return names.pop() if len(names) == 1 else ""
