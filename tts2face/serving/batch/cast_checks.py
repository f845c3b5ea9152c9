"""Checks of names that a renderer would refuse segment by segment: voices, identities, haircuts and styles."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from lexicon.errors import InputError
from tts2face.articulation import NATURAL, parse_articulation
from tts2face.models.face_loading import load_face
from tts2face.models.face_names import BALD
from tts2face.models.palette_file import load_palette
from tts2face.request import OWN_FACE
from tts2face.session.catalogue import identities
from tts2face.session.named_models import Models
from tts2face.sound.voice_pool import find_voice
from tts2face.sound.voice_urls import is_voice_url
from tts2face.source_options import AUTO, is_auto


def check_names(models: Models, request: Mapping[str, Any]) -> None:
    """Refuse a voice, an identity, a haircut or a style that does not exist."""
    voice = request.get("voice")
    if voice not in (None, AUTO) and not is_voice_url(voice) and not str(voice).endswith(".onnx"):
        find_voice(str(voice))
    if models.identity is not None:
        known = _identities(models.face)
        if models.identity not in known:
            offered = ", ".join(known) or "none"
            raise InputError(f"the face {models.face} has no identity {models.identity!r}; it has {offered}")
    if models.hair not in (None, BALD) or models.hair_color is not None:
        _check_hair(models.face, models.hair, models.hair_color)
    if request.get("articulation") is not None:
        factor = parse_articulation(str(request["articulation"]))
        if models.face == OWN_FACE and factor != NATURAL:
            raise InputError("a talker's own face articulates as recorded; remove articulation, or choose another face")
    style = request.get("style")
    if style is not None and not is_auto(str(style)) and models.palette is not None:
        load_palette(models.palette).require(str(style))


@lru_cache(maxsize=64)
def _check_hair(face: str, hair: str | None, colour: str | None) -> None:
    if face == OWN_FACE:
        raise InputError("a talker's own face has no haircuts; remove hair and hair_color, or choose another face")
    load_face(face, hair=hair, hair_color=colour)


@lru_cache(maxsize=64)
def _identities(face: str) -> tuple[str, ...]:
    return () if face == OWN_FACE else tuple(identity.name for identity in identities(face))
