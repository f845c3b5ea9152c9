"""Annotations of ELAN (``.eaf``): tiers with times, parts of annotations of other tiers, slots without a time.

Source: EAF Annotation Format Schema 3.0, Max Planck Institute for Psycholinguistics.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

from lexicon.errors import DataError
from tts2face.interchange.transcripts.annotation_xml import read_xml
from tts2face.interchange.transcripts.slots import interpolated
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier
from tts2face.interchange.transcripts.utterances import share_time

UNIT_S = {"milliseconds": 0.001, "PAL-frames": 0.04, "NTSC-frames": 1001 / 30_000}  # of TIME_UNITS


@dataclass(slots=True)
class _Annotations:
    """Spans in seconds by ids of annotations, as far as they are known, and what is still to be placed."""

    spans: dict[str, tuple[float, float]] = field(default_factory=dict)
    values: dict[str, str] = field(default_factory=dict)


def read_eaf(path: Path) -> list[Tier]:
    """Tiers of an ELAN file on the time of its recording."""
    document = read_xml(path, "ANNOTATION_DOCUMENT", "ELAN")
    header = document.find("HEADER")
    unit = UNIT_S.get(header.get("TIME_UNITS", "milliseconds") if header is not None else "milliseconds", 0.001)
    slots = {
        slot.get("TIME_SLOT_ID", ""): None if (value := slot.get("TIME_VALUE")) is None else _number(path, value) * unit
        for slot in document.iterfind("TIME_ORDER/TIME_SLOT")
    }
    shift, moved = _media_shift(path, document)
    found = _Annotations()
    tiers = list(document.iterfind("TIER"))
    notes = {id(tier): [moved] if moved else [] for tier in tiers}
    for tier in tiers:
        n_interpolated = _place_aligned(tier, slots, found)
        if n_interpolated:
            notes[id(tier)].append(f"{n_interpolated} times that {path.name} lacks are interpolated between others")
    _place_parts(path, tiers, found, notes)
    made = []
    for tier in tiers:
        labels = [
            SpokenCue(found.spans[label][0] + shift, found.spans[label][1] + shift, found.values[label])
            for label in _ids(tier)
            if label in found.spans
        ]
        labels.sort(key=lambda cue: cue.start)
        name, kind = tier.get("TIER_ID", ""), tier.get("LINGUISTIC_TYPE_REF", "")
        parent = tier.get("PARENT_REF", "")
        made.append(Tier(name, tuple(labels), kind=kind, parent=parent, notes=tuple(notes[id(tier)])))
    return made


def _number(path: Path, written: str) -> float:
    try:
        return float(written)
    except ValueError as wrong:
        raise DataError(f"{path} has the time {written[:40]!r}, which is no number; correct it") from wrong


def _media_shift(path: Path, document: Element) -> tuple[float, str]:
    """Seconds from the time of annotations to that of the recording, and a sentence where they differ."""
    media = list(document.iterfind("HEADER/MEDIA_DESCRIPTOR"))
    names = [Path(medium.get("RELATIVE_MEDIA_URL") or medium.get("MEDIA_URL") or "").stem for medium in media]
    own = [medium for medium, name in zip(media, names, strict=True) if name == path.stem] or media[:1]
    shift = _number(path, own[0].get("TIME_ORIGIN", "0")) / 1000 if own else 0.0
    return shift, f"times of {path.name} are moved by {shift:g} s, the offset of its recording in ELAN" if shift else ""


def _ids(tier: Element) -> Iterable[str]:
    for kind in ("ALIGNABLE_ANNOTATION", "REF_ANNOTATION"):
        for annotation in tier.iterfind(f"ANNOTATION/{kind}"):
            yield annotation.get("ANNOTATION_ID", "")


def _value(annotation: Element) -> str:
    return (annotation.findtext("ANNOTATION_VALUE") or "").strip()


def _place_aligned(tier: Element, slots: dict[str, float | None], found: _Annotations) -> int:
    """Place the annotations that have slots; the number of slots that have no time."""
    annotations = list(tier.iterfind("ANNOTATION/ALIGNABLE_ANNOTATION"))
    chain: list[str] = []
    places: dict[str, int] = {}
    for annotation in annotations:
        for slot in (annotation.get("TIME_SLOT_REF1", ""), annotation.get("TIME_SLOT_REF2", "")):
            is_start = slot == annotation.get("TIME_SLOT_REF1")
            # two slots without a time, one behind the other, are one edge of neighbours
            is_same_edge = is_start and chain and slots.get(slot) is None and slots.get(chain[-1]) is None
            if not (chain and (chain[-1] == slot or is_same_edge)):
                chain.append(slot)
            places[slot] = len(chain) - 1
    times = interpolated([slots.get(slot) for slot in chain])
    for annotation in annotations:
        name = annotation.get("ANNOTATION_ID", "")
        first, last = (places[annotation.get(f"TIME_SLOT_REF{end}", "")] for end in (1, 2))
        found.spans[name] = times[first], max(times[first], times[last])
        found.values[name] = _value(annotation)
    return sum(slots.get(slot) is None for slot in chain)


def _place_parts(path: Path, tiers: list[Element], found: _Annotations, notes: dict[int, list[str]]) -> None:
    """Place the annotations that are parts of others: several of one share its time."""
    waiting = {id(tier): list(tier.iterfind("ANNOTATION/REF_ANNOTATION")) for tier in tiers}
    # parts of parts need as many rounds as there are levels
    for _ in tiers:
        for tier in tiers:
            ready = [part for part in waiting[id(tier)] if part.get("ANNOTATION_REF", "") in found.spans]
            waiting[id(tier)] = [
                part for part in waiting[id(tier)] if part.get("ANNOTATION_REF", "") not in found.spans
            ]
            n_shared = _share(_by_parent(ready), found)
            if n_shared:
                notes[id(tier)].append(
                    f"words of {n_shared} utterances in {path.name} have no times of their own and share theirs by "
                    "nominal lengths"
                )


def _by_parent(parts: Iterable[Element]) -> dict[str, list[Element]]:
    """Parts by the annotation to which they belong, in the order in which they follow each other."""
    groups: dict[str, list[Element]] = {}
    for part in parts:
        groups.setdefault(part.get("ANNOTATION_REF", ""), []).append(part)
    for parent, group in groups.items():
        following = {part.get("PREVIOUS_ANNOTATION", ""): part for part in group}
        ordered: list[Element] = []
        at = following.get("")
        while at is not None and len(ordered) < len(group):
            ordered.append(at)
            at = following.get(at.get("ANNOTATION_ID", ""))
        # several without a predecessor stand in the order of the file
        groups[parent] = ordered if len(ordered) == len(group) else group
    return groups


def _share(groups: dict[str, list[Element]], found: _Annotations) -> int:
    """Place parts; the number of annotations that have several."""
    for parent, group in groups.items():
        texts = [_value(part) for part in group]
        for part, span in zip(group, share_time(*found.spans[parent], texts), strict=True):
            found.spans[part.get("ANNOTATION_ID", "")] = span
            found.values[part.get("ANNOTATION_ID", "")] = _value(part)
    return sum(len(group) > 1 for group in groups.values())
