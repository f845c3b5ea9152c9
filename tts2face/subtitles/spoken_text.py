"""The spoken words of a cue, and its speaker's label."""

import html
import re
from dataclasses import dataclass

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
    r"|[♪♫♬♩][^♪♫♬♩]*(?:[♪♫♬♩]+|$)|(?m:^\s*#\s.*(?:\s#)?\s*$)"
)
_LABEL = re.compile(
    r"^(?P<lead>\s*(?:[-–—‐]\s*|>>\s*|•\s*)?)(?P<label>[^\W\d_][^:：\n?!,;]{0,40}?)\s*(?::(?=\s|$)|：)", re.MULTILINE
)
_DASH = re.compile(r"^\s*(?:[-–—‐]\s*(?=\S)|>>\s*|•\s*)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class SpokenText:
    """What of a cue is spoken, on one line, the text as shown, and the labels of its speakers in order."""

    spoken: str
    shown: str
    speakers: tuple[str, ...]


def spoken_text(written: str) -> SpokenText:
    """Divide the text of a cue into words, tags, noises, lyrics and speaker labels.

    A label is a name in capitals before a colon and a space (``JOHN:``), at the begin of a line.
    """
    plain = _plain(written)
    speakers: list[str] = []

    def take_label(match: "re.Match[str]") -> str:
        label = " ".join(match["label"].split())
        if label != label.upper() or label == label.lower():
            return match[0]
        speakers.append(label)
        return " "

    without_noise = _NOISE.sub(" ", plain)
    spoken = _DASH.sub(" ", _LABEL.sub(take_label, without_noise))
    words = " ".join(spoken.split())
    if not any(character.isalnum() for character in words):
        words = ""
    return SpokenText(words, " ".join(plain.split()), tuple(dict.fromkeys(speakers)))


def _plain(written: str) -> str:
    """Text without tags, overrides, entities and invisible characters."""
    text = _RUBY_TEXT.sub("", _BREAK_TAG.sub("\n", written))
    text = _OVERRIDE.sub("", _TAG.sub("", text))
    text = _ENTITY.sub(lambda match: html.unescape(match[0]), text)
    return _INVISIBLE.sub("", text.replace("\\N", "\n").replace("\\h", " ").replace("\u00a0", " "))
