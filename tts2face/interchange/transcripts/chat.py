"""Transcripts of CHAT (``.cha``, CHILDES and TalkBank): main lines with their times, and times of words in ``%wor``.

Source: MacWhinney, The CHILDES Project, Part 1: The CHAT Transcription Format (2026).
"""

import re
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.slots import interpolated
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

_LINE = re.compile(r"([*%@][^:\t]*):?\t?(.*)", re.DOTALL)
# milliseconds; before 2008 with the media file, in copies of what CLAN shows between • and •
_BULLET = re.compile(
    r"[\x15•](?:%?\w+:\s*)?(?:\"[^\"]*\"|[^\x15•\s\"]*?)[_\s]*(?P<start>\d+)[_\s](?P<end>\d+)-?[\x15•]"
)
_TIMED_WORD = re.compile(r"(\S+)\s*[\x15•](\d+)_(\d+)-?[\x15•]")
_MEDIA_TIERS = frozenset({"%snd", "%mov"})  # of older files: "file" 500 2500
_MEDIA_TIMES = re.compile(r".*[\s_](\d+)[\s_](\d+)")
_NOT_SAID = re.compile(
    r"\x15[^\x15]*\x15|\[[^\[\]]*\]|&=\S+|\(\.*\d*[.:]?\d*\)|\+[^\s\w]+\S*|\b(?:xxx|yyy|www)\b|(?<!\S)0\w+|\([^()]*\)"
)  # bullets, codes, events, pauses, marks of ends and links, what is not understood or left out
_COMPOUND = re.compile(r"(?<=[^\W\d_])[_+](?=[^\W\d_])")  # Merry_Christmas, bath+tub
_PARTS = re.compile(r"@\S*|[<>‹›⌈⌉⌊⌋↑↓„‡:^ˈˌ]|&[-+~]?")  # of words: forms, scopes, overlaps, length


def read_cha(path: Path) -> list[Tier]:
    """Utterances of each speaker, or their words where ``%wor`` has their times."""
    text = read_text(path).replace("\r\n", "\n").replace("\r", "\n")
    if "@Begin" not in text and "@UTF8" not in text and not re.search(r"^\*\w+:", text, re.MULTILINE):
        raise DataError(f"{path} is no transcript of CHAT (no line such as *CHI: ...); correct it")
    # a line that begins with a tab goes on with the one before
    lines = [match.groups() for line in re.split(r"\n(?!\t)", text) if (match := _LINE.fullmatch(line))]
    speakers: list[str] = []
    utterances: list[list[SpokenCue] | str] = []
    spans: list[float | None] = []
    for kind, content in lines:
        plain = " ".join(content.split())
        if kind.startswith("*"):
            bullets = list(_BULLET.finditer(plain))
            speakers.append(kind[1:].strip())
            utterances.append(_plain_words(_NOT_SAID.sub(" ", _BULLET.sub(" ", plain))))
            spans += [int(bullets[0]["start"]) / 1000, int(bullets[-1]["end"]) / 1000] if bullets else [None, None]
        elif kind in _MEDIA_TIERS and spans[-1:] == [None] and (times := _MEDIA_TIMES.fullmatch(plain)):
            spans[-2:] = [int(times[1]) / 1000, int(times[2]) / 1000]
        elif kind == "%wor" and utterances and (words := _TIMED_WORD.findall(plain)):
            utterances[-1] = [
                SpokenCue(int(start) / 1000, int(end) / 1000, _plain_words(word)) for word, start, end in words
            ]
    has_words = any(isinstance(said, list) for said in utterances)
    if spans and not has_words and all(span is None for span in spans):
        raise DataError(f"{path} has no times; link its lines to the recording in CLAN, so that each has a bullet")
    edges = interpolated(spans)
    n_unknown = spans.count(None) // 2
    notes = (f"{n_unknown} lines of {path.name} without times lie between the others",) if n_unknown else ()
    tiers: dict[str, list[SpokenCue]] = {}
    for at, (speaker, said) in enumerate(zip(speakers, utterances, strict=True)):
        cues = said if isinstance(said, list) else [SpokenCue(edges[2 * at], edges[2 * at + 1], said.strip())]
        tiers.setdefault(speaker, []).extend(cues)
    return [Tier(name, tuple(cues), is_speech=True, notes=notes) for name, cues in tiers.items()]


def _plain_words(said: str) -> str:
    """Words without marks of their form; the parts of a compound are words."""
    return _COMPOUND.sub(" ", _PARTS.sub("", said))
