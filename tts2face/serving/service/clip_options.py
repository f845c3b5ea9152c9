"""Options of clips as fields of requests over HTTP: their types, limits and texts, and the values that they may have.

Fields are made from the options. Names stand for uploads and lists: a path from a client never reaches the file system.
"""

import asyncio
import re
from collections.abc import Mapping
from dataclasses import Field as Option
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, create_model

from lexicon.errors import InputError
from tts2face.models.face_names import default_face
from tts2face.models.named_colours import parse_hair_colour
from tts2face.picture.options import AUTO_SIZE, BLUR, COLOURS, STUDIO, TRANSPARENT, Picture, parse_size
from tts2face.request import OWN_FACE, Request, option_fields
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import Library, shipped_names
from tts2face.serving.work.resource_check import FACE, TEXT_KINDS
from tts2face.session import catalogue
from tts2face.session.encoded_stream import media_types
from tts2face.session.named_models import Models
from tts2face.source_options import AUTO

if TYPE_CHECKING:
    from tts2face.serving.service.state import ServiceState

RECORDS = (Request, Models, Picture)
OPTIONS = {field.name: field for record in RECORDS for field in option_fields(record)}
MODEL_FIELDS, PICTURE_FIELDS = (frozenset(field.name for field in fields(record)) for record in (Models, Picture))
# What differs over HTTP: names of uploads and of lists in place of paths and commands, and limits for everybody's sake.
DESCRIPTIONS: Mapping[str, str] = MappingProxyType({
    "language": "Language of the text.",
    "voice": "A voice of GET /v1/voices, or auto: the one that fits the face.",
    "plain_delivery": "The style leaves rate, pitch and loudness of the voice unchanged.",
    "dictionary": "A dictionary of GET /v1/dictionaries.",
    "text_marks": "A table of marks of GET /v1/text_marks.",
    "talker": "A talker of GET /v1/talkers.",
    "face": "A face of GET /v1/faces, or self.",
    "identity": "Identity preset of the face.",
    "hair": "Haircut of the face, or bald.",
    "hair_color": "Colour of the hair: a name or #rrggbb.",
    "person": "Sex and age of the person shown, to whom the voice is fitted: woman, man 70, girl.",
    "palette": "A palette of GET /v1/palettes.",
    "background": "studio, transparent, blur, or a colour.",
})  # fmt: skip
LIMITS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"seed": (0, 2**31 - 1), "idle": (0.1, 30), "listen": (0.1, 30)}
)
EXAMPLES: Mapping[str, Any] = MappingProxyType({
    "text": "Hello there.", "voice": "heart", "articulation": "clear", "style": "delighted", "gain": "head=1.5",
    "talker": "grid_s1", "face": "ada", "identity": "kofi", "hair": "long01", "hair_color": "brown",
    "palette": "starter", "size": "512x512", "background": "#204060", "quality": "draft", "expression": "happy=0.6",
    "person": "woman 70",
    "idle": 2.5, "listen": 2.5, "gaze": "camera", "context": 3, "exemplars": 10, "audio_map": "network",
    "language": "en-us", "markup": "auto", "rate": 1.0, "voice_pitch": 0.0, "voice_range": 1.0, "lead": 0.1,
    "plain_delivery": False, "spoken_mark": "auto", "volume": 1.0, "seed": 0, "fps": 30.0,
    "pitch": False, "camera": "front", "supersampling": 2, "visible_mark": False, "dictionary": None,
    "text_marks": None,
})  # fmt: skip
# Options that a door does not take, with the reason.
NOT_IN_CLIPS: Mapping[str, str] = MappingProxyType({
    "audio": "a part of the form", "partner": "a part of the form", "timeline": "a part of the form",
    "renderer": "the operator's machine draws",
})  # fmt: skip
COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")
MODEL_KINDS = ("talker", "face", "palette")


class StrictModel(BaseModel):
    """Fields of exactly these names and types."""

    model_config = ConfigDict(extra="forbid", strict=True)


def options_model(name: str, left_out: Mapping[str, str]) -> type[StrictModel]:
    """Model of all options of clips but those that are left out, each with the reason."""
    taken = {
        field.name: _definition(field, field.type, None if record is Models else field.default)
        for record in RECORDS
        for field in option_fields(record)
        if field.name not in left_out
    }
    return create_model(name, __base__=StrictModel, **taken)  # type: ignore[call-overload, no-any-return]


def described(name: str, description: str = "", **more: Any) -> Any:
    """Limits, examples and text of an option, for a field that may have another name, another text, and more limits."""
    option = OPTIONS[name]
    low, high = LIMITS.get(name) or option.metadata.get("limits") or (None, None)
    return Field(
        ge=low,
        le=high,
        description=description or DESCRIPTIONS.get(name) or option.metadata["help"],
        **{"examples": [EXAMPLES[name]] if name in EXAMPLES else None} | more,
    )


def _definition(option: "Option[Any]", kind: Any, default: Any) -> tuple[Any, Any]:
    """Type and default of a field; a model that is not named is the default one."""
    kinds = [str if part is Path else part for part in get_args(kind) or (kind,)]
    choices = option.metadata.get("choices")
    value: Any = Literal[choices] if choices else kinds[0]
    optional = value | None if NoneType in kinds or default is None else value
    return Annotated[optional, described(option.name)], default


if TYPE_CHECKING:
    ClipFields = StrictModel
    Format = str
else:
    Format = Literal[tuple(media_types())]
    ClipFields = options_model("ClipFields", NOT_IN_CLIPS)


class ClipRequest(ClipFields):
    """What is said, how the face moves and how it is drawn; meanings as of the flags of the command line."""

    format: Annotated[Format, Field(description="Movie, sound, or lines.")] = "mp4"


@dataclass(frozen=True, slots=True)
class OptionValues:
    """Values of options by what takes them: models, `Request`, `Picture`."""

    models: dict[str, Any]
    request: dict[str, Any]
    picture: dict[str, Any]


async def divide_options(state: "ServiceState", key: ApiKey, given: dict[str, Any]) -> OptionValues:
    """Divide options that differ from their defaults; names of uploads become paths."""
    models = {name: value for name, value in given.items() if name in MODEL_FIELDS}
    picture = {name: value for name, value in given.items() if name in PICTURE_FIELDS}
    request = {name: value for name, value in given.items() if name not in {*models, *picture}}
    models = await resolve_models(state.library, key, models)
    request = await resolve_texts(state.library, key, request)
    check_voice(request.get("voice"))
    check_background(picture.get("background", "studio"))
    _check_size(picture.get("size", AUTO_SIZE), state.settings.pixels)
    return OptionValues(models, request, picture)


def _check_size(size: str, most: int) -> None:
    """Refuse pictures that are larger than the settings allow."""
    try:
        width, height = parse_size(size)
    except InputError as wrong:
        raise RefusedError(400, "invalid_request", str(wrong)) from wrong
    if width * height > most:
        raise RefusedError(400, "invalid_request", f"size {size[:20]} has more than {most} pixels; give a smaller one")


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


async def resolve_texts(library: Library, key: ApiKey, fields: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of a request with the paths of its dictionary and its marks, not names; errors as `resolve_models`."""
    resolved = dict(fields)
    for kind in TEXT_KINDS & {name for name, value in fields.items() if value is not None}:
        resolved[kind], _ = await asyncio.to_thread(library.resolve, key, kind, str(fields[kind]))
    return resolved


def check_voice(voice: str | None) -> None:
    """Refuse voices that are not known by name."""
    if voice not in (None, AUTO):
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
