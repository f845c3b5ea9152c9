"""Reading of SSML of other services, around what is not followed.

Entities of HTML and bare ``&`` in the source, elements and attributes of vendors, and names of their styles.
"""

import functools
import html.entities
import re
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from xml.sax.saxutils import escape

from lexicon.emphasis import SPACED
from lexicon.written_forms import read_table

LANGUAGE = "xml:lang"
# Elements that are others under another name, with their attributes under the names of these.
RENAMED: Mapping[str, tuple[str, Mapping[str, str]]] = MappingProxyType({
    "mstts:express-as": ("express-as", {}),
    "amazon:emotion": ("express-as", {"name": "style"}),
    "google:style": ("express-as", {"name": "style"}),
    "bookmark": ("mark", {"mark": "name"}),
    "paragraph": ("p", {}), "sentence": ("s", {}), "token": ("w", {}),  # SSML 1.0 drafts; 1.1, 3.1.8.2
})  # fmt: skip
# Elements whose content is no text to speak, with the note on them.
UNSPOKEN: Mapping[str, str] = MappingProxyType({
    "lexicon": "<lexicon> is not loaded; give pronunciations as a dictionary",
    "meta": "<meta> is not read",
    "metadata": "<metadata> is not read",
    "desc": "<desc> is not spoken",
    "mstts:backgroundaudio": "the sound of <mstts:backgroundaudio> is not played",
    "mstts:viseme": "<mstts:viseme> is not needed; visemes are exported with the clip",
    "mstts:audioduration": "<mstts:audioduration> is not followed; <prosody duration> sets the time of words",
})  # fmt: skip
# Elements whose text is spoken as that around it, with the note on them.
TRANSPARENT: Mapping[str, str] = MappingProxyType({
    "audio": "the sound of <audio> is not played; the text in it is spoken",
    "lookup": "<lookup> is not followed; its text is spoken",
    "speak": "a <speak> within another one is read as its text",
})  # fmt: skip
_KNOWN: Mapping[str, str] = MappingProxyType({
    "speak": f"version {LANGUAGE}", "p": LANGUAGE, "s": LANGUAGE, "w": LANGUAGE, "lang": LANGUAGE,
    "break": "time strength",
    "emphasis": "level", "prosody": "rate volume pitch range contour duration", "mark": "name", "sub": "alias",
    "phoneme": "alphabet ph", "say-as": "interpret-as format detail", "express-as": "style type",
    "voice": f"name gender language languages {LANGUAGE}", "mstts:silence": "type value",
})  # fmt: skip
# Attributes without an effect on what is spoken here, which get no note.
_SILENT = re.compile(r"xml(?:ns)?:.*|xmlns|xsi:.*|required|ordering|onvoicefailure|onlangfailure|role")
_SOURCE_PART = re.compile(r"<!\[CDATA\[|<!--|&(?!(?:amp|lt|gt|quot|apos|#[0-9]{1,8}|#x[0-9a-fA-F]{1,6});)")
_ENDS = MappingProxyType({"<![CDATA[": "]]>", "<!--": "-->"})
_ENTITY = re.compile(r"&([A-Za-z][A-Za-z0-9]{1,31};)")


@functools.cache
def _touching() -> re.Pattern[str]:
    """Characters of two words or two sentences; writing without spaces has none; compiled in 2 ms."""
    return re.compile(rf"{SPACED}(?!s\b){SPACED}|[.!?…,;:)”][^\W\d_]")


def is_touching(before: str, text: str) -> bool:
    """Whether a word or a sentence ends between the character before a tag and the text behind it.

    A plural of ``<sub>`` stays with it.
    """
    return _touching().match(f"{before:1}{text[:2]}") is not None


def known_attributes(element: str, attributes: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
    """Attributes of an element that are read, and the names of those that a reader may miss."""
    known = _KNOWN.get(element, "").split()
    read = {name: value for name, value in attributes.items() if name in known}
    return read, [name for name in attributes if name not in known and not _SILENT.fullmatch(name)]


def with_plain_entities(source: str) -> str:
    r"""An XML source with characters in place of HTML's named entities, and ``&amp;`` in place of a bare ``&``.

    Examples
    --------
    >>> with_plain_entities("Q&A&nbsp;&ndash; AT&amp;T <![CDATA[a & b]]>")
    'Q&amp;A\xa0– AT&amp;T <![CDATA[a & b]]>'
    """
    return "".join(_plain_parts(source))


def _plain_parts(source: str) -> Iterator[str]:
    at = 0
    while match := _SOURCE_PART.search(source, at):
        yield source[at : match.start()]
        at = match.end()
        if match[0] in _ENDS:
            end = source.find(_ENDS[match[0]], at)
            end = len(source) if end < 0 else end
            yield source[match.start() : end]
            at = end
            continue
        entity = _ENTITY.match(source, match.start())
        character = html.entities.html5.get(entity[1]) if entity else None
        yield "&amp;" if character is None else escape(character, {'"': "&quot;"})
        at = match.end() if entity is None or character is None else entity.end()
    yield source[at:]


@functools.cache
def _style_names() -> dict[str, str]:
    return {name: style for name, (style, *_) in read_table("style_names.tsv").items()}


def nearest_style(name: str) -> str | None:
    """Style of the starter palette that is nearest to one of a speech service; None for any other name.

    Examples
    --------
    >>> nearest_style("Cheerful"), nearest_style("delighted")
    ('delighted', None)
    """
    return _style_names().get(name.strip().casefold())
