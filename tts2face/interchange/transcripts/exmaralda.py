"""Transcriptions of EXMARaLDA (``.exb``): tiers of events on one timeline, of which not all places have a time.

Source: basic-transcription.dtd of EXMARaLDA 1.6.
"""

from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.transcripts.annotation_xml import read_xml
from tts2face.interchange.transcripts.slots import interpolated
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

TRANSCRIPTION = "t"  # type of a tier of words; others describe and annotate


def read_exb(path: Path) -> list[Tier]:
    """Tiers of a basic transcription."""
    root = read_xml(path, "basic-transcription", "EXMARaLDA")
    places = list(root.iterfind("basic-body/common-timeline/tli"))
    try:
        known = [None if (time := place.get("time")) in {None, ""} else float(time or 0) for place in places]
    except ValueError as wrong:
        raise DataError(f"{path} has a time that is no number ({wrong}); correct it") from wrong
    times = {place.get("id", ""): time for place, time in zip(places, interpolated(known), strict=True)}
    n_unknown = known.count(None)
    note = f"{n_unknown} times that {path.name} lacks are interpolated between others"
    tiers = []
    for tier in root.iterfind("basic-body/tier"):
        events = [
            SpokenCue(times[start], max(times[start], times[end]), "".join(event.itertext()).strip())
            for event in tier.iterfind("event")
            if (start := event.get("start", "")) in times and (end := event.get("end", "")) in times
        ]
        name = tier.get("display-name") or tier.get("id") or ""
        kind = "transcript" if tier.get("type") == TRANSCRIPTION else "notes"
        tiers.append(Tier(name, tuple(events), kind=kind, notes=(note,) if n_unknown else ()))
    return tiers
