"""Names that clients may use in requests; a path from a client never reaches the file system."""

import asyncio
import re
from collections.abc import Mapping
from typing import Any

from tts2face.models.face_names import default_face
from tts2face.models.named_colours import parse_hair_colour
from tts2face.picture.options import BLUR, COLOURS, STUDIO, TRANSPARENT
from tts2face.request import OWN_FACE
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import Library, shipped_names
from tts2face.serving.work.resource_check import DICTIONARY, FACE
from tts2face.session import catalogue

COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")
MODEL_KINDS = ("talker", "face", "palette")


async def resolve_models(library: Library, key: ApiKey, models: Mapping[str, Any]) -> dict[str, Any]:
    """Models of a request with the paths of uploads in place of their names.

    Raises
    ------
    RefusedError
        There is no such talker, face, palette or haircut for this key, or an uploaded face has no such identity.
    """
    resolved = dict(models)
    _check_hair(models)
    for kind in MODEL_KINDS:
        name = models.get(kind)
        if name is None or name in _served_names(kind):
            continue
        resolved[kind], description = await asyncio.to_thread(library.resolve, key, kind, str(name))
        identity = models.get("identity")
        if kind == FACE and identity is not None and identity not in description["identities"]:
            offered = ", ".join(description["identities"]) or "none"
            raise RefusedError(
                400, "invalid_request", f"the face {name} has no identity {str(identity)[:60]!r}; it has: {offered}"
            )
    return resolved


def _check_hair(models: Mapping[str, Any]) -> None:
    haircut, colour = models.get("hair"), models.get("hair_color")
    if haircut is not None:
        face = str(models.get("face") or default_face(models.get("identity"), haircut))
        known = [haircut.name for haircut in catalogue.haircuts_of(face)]
        if haircut not in known:
            raise RefusedError(
                400, "invalid_request", f"there is no haircut {haircut[:60]!r}; the haircuts are {', '.join(known)}"
            )
    if colour is not None:
        parse_hair_colour(colour[:60])


async def resolve_dictionary(library: Library, key: ApiKey, fields: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of a request with the path of their dictionary in place of its name; errors as `resolve_models`."""
    if fields.get(DICTIONARY) is None:
        return dict(fields)
    path, _ = await asyncio.to_thread(library.resolve, key, DICTIONARY, str(fields[DICTIONARY]))
    return {**fields, DICTIONARY: path}


def check_voice(voice: str | None) -> None:
    """Refuse voices that are not known by name."""
    if voice is not None:
        known = tuple(voice.name for voice in catalogue.voices() if voice.languages)
        if voice not in known:
            raise RefusedError(
                400, "invalid_request", f"there is no voice {voice[:60]!r}; the voices are {', '.join(known)}"
            )


def check_background(background: str) -> None:
    """Refuse backgrounds that are neither a word nor a colour."""
    if background not in {STUDIO, TRANSPARENT, BLUR, *COLOURS} and not COLOUR.fullmatch(background):
        raise RefusedError(
            400,
            "invalid_request",
            f"there is no background {background[:60]!r}; give studio, transparent, blur or #rrggbb",
        )


def _served_names(kind: str) -> tuple[str, ...]:
    return (*shipped_names(kind), *((OWN_FACE,) if kind == FACE else ()))
