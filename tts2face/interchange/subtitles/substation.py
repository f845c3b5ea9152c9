"""SubStation Alpha: ASS and SSA."""

import re
from collections.abc import Mapping, Sequence

from tts2face.interchange.subtitles.clock import parse_clock
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue

ASS_FIELDS: tuple[str, ...] = (
    "layer",
    "start",
    "end",
    "style",
    "name",
    "marginl",
    "marginr",
    "marginv",
    "effect",
    "text",
)
SSA_FIELDS: tuple[str, ...] = ("marked", *ASS_FIELDS[1:])
_SECTION = re.compile(r"\s*\[([^\]]+)\]\s*$")
_DRAWING = re.compile(r"\\p[1-9]")  # a text in drawing mode holds coordinates, no words
_LINE_BREAK = re.compile(r"\\[Nn]")


def read_substation(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of the dialogue lines; comments, drawings and all other sections are left out."""
    cues: list[WrittenCue] = []
    warnings: list[SubtitleWarning] = []
    section, fields = "", ASS_FIELDS
    for number, line in enumerate(lines, start=1):
        heading = _SECTION.match(line)
        if heading:
            section = heading[1].strip().lower()
            if section in {"v4 styles", "v4+ styles"}:
                # a file without a Format line has the fields of its version
                fields = SSA_FIELDS if section == "v4 styles" else ASS_FIELDS
            continue
        kind, colon, rest = line.strip().partition(":")
        if not colon:
            continue
        if kind.lower() == "format" and section == "events":
            fields = _format_fields(rest, number, warnings) or fields
        elif kind.lower() == "dialogue":
            cue = _dialogue(rest, fields, number, warnings)
            if cue is not None:
                cues.append(cue)
    return cues, warnings


def _format_fields(written: str, number: int, warnings: list[SubtitleWarning]) -> tuple[str, ...] | None:
    fields = tuple("name" if cell.strip().lower() == "actor" else cell.strip().lower() for cell in written.split(","))
    # the text is the last field, as it may contain commas
    if {"start", "end", "text"} <= set(fields) and fields[-1] == "text":
        return fields
    warnings.append(SubtitleWarning(number, "this Format line lacks Start, End or Text at its end; it is not used"))
    return None


def _dialogue(written: str, fields: Sequence[str], number: int, warnings: list[SubtitleWarning]) -> WrittenCue | None:
    values = written.split(",", len(fields) - 1)
    if len(values) < len(fields):
        warnings.append(SubtitleWarning(number, f"this line has {len(values)} of {len(fields)} fields; it is left out"))
        return None
    found: Mapping[str, str] = dict(zip(fields, values, strict=True))
    start, end = parse_clock(found["start"]), parse_clock(found["end"])
    if start is None:
        warnings.append(
            SubtitleWarning(number, f"the start {found['start'].strip()[:20]!r} cannot be read; the cue is left out")
        )
        return None
    if end is None:
        warnings.append(
            SubtitleWarning(number, f"the end {found['end'].strip()[:20]!r} cannot be read; it is estimated")
        )
    text = "" if _DRAWING.search(found["text"]) else _LINE_BREAK.sub("\n", found["text"]).replace("\\h", " ")
    style = found.get("style", "").strip().lstrip("*")
    return WrittenCue(start, end, text, number, speaker=found.get("name", "").strip(), style=style)
