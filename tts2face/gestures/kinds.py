"""Kinds of elements of a timeline, in one table, and what a timeline does with the elements of a kind."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Literal

from lexicon.errors import InputError
from tts2face.gestures.elements import (
    ChannelEdit,
    ExpressionCurve,
    ExpressionSpan,
    GazeTarget,
    Gesture,
    ListeningSpan,
    StrengthCurve,
    StyleSpan,
)

MAX_OVERRUN_S = 0.05  # tolerance for spans that end after the clip: times are often rounded to tenths of a second


class BeyondClipError(InputError):
    """An element lies beyond the end of a clip of `duration` seconds."""

    def __init__(self, what: str, duration: float, advice: str) -> None:
        self.duration = duration
        super().__init__(f"{what} lies beyond the clip, which lasts {duration:.2f} s; {advice}")


@dataclass(frozen=True, slots=True)
class ElementKind:
    """One kind of element of a timeline, and what is done with all elements of this kind.

    A new kind:

    1. A record in `tts2face.gestures.elements` with ``start`` and ``end``, ``keys`` or ``time``, and its checks.
    2. A row of `KINDS`, and a field of `Timeline` of its name; files and merging follow.
    3. What it does to a feature, in `Timeline` or the streams that read it.

    Parameters
    ----------
    name
        Field of the timeline, and key in its files.
    record
        Class of the elements. Spans have ``start`` and ``end``, curves ``keys``, and instants a ``time``.
    owner
        Field that divides lanes: spans of one lane may not overlap, and each lane has one curve. Empty where all
        elements are in one lane.
    noun
        What messages call an element, or all of them, where lanes have no names.
    """

    name: str
    record: type[Any]
    shape: Literal["span", "curve", "instant"]
    owner: str
    noun: str = ""

    def lane(self, element: Any) -> str:
        """Lane of an element as messages name it."""
        return str(getattr(element, self.owner)) if self.owner else self.noun

    def ordered(self, elements: Iterable[Any]) -> tuple[Any, ...]:
        """Elements in order of time; curves as they are."""
        if self.shape == "instant":
            return tuple(sorted(elements, key=lambda instant: instant.time))
        if self.shape == "span":
            elements = sorted(elements, key=lambda span: (span.start, span.end))
        found, lanes = tuple(elements), dict[str, list[Any]]()
        for element in found:
            lanes.setdefault(self.lane(element), []).append(element)
        for lane, members in lanes.items():
            if self.shape == "curve" and len(members) > 1:
                # two curves of one lane would have to be added or chosen between
                raise InputError(f"{lane} has {len(members)} curves of one kind; join their keys in one curve")
            for before, after in pairwise(members):
                if after.start < before.end:
                    raise InputError(
                        f"two spans of {lane} overlap: {_span_text(before, '-')} and {_span_text(after, '-')}; "
                        "let one end before the other begins"
                    )
        return found

    def merged(self, under: Sequence[Any], over: Sequence[Any]) -> tuple[Any, ...]:
        """Elements of two timelines: spans `over` replace those `under` where they overlap, curves those of a lane."""
        kept = list(under)
        for top in over if self.shape != "instant" else ():
            lane = [element for element in kept if self.lane(element) == self.lane(top)]
            kept = [element for element in kept if self.lane(element) != self.lane(top)]
            if self.shape == "span":
                kept += [*self.restricted(lane, -1.0, top.start), *self.restricted(lane, top.end, math.inf)]
        return (*kept, *over)

    def shifted(self, elements: Sequence[Any], seconds: float, *, holds_start: bool = False) -> tuple[Any, ...]:
        """The same elements, so many seconds later; with `holds_start`, spans from 0 s on still begin there."""
        if self.shape == "curve":
            return tuple(
                replace(element, keys=tuple((at + seconds, to) for at, to in element.keys)) for element in elements
            )
        times = ("start", "end") if self.shape == "span" else ("time",)
        later = [{name: getattr(element, name) + seconds for name in times} for element in elements]
        if holds_start:
            later = [given | {"start": 0.0} if given.get("start") == seconds else given for given in later]
        return tuple(replace(element, **given) for element, given in zip(elements, later, strict=True))

    def restricted(self, elements: Sequence[Any], start: float, end: float) -> tuple[Any, ...]:
        """The part of some elements in [start, end): parts of spans, and whole curves."""
        if self.shape == "curve":
            return tuple(elements)
        if self.shape == "instant":
            return tuple(element for element in elements if start <= element.time < end)
        return tuple(
            replace(element, start=max(element.start, start), end=min(element.end, end))
            for element in elements
            if element.start < end and element.end > start
        )

    def check_duration(self, elements: Sequence[Any], duration: float) -> None:
        """Refuse spans and instants beyond a clip of `duration` seconds.

        Raises
        ------
        BeyondClipError
            One lies there.
        """
        for element in elements:
            if self.latest_s(element) < duration:
                continue
            if self.shape == "span":
                what = f"the span of {self.lane(element)} from {_span_text(element, ' to ')}"
                raise BeyondClipError(
                    what, duration, "shorten it" if element.start < duration else "let it begin earlier"
                )
            what = f"the {self.lane(element).replace('_', ' ')} at {element.time:g} s"
            raise BeyondClipError(what, duration, "move it")

    def latest_s(self, element: Any) -> float:
        """Second that a clip must go beyond to hold an element; below 0 for a curve, which any clip holds."""
        if self.shape == "curve":
            return -1.0
        if self.shape == "instant":
            return float(element.time)
        return float(element.start if math.isinf(element.end) else max(element.start, element.end - MAX_OVERRUN_S))


KINDS: Mapping[str, ElementKind] = MappingProxyType({
    kind.name: kind
    for kind in (
        ElementKind("spans", StyleSpan, "span", "feature"),
        ElementKind("expressions", ExpressionSpan, "span", "expression"),
        ElementKind("gaze", GazeTarget, "span", "", "the gaze"),
        ElementKind("listens", ListeningSpan, "span", "", "listening"),
        ElementKind("gestures", Gesture, "instant", "name", "gesture"),
        ElementKind("strengths", StrengthCurve, "curve", "feature"),
        ElementKind("curves", ExpressionCurve, "curve", "expression"),
        ElementKind("edits", ChannelEdit, "curve", "channel"),
    )
})  # fmt: skip


def _span_text(span: Any, between: str) -> str:
    """Seconds of a span in a message."""
    return f"{span.start:g} s to the end" if math.isinf(span.end) else f"{span.start:g}{between}{span.end:g} s"
