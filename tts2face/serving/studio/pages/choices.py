"""Choices of a person in a project: voices, languages, models, styles with their colours."""

import asyncio
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import lru_cache

from lexicon.errors import Tts2faceError
from tts2face.request import OWN_FACE
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import Library, shipped_names
from tts2face.serving.work.resource_check import FACE, PALETTE
from tts2face.session import catalogue
from tts2face.source_options import AUTO_STYLE
from tts2face.storage.shipped import find_file

# Of styles in their order: far apart in hue and lightness also for colour-blind people (Okabe and Ito 2008, extended).
COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#7f3fbf", "#b5bd00", "#5d6d7e",
    "#c0392b", "#17706e",
)  # fmt: skip


@lru_cache(maxsize=1)
def voices() -> dict[str, str]:
    """Voices by name with what is said of them; the empty one is the one that fits the face."""
    found = {
        voice.name: f"{voice.name} - {voice.summary}"
        for voice in catalogue.voices()
        if voice.languages and voice.is_installed
    }
    return {"": "the one that fits the face", **found}


@lru_cache(maxsize=1)
def languages() -> dict[str, str]:
    """Languages by code."""
    return {language.code: f"{language.name} ({language.code})" for language in catalogue.languages()}


def _haircuts(face: str) -> dict[str, str]:
    return {haircut.name: f"{haircut.name} - {haircut.summary}" for haircut in catalogue.haircuts_of(face)}


@lru_cache(maxsize=1)
def _hair_colours() -> dict[str, str]:
    return {color.name: color.name for color in catalogue.hair_colors()}


async def models(library: Library, key: ApiKey, kind: str) -> list[str]:
    """Names of the shipped models of a kind and of those that a key has uploaded."""
    own = await asyncio.to_thread(library.uploads, kind, key.name)
    more = [OWN_FACE] if kind == FACE else []
    return [*shipped_names(kind), *more, *(uploaded.name for uploaded in own)]


async def appearance(library: Library, key: ApiKey, face: str) -> dict[str, dict[str, str]]:
    """Identities, haircuts and hair colours of a face by the names of the options; the empty one is its own."""
    names: tuple[str, ...] = ()
    takes_haircuts = False
    if face in shipped_names(FACE):
        entry = await asyncio.to_thread(catalogue.describe_face, find_file(face, FACE))
        names, takes_haircuts = entry.identities, entry.takes_haircuts
    elif face != OWN_FACE:
        with suppress(RefusedError):  # the face has been deleted; the preview says so
            about = (await asyncio.to_thread(library.resolve, key, FACE, face))[1]
            names, takes_haircuts = tuple(about["identities"]), about.get("takes_haircuts", True)
    own = {"": "as the face"}
    return {
        "identity": own | {name: name for name in names},
        "hair": own | (_haircuts(face) if takes_haircuts else {}),
        "hair_color": own | (_hair_colours() if takes_haircuts else {}),
    }


def style_options(found: Iterable[Mapping[str, str]]) -> dict[str, str]:
    """Styles of a whole clip by name, with what is said of them; the empty one is the palette's first."""
    named = {style["name"]: f"{style['name']} - {style['summary']}" for style in found}
    return {"": "the palette's first", AUTO_STYLE: "auto - by the words of each sentence", **named}


async def styles(library: Library, key: ApiKey, palette: str | None) -> list[dict[str, str]]:
    """Styles of a palette with a colour for each; none without a palette, or if it has been deleted."""
    if palette is None:
        return []
    try:
        path = palette  # the own palette is given as its path, which no client can choose
        # a path is the own palette (decision 151)
        if palette not in shipped_names(PALETTE) and os.sep not in palette:
            path, _ = await asyncio.to_thread(library.resolve, key, PALETTE, palette)
        found = await asyncio.to_thread(catalogue.styles, path)
    except (RefusedError, Tts2faceError):
        return []
    return [
        {"name": style.name, "color": COLOURS[number % len(COLOURS)], "summary": style.summary}
        for number, style in enumerate(found)
    ]
