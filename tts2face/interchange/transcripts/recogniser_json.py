"""JSON of recognisers of speech and of aligners: words or segments, each with its start and end.

Of Whisper and those that follow it (``segments`` with ``words``; ``transcription`` with ``offsets`` in milliseconds),
OpenAI's transcriptions (``words`` beside ``segments``), Vosk (``result``) and Gentle (``words``, not all with times).
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from lexicon.errors import DataError
from lexicon.values.json_text import parse_json
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.slots import interpolated
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

LISTS = ("segments", "transcription", "words", "result")  # of the outermost object
_Entry = Mapping[str, Any]


def is_recogniser_json(text: str) -> bool:
    """Whether a text is JSON with words or segments that have times."""
    head = text.lstrip("\ufeff \t\r\n")
    if not head.startswith("{") or not any(f'"{name}"' in head for name in LISTS):
        return False
    try:
        content = parse_json(head, "")
    except DataError:
        return False
    return bool(_words(content) or _segments(content))


def read_recogniser_json(path: Path) -> list[Tier]:
    """The words of a file that have times, and its segments."""
    content = parse_json(read_text(path).lstrip("\ufeff"), str(path))
    tiers = []
    for name, entries in (("words", _words(content)), ("text", _segments(content))):
        times = [time for entry in entries for time in _span(entry)]
        n_unknown = sum(time is None for time in times)
        filled = interpolated(times)
        cues = tuple(
            SpokenCue(start, max(start, end), _text(entry))
            for entry, start, end in zip(entries, filled[::2], filled[1::2], strict=True)
        )
        note = f"{n_unknown} times that {path.name} lacks are interpolated between others"
        if cues:
            tiers.append(Tier(name, cues, notes=(note,) if n_unknown else ()))
    if not tiers:
        raise DataError(f"{path} has no words with times (segments, words or result); export it with them")
    return tiers


def _words(content: object) -> list[_Entry]:
    """Words with times, of the file or of its segments."""
    own = [entry for name in ("words", "result") for entry in _entries(content, name)]
    return _timed(own) or _timed(
        [word for segment in _entries(content, "segments") for word in _entries(segment, "words")]
    )


def _segments(content: object) -> list[_Entry]:
    return _timed([entry for name in ("segments", "transcription") for entry in _entries(content, name)])


def _entries(of: object, name: str) -> Iterator[_Entry]:
    listed = of.get(name) if isinstance(of, Mapping) else None
    if isinstance(listed, Sequence) and not isinstance(listed, str):
        yield from (entry for entry in listed if isinstance(entry, Mapping) and _text(entry))


def _timed(entries: list[_Entry]) -> list[_Entry]:
    """Entries, none where not one has times."""
    return entries if any(None not in _span(entry) for entry in entries) else []


def _text(entry: _Entry) -> str:
    text = entry.get("word", entry.get("text"))
    return text.strip() if isinstance(text, str) else ""


def _span(entry: _Entry) -> tuple[float | None, float | None]:
    offsets = entry.get("offsets")
    if isinstance(offsets, Mapping):
        return _seconds(offsets.get("from"), 0.001), _seconds(offsets.get("to"), 0.001)
    return _seconds(entry.get("start"), 1.0), _seconds(entry.get("end"), 1.0)


def _seconds(value: object, scale: float) -> float | None:
    return value * scale if isinstance(value, int | float) and not isinstance(value, bool) else None
