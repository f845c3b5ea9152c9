"""Names that clients may use; a path from a client never reaches the file system."""

import re
from collections.abc import Mapping
from typing import Any

from tts2face import catalogue
from tts2face.render.picture import COLOURS, STUDIO, TRANSPARENT
from tts2face.request import OWN_FACE
from tts2face.service.errors import RefusedError

COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")
MODEL_KINDS = ("talker", "face", "palette")
MODEL_FIELDS = (*MODEL_KINDS, "identity")  # of a request; those of `tts2face.session_cache.Models`


def known_names(kind: str) -> tuple[str, ...]:
    """Names of a kind: talker, face, palette, voice."""
    match kind:
        case "talker":
            return tuple(one.name for one in catalogue.talkers())
        case "face":
            return tuple(one.name for one in catalogue.faces())
        case "palette":
            return ("starter",)
        case _:
            return tuple(one.name for one in catalogue.voices() if one.languages)


def check_models(models: Mapping[str, Any]) -> None:
    """Refuse models that are not known by name.

    Raises
    ------
    RefusedError
        There is no such talker, face or palette.
    """
    for kind in MODEL_KINDS:
        if kind in models:
            _check(kind, str(models[kind]), (*known_names(kind), OWN_FACE) if kind == "face" else known_names(kind))


def check_voice(voice: str | None) -> None:
    """Refuse voices that are not known by name."""
    if voice is not None:
        _check("voice", voice, known_names("voice"))


def check_background(background: str) -> None:
    """Refuse backgrounds that are neither a word nor a colour."""
    if background not in {STUDIO, TRANSPARENT, *COLOURS} and not COLOUR.fullmatch(background):
        raise RefusedError(
            400, "invalid_request", f"there is no background {background[:60]!r}; give studio, transparent or #rrggbb"
        )


def _check(kind: str, name: str, known: tuple[str, ...]) -> None:
    if name not in known:
        raise RefusedError(
            400, "invalid_request", f"there is no {kind} {name[:60]!r}; the {kind}s are {', '.join(known)}"
        )
