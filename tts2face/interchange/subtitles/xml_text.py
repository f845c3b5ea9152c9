"""Parsing of XML with subtitles by expat, up to where it is damaged; without document types there are no entities."""

import re
from collections.abc import Sequence
from xml.parsers import expat

from lexicon.errors import DataError
from tts2face.interchange.subtitles.cues import SubtitleWarning

_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")


def parse_xml(parser: expat.XMLParserType, text: str, cues: Sequence[object], warnings: list[SubtitleWarning]) -> None:
    """Run the handlers of a parser over a whole document.

    Damaged XML is a warning if `cues`, which the handlers fill, has some by then, else a `DataError`.
    """
    parser.buffer_text = True
    parser.StartDoctypeDeclHandler = _refuse_doctype
    # the text is decoded already, whatever its declaration says
    plain = _DECLARATION.sub(lambda match: "\n" * match[0].count("\n"), text, count=1).lstrip(" \t\r")
    try:
        parser.Parse(plain, True)
    except expat.ExpatError as broken:
        reason = expat.ErrorString(broken.code)
        if not cues:
            raise DataError(
                f"line {broken.lineno}: the XML is not well-formed ({reason}); export the file again"
            ) from broken
        message = f"the XML is not well-formed ({reason}); what follows is left out"
        warnings.append(SubtitleWarning(broken.lineno, message))
    except UnicodeEncodeError as broken:
        raise DataError(f"the XML contains an unpaired surrogate (character {broken.start}); remove it") from broken


def _refuse_doctype(*_: object) -> None:
    raise DataError("a document type declaration is not supported; remove <!DOCTYPE ...>")
