"""XML of annotation files, without document types and entities."""

import re
from pathlib import Path
from xml.etree import ElementTree

from lexicon.errors import DataError
from tts2face.interchange.transcripts.file_text import read_text

_DOCTYPE = re.compile(r"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")


def read_xml(path: Path, root: str, program: str) -> ElementTree.Element:
    """The root element of a file.

    Parameters
    ----------
    root
        Its name.
    program
        The program that writes such files, for messages.
    """
    text = read_text(path)
    if _DOCTYPE.search(text):
        raise DataError(f"{path} has a document type, which files of {program} do not have; remove it")
    try:
        element = ElementTree.fromstring(_DECLARATION.sub("", text))
    except ElementTree.ParseError as broken:
        raise DataError(f"{path} is no XML ({broken}); save it with {program} again") from broken
    if element.tag != root:
        raise DataError(f"{path} is no file of {program} (it begins with <{element.tag}>); give one")
    return element
