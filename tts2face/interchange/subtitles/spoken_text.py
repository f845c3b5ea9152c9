"""The spoken words of a cue, and its speaker's label."""

import html
import re
from collections.abc import Sequence
from dataclasses import dataclass

from tts2face.interchange.subtitles.cues import CuePart

_BREAK_TAG = re.compile(r"<br\s*/?\s*>", re.IGNORECASE)
_RUBY_TEXT = re.compile(r"<rt\b[^<>]*>.*?(?:</rt\s*>|(?=</ruby)|$)", re.IGNORECASE | re.DOTALL)
# Tags of SubRip and WebVTT, inner timestamps, and tags of known names that are not closed.
_TAG = re.compile(
    r"<\s*/?\s*[A-Za-z][^<>\n]*>|<\d[\d:.,]*>|<\s*/?\s*(?:i|b|u|s|c|v|em|font|ruby|lang|span)(?:[\s.=][^<>\n]*)?(?:$|(?=\n))",
    re.IGNORECASE,
)
_OVERRIDE = re.compile(r"\{[^{}]*\}")  # of SubStation Alpha, also found in SubRip
_ENTITY = re.compile(r"&(?:amp|lt|gt|nbsp|quot|apos|lrm|rlm|#\d{1,7}|#[xX][0-9a-fA-F]{1,6});")
_INVISIBLE = re.compile(r"[\u200b-\u200f\u202a-\u202e\u2060-\u2069\ufeff\u00ad]")
# Additions of subtitles for the deaf: noises in brackets, lyrics between notes.
_NOISE = re.compile(
    r"\[[^\]]*(?:\]|$)|\([^()]*\)|（[^（）]*）|【[^【】]*】|［[^［］]*］"
    r"|[♪♫♬♩][^♪♫♬♩]*(?:[♪♫♬♩]+|$)|(?m:^[^\S\n]*#\s.*(?:\s#)?\s*$)"
)
_LABEL = re.compile(
    r"^(?P<lead>\s*(?:[-–—‐]\s*|>>\s*|•\s*)?)(?P<label>[^\W\d_][^:：\n?!,;]{0,40}?)\s*(?::(?=\s|$)|：)", re.MULTILINE
)
_DASH = re.compile(r"^\s*(?:[-–—‐]\s*(?=\S)|>>\s*|•\s*)", re.MULTILINE)
_INNER_DASH = re.compile(r"(?<!\s)\s++(?=(?P<dash>[-–—‐]|>>)\s*[\"'“‘«¿¡….(\[]{0,4}(?P<letter>\w))")
_ENDS_SENTENCE = re.compile(r"[.!?…♪][\"'”’»)\]]*\s*$")
_END_CHARACTERS = 8  # of a line, within which the end of its last sentence lies
_VOICE = re.compile(r"<v(?:\.[^\s.<>]+)*\s([^<>]+)>")
_VOICE_MARK = re.compile(r"^\s*\x02([^\x03]*)\x03")


@dataclass(frozen=True, slots=True)
class SpokenText:
    """Text of a cue: as it is spoken, on one line, the text as shown, and its parts by speaker.

    The speaker of a part is a label or WebVTT voice, or empty for a dash without a name.
    """

    spoken: str
    shown: str
    parts: tuple[CuePart, ...]

    @property
    def speaker(self) -> str:
        """The first speaker that has a name; else empty."""
        return next((part.speaker for part in self.parts if part.speaker), "")


def spoken_text(written: str) -> SpokenText:
    """Divide the text of a cue into words, tags, noises, lyrics and speakers.

    A label is a name in capitals before a colon and a space (``JOHN:``), at the start of a line. A part begins at a
    label, at a tag of one of several WebVTT voices, and at each of two or more dashes that begin a line or follow a
    sentence in it; a line after a sentence needs only a dash of its own.
    """
    is_dialogue = len({name.strip() for name in _VOICE.findall(written)}) > 1
    plain = _plain(_VOICE.sub("\n\x02\\1\x03", written) if is_dialogue else written)
    lines = [part for line in _NOISE.sub(" ", plain).split("\n") for part in _at_dashes(line)]
    has_dashes = _is_dialogue(lines)
    parts: list[tuple[str, list[str]]] = [("", [])]
    for line in lines:
        speaker, rest = _speaker_of(line, has_dashes=has_dashes)
        if speaker is not None and not (speaker and speaker == parts[-1][0]):
            parts.append((speaker, []))
        parts[-1][1].append(rest)
    spoken = [CuePart(speaker, " ".join(" ".join(words).split())) for speaker, words in parts]
    spoken = [part for part in spoken if any(character.isalnum() for character in part.text)]
    shown = " ".join(re.sub(r"\x02[^\x02\x03]*\x03", "", plain).split())
    return SpokenText(" ".join(part.text for part in spoken), shown, tuple(spoken))


def _at_dashes(line: str) -> list[str]:
    """A line divided before the dashes that follow a whole sentence: another person begins one there.

    In a line without a dash at its start a long dash may be a pause, and one after a quotation belongs to its frame.
    """
    has_first = _DASH.match(line) is not None
    starts = [0]
    for match in _INNER_DASH.finditer(line):
        is_turn = match["dash"] == ">>" or (
            _ENDS_SENTENCE.search(line[max(match.start() - _END_CHARACTERS, 0) : match.start()]) is not None
            and not match["letter"].islower()
            and not line[match.end("dash") :][:1].isdigit()  # -5 is a number
            and (has_first or (match["dash"] in "-–" and match["letter"].isalpha()))
        )
        starts += [match.end()] if is_turn else []
    return [line[start:end] for start, end in zip(starts, [*starts[1:], None], strict=True)]


def _is_dialogue(lines: Sequence[str]) -> bool:
    """Whether dashes stand for speakers: there are two, or one after a line with a whole sentence of somebody else."""
    dashed = [_DASH.match(line) is not None for line in lines]
    follows = (
        is_next and _ENDS_SENTENCE.search(line[-_END_CHARACTERS:])
        for line, is_next in zip(lines, dashed[1:], strict=False)
    )
    return sum(dashed) > 1 or any(follows)


def _speaker_of(line: str, *, has_dashes: bool) -> tuple[str | None, str]:
    """Speaker who begins at a line, empty if unnamed and None if the line continues, and the words of the line."""
    voice = _VOICE_MARK.match(line)
    if voice:
        return " ".join(voice[1].split()), _DASH.sub("", line[voice.end() :])
    match = _LABEL.match(line)
    if match:
        label = " ".join(match["label"].split())
        # "JOHN:" is a speaker, "Remember:" begins a sentence
        if label == label.upper() and label != label.lower():
            return label, line[match.end() :]
    dash = _DASH.match(line)
    if dash:
        return ("" if has_dashes else None), line[dash.end() :]
    return None, line


def _plain(written: str) -> str:
    """Text without tags, overrides, entities and invisible characters."""
    text = _RUBY_TEXT.sub("", _BREAK_TAG.sub("\n", written))
    text = _OVERRIDE.sub("", _TAG.sub("", text))
    text = _ENTITY.sub(lambda match: html.unescape(match[0]), text)
    return _INVISIBLE.sub("", text.replace("\\N", "\n").replace("\\h", " ").replace("\u00a0", " "))
