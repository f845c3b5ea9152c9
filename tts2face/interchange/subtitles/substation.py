"""SubStation Alpha: ASS and SSA."""

import re
from collections.abc import Mapping, Sequence

from tts2face.interchange.subtitles.clock import parse_clock
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import SUBSTATION_MARKUP, plain_text, without_drawings
from tts2face.interchange.subtitles.unspoken import EFFECTS, SIGNS, kind_of_style

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
PACKET_FIELDS: tuple[str, ...] = ("readorder", "layer", *ASS_FIELDS[3:])
_SECTION = re.compile(r"\s*\[([^\]]+)\]\s*$")
_DRAWING = re.compile(r"\\p[1-9]")  # coordinates, no words
_PLACED = re.compile(r"\\(?:pos|move)\s*\(")
# Text that is turned, bent or cut to fit the picture, or moves: writing in the picture, not dialogue.
_TYPESET = re.compile(r"\\(?:fr[xyz]?-?[1-9]|fa[xy]-?[\d.]|i?clip\s*\(|org\s*\(|move\s*\(|t\s*\()")
_SIGN_SPEAKERS = frozenset({"sign", "signs", "title", "ts", "typeset", "typesetting"})
_EFFECT = re.compile(r"\s*(?:fx|karaoke|template|code)\b", re.IGNORECASE)  # karaoke as Aegisub computes it
_MOVING = re.compile(r"\s*(?:banner|scroll up|scroll down)\s*;", re.IGNORECASE)
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
    return _cue(found, start, end, number)


def packet_cue(written: str, start_s: float, end_s: float | None, number: int) -> WrittenCue | None:
    """Cue of a packet of a film: a dialogue line without its times, after its number and layer; None if it is none."""
    values = written.split(",", len(PACKET_FIELDS) - 1)
    if len(values) < len(PACKET_FIELDS):
        return None
    return _cue(dict(zip(PACKET_FIELDS, values, strict=True)), start_s, end_s, number)


def _cue(found: Mapping[str, str], start: float, end: float | None, number: int) -> WrittenCue:
    style, speaker = found.get("style", "").strip().lstrip("*"), found.get("name", "").strip()
    text = _LINE_BREAK.sub("\n", without_drawings(found["text"]))
    kind = _kind(found["text"], text, found, style, speaker)
    return WrittenCue(start, end, text, number, speaker=speaker, style=style, markup=SUBSTATION_MARKUP, kind=kind)


def _kind(line: str, text: str, found: Mapping[str, str], style: str, speaker: str) -> str:
    """Kind of a line that nobody says, also without its drawings (`text`); empty for dialogue."""
    effect = found.get("effect", "")
    if _EFFECT.match(effect):
        return EFFECTS
    if _MOVING.match(effect) or (_PLACED.search(line) and _TYPESET.search(line)):
        return SIGNS
    is_drawing = text != line and not any(map(str.isalnum, plain_text(text, SUBSTATION_MARKUP)))
    if is_drawing and _DRAWING.search(line):
        return EFFECTS
    # typesetters also write "sign" into the field of the speaker
    return kind_of_style(style) or (SIGNS if speaker.casefold() in _SIGN_SPEAKERS else "")
