"""SubRip and WebVTT: blocks of lines that begin with a line of times."""

import html
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from tts2face.interchange.subtitles.clock import HAS_ARROW, TIMING, clock_seconds
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import WEBVTT_MARKUP

_NUMBER = re.compile(r"\s*\d{1,9}\s*")
_UNSPOKEN_BLOCK = re.compile(r"(?:NOTE|STYLE|REGION)(?:\s|$)")  # W3C WebVTT, 4.1
_VOICE = re.compile(r"<v(?P<classes>(?:\.[^\s.>]+)*)\s+(?P<name>[^>]+)>")
_LANGUAGE = re.compile(r"<lang\s+([A-Za-z0-9-]{2,35})\s*>")
# After the times: settings of WebVTT and of its drafts (A:middle), and the corners of a frame (X1:100).
_SETTINGS = re.compile(
    r"\b(?:(?:align|line|position|size|vertical|region)\s*:\s*[\w.%,+-]*|[ADLST]:\S+|[XY][12]\s*:\s*-?\d+)",
    re.IGNORECASE,
)
_OTHER_SETTING = re.compile(r"(?<!\S)[A-Za-z][\w-]*:[\w.%,+-]+(?!\S)")  # of a program of its own
SHOWN_CHARACTERS = 40  # of a line in a warning


@dataclass(slots=True)
class _Block:
    """Lines after a line of times; a block without times collects what is not shown."""

    line: int
    begin_s: float | None = None
    end_s: float | None = None
    lines: list[str] = field(default_factory=list)
    number: int | None = None
    starts_after_blank: bool = True


def read_subrip(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of SubRip text; lines of times divide them, so that blank lines and numbers may be missing."""
    warnings: list[SubtitleWarning] = []
    blocks = list(_blocks(lines, warnings))
    return [_cue(block) for block in blocks if block.begin_s is not None], warnings


def read_webvtt(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of WebVTT text, without its comments, style sheets and regions; the header may be missing."""
    warnings: list[SubtitleWarning] = []
    kept = _without_unspoken(lines)
    if not any(line.lstrip("\ufeff \t").startswith("WEBVTT") for line in lines[:3]):
        warnings.append(SubtitleWarning(1, "the header WEBVTT is missing"))
    cues = []
    for block in _blocks(kept, warnings, are_ids_words=True):
        if block.begin_s is None:
            continue
        cues.append(with_voice(_cue(block)))
    return cues, warnings


def with_voice(cue: WrittenCue) -> WrittenCue:
    """A cue of WebVTT with the speaker, class and language of its tags."""
    voice, language = _VOICE.search(cue.text), _LANGUAGE.search(cue.text)
    return replace(
        cue,
        speaker=" ".join(html.unescape(voice["name"]).split()) if voice else "",
        style=voice["classes"].lstrip(".") if voice else "",
        language=language[1] if language else None,
        markup=WEBVTT_MARKUP,
    )


def _without_unspoken(lines: Sequence[str]) -> list[str]:
    """Lines with those of comments, style sheets and regions emptied; the numbers of the others stay."""
    kept, is_inside = [], False
    for at, line in enumerate(lines):
        if not line.strip():
            is_inside = False
        # NOTE, STYLE and REGION begin blocks; within a cue they are words
        elif _UNSPOKEN_BLOCK.match(line) and (at == 0 or not lines[at - 1].strip()):
            is_inside = True
        kept.append("" if is_inside else line)
    return kept


def _blocks(lines: Sequence[str], warnings: list[SubtitleWarning], *, are_ids_words: bool = False) -> Iterator[_Block]:
    """Blocks of lines with times, each without the number or identifier of the next block."""
    block = _Block(0)
    for number, line in enumerate(lines, start=1):
        match = TIMING.match(line)
        # a line with an arrow begins a cue even where its times are damaged
        if match is None and not HAS_ARROW.search(line):
            block.lines.append(line)
            continue
        following = _open_block(number, line, match, warnings)
        _take_label(block, following, are_ids_words=are_ids_words)
        if not following.starts_after_blank and block.begin_s is not None:
            warnings.append(SubtitleWarning(number, "there is no blank line before this cue"))
        yield block
        block = following
    yield block


def _open_block(number: int, line: str, match: "re.Match[str] | None", warnings: list[SubtitleWarning]) -> _Block:
    shown = " ".join(line.split())[:SHOWN_CHARACTERS]
    if match is None:
        warnings.append(SubtitleWarning(number, f"the times {shown!r} cannot be read; the cue is left out"))
        return _Block(number)
    groups = match.groups()
    end = None if groups[7] is None else clock_seconds(*groups[5:10])
    if end is None:
        warnings.append(SubtitleWarning(number, f"the end in {shown!r} cannot be read; it is estimated"))
    block = _Block(number, clock_seconds(*groups[:5]), end)
    beside = " ".join(_SETTINGS.sub(" ", groups[10]).split()) if end is not None else ""
    if any(map(str.isalnum, beside)):
        is_read = any(map(str.isalnum, _OTHER_SETTING.sub(" ", beside)))
        what = "it is read" if is_read else "it is taken for a setting"
        warnings.append(SubtitleWarning(number, f"{beside[:SHOWN_CHARACTERS]!r} stands beside the times; {what}"))
        block.lines += [beside] if is_read else []
    return block


def _take_label(block: _Block, following: _Block, *, are_ids_words: bool) -> None:
    """Move the number or identifier of the next cue from the end of a block; both are updated."""
    lines = block.lines
    following.starts_after_blank = not lines or not lines[-1].strip()
    if following.starts_after_blank:
        while lines and not lines[-1].strip():
            lines.pop()
        # some programs write a blank line between number and times
        if not (lines and _NUMBER.fullmatch(lines[-1])):  # times directly after a blank line
            return
    has_blank_before = not lines[-2].strip() if len(lines) > 1 else block.begin_s is None
    is_number = _NUMBER.fullmatch(lines[-1]) is not None
    expected = None if block.number is None else block.number + 1
    # without numbers before, one that a blank line divides from the times is what somebody says
    is_first = expected is None and not following.starts_after_blank
    is_label = is_number and (has_blank_before or is_first or (expected is not None and int(lines[-1]) == expected))
    if is_label or (are_ids_words and has_blank_before):
        following.number = int(lines[-1]) if is_number else None
        following.starts_after_blank = has_blank_before
        lines.pop()


def _cue(block: _Block) -> WrittenCue:
    return WrittenCue(block.begin_s or 0.0, block.end_s, "\n".join(block.lines).strip(), block.line)
