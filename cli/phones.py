"""``tts2face phones "text"``: words and phones of a text."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter


def phones(
    text: Annotated[str, Parameter(help="What to transcribe.")],
    /,
    *,
    format: Annotated[Literal["text", "json", "textgrid"], Parameter(help="How to print it.")] = "text",
    language: Annotated[
        str, Parameter(help="Language of the text: a code, a BCP 47 tag or an English name.")
    ] = "en-us",
    dictionary: Annotated[Path | None, Parameter(help="Your own pronunciations, which win.")] = None,
) -> None:
    """Print the words of a text and their phones, in ARPABET and IPA, with stress and syllables."""
    from lexicon.dictionary import read_dictionary
    from lexicon.given import pronounce_marked
    from lexicon.mark_parser import parse_marks
    from tts2face.export.text import FORMATS

    spoken = pronounce_marked(
        parse_marks(text, language), language, read_dictionary(dictionary) if dictionary else None
    )
    print(FORMATS[format](spoken), end="")  # noqa: T201 - the answer
