"""Text of a cue without what is none in its format: tags, overrides, entities and invisible characters."""

import html
import re
from dataclasses import dataclass

# Tags of SubRip and WebVTT, and of HTML as converters leave it: by name, or by attributes with values; anything else
# between < and > is text.
_NAMES = r"b|i|u|s|c|v|em|strong|strike|small|big|center|ruby|rt|rp|rb|br|font|span|p|div|lang"
_VALUE = r"""(?:"[^"\n]*"|'[^'\n]*')"""
_ATTRIBUTES = rf"(?:\s+[\w:-]+\s*=\s*{_VALUE})+"
_TAG = re.compile(
    r"<(?=[/A-Za-z\d])(?:"
    rf"[A-Za-z][\w:-]*{_ATTRIBUTES}\s*/?>"
    rf"|(?:{_NAMES})(?:\s+[\w:-]+=[^\s<>\"']+)+\s*/?>"
    r"|/a\s?>"
    rf"|/?(?:{_NAMES})(?:\.[^\s<>]*)?\s?/?>"
    r"|(?:font|span|p|div)(?:\.[^\s<>]*)?\s[^<>\n=]*=[^<>\n]*>"  # with attributes
    r"|(?:v|lang)(?:\.[^\s<>]*)?\s[^<>\n]*>"  # with the name of a speaker or language
    r"|\d[\d:.,]*:\d[\d:.,]*>"  # an instant within a cue
    rf"|/?(?:{_NAMES})(?:$|(?=\n)))",  # not closed at the end of a line
    re.IGNORECASE,
)
_OPENING = re.compile(rf"<(?P<name>[A-Za-z][\w:-]*){_ATTRIBUTES}\s*>")
_CLOSING = re.compile(r"</(?P<name>[A-Za-z][\w:-]*)\s?>")
_BREAK_TAG = re.compile(rf"<br(?:{_ATTRIBUTES})?\s*/?\s?>", re.IGNORECASE)
_RUBY_TEXT = re.compile(r"<rt\b[^<>]*>.*?(?:</rt\s*>|(?=</ruby)|$)", re.IGNORECASE | re.DOTALL)
_ENTITY = re.compile(r"&(?:[A-Za-z][A-Za-z0-9]{1,31}|#\d{1,7}|#[xX][0-9a-fA-F]{1,6});")
_DRAWING_MODE = re.compile(r"\\p(\d)")  # {\p1} begins coordinates in place of words, {\p0} ends them
_INVISIBLE = re.compile(r"[\u200b-\u200f\u202a-\u202e\u2060-\u2069\ufeff\u00ad]")
# Players of SubRip take over the overrides of SubStation Alpha ({\an8}) and MicroDVD ({y:i}); other braces are text, as
# {a: 1}. Codes of MicroDVD: style, colour, size and place by their values, font and character set by a name.
_FOREIGN_OVERRIDE = re.compile(
    r"\{(?:\\[^{}]*|[yY]:[biusBIUS,\s]*|[cC]:\$[0-9A-Fa-f]+|[sSP]:\d+|[fF]:[^\W\d][^{}:]*|H:[^\s{}]+|[oO]:\d+,\d+)\}"
)
# A path of Windows is no place for a line break: C:\New, \\server\News.
_BREAKS = re.compile(r"(?<!\S)(?P<path>[\"'“(]?(?:[A-Za-z]:\\|\\\\\w)\S*)|\\(?P<sign>[Nh])")
_OVERRIDE = re.compile(r"\{[^{}]*\}")  # libass shows nothing of a block in braces, also of a comment in it


@dataclass(frozen=True, slots=True)
class Markup:
    """Signs of a format that are no text."""

    has_tags: bool = False
    has_entities: bool = False
    override: "re.Pattern[str] | None" = None
    has_breaks: bool = False  # \N, \n and \h


SUBRIP_MARKUP = Markup(has_tags=True, has_entities=True, override=_FOREIGN_OVERRIDE, has_breaks=True)
WEBVTT_MARKUP = Markup(has_tags=True, has_entities=True, override=_FOREIGN_OVERRIDE)
SUBSTATION_MARKUP = Markup(override=_OVERRIDE, has_breaks=True)
BRACES_MARKUP = Markup(override=_FOREIGN_OVERRIDE)
PLAIN_MARKUP = Markup()


def plain_text(written: str, markup: Markup = SUBRIP_MARKUP) -> str:
    """Text as it is shown, its lines divided by line feeds."""
    text = written
    if markup.has_tags:
        text = _without_tags(text)
    if markup.override is not None:
        text = markup.override.sub("", text)
    if markup.has_entities:
        text = _ENTITY.sub(lambda match: html.unescape(match[0]), text)
    if markup.has_breaks:
        text = _BREAKS.sub(_line_break, text)
    return _INVISIBLE.sub("", text.replace("\u00a0", " "))


def _without_tags(text: str) -> str:
    """Text without tags, and without the closing ones of those that are known by their attributes."""
    names = {match["name"].casefold() for match in _OPENING.finditer(text)}
    text = _TAG.sub("", _RUBY_TEXT.sub("", _BREAK_TAG.sub("\n", text)))
    return _CLOSING.sub(lambda match: "" if match["name"].casefold() in names else match[0], text) if names else text


def _line_break(match: "re.Match[str]") -> str:
    return match["path"] or {"N": "\n", "h": " "}[match["sign"]]


def without_drawings(text: str) -> str:
    """Text of SubStation Alpha without the coordinates of its drawings."""
    kept: list[str] = []
    is_drawing = False
    at = 0
    for block in _OVERRIDE.finditer(text):
        kept += [] if is_drawing else [text[at : block.start()]]
        modes = _DRAWING_MODE.findall(block[0])
        is_drawing = modes[-1] != "0" if modes else is_drawing
        kept.append(block[0])
        at = block.end()
    return "".join([*kept, *([] if is_drawing else [text[at:]])])
