"""Marks of a text: the styles that they name, and what cannot be marked beside a request."""

from collections.abc import Mapping
from functools import lru_cache

from lexicon.errors import InputError
from lexicon.languages import language_code
from lexicon.marked_text import RATE_LIMITS, VOLUME_LIMITS, MarkedText
from lexicon.sentence_length import check_silence
from tts2face.gestures.timeline import parse_style
from tts2face.request import Request
from tts2face.source import Recorded, Spoken


@lru_cache(maxsize=1000)
def innermost_styles(nested: tuple[str, ...]) -> Mapping[str, str]:
    """Style of each feature under nested marks; the innermost mark of a feature applies."""
    chosen: dict[str, str] = {}
    for written in nested:
        chosen |= parse_style(written)
    return chosen


def marked_styles(text: MarkedText) -> tuple[str, ...]:
    """Names of all styles in the marks of a text, in order of first use; raises as `check_marks`."""
    runs = dict.fromkeys(run.styles for run in text.runs)
    return tuple(dict.fromkeys(style for styles in runs for style in innermost_styles(styles).values()))


def check_marks(text: MarkedText, request: Request) -> None:
    """Reject marks that are invalid or do not go with the request, in time linear in the length of the text."""
    if isinstance(request.source, Recorded) and text.has_voice_changes:
        raise InputError(
            "[pause], <break>, <prosody>, <emphasis>, <voice> and <lang> have no effect on a recording; remove them or "
            "--audio"
        )
    if text.language is not None and _primary(language_code(text.language)) != _primary(request.language):
        raise InputError(f"the text names the language {text.language}, not {request.language}; choose one of them")
    marked_styles(text)
    check_silence(text)
    spoken = request.spoken or Spoken("")
    for what, marked, requested, (low, high) in (
        ("speed", {run.rate for run in text.runs}, spoken.rate, RATE_LIMITS),
        ("loudness", {run.volume for run in text.runs}, spoken.volume, VOLUME_LIMITS),
    ):
        for factor in marked:
            if not low <= factor * requested <= high:
                raise InputError(
                    f"a {what} of {factor:g} in the text times {requested:g} of the request lies outside "
                    f"{low:g} to {high:g}; change one of them"
                )


def _primary(language: str) -> str:
    """Primary language of a code: ``en`` of ``en-gb``."""
    return language.partition("-")[0]
