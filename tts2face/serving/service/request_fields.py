"""Fields of requests over HTTP, made from the options of clips: types, defaults, limits, choices and help texts."""

from collections.abc import Mapping
from dataclasses import Field as Option
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, create_model

from tts2face.picture.options import Picture
from tts2face.request import Request, option_fields
from tts2face.session.named_models import Models

RECORDS = (Request, Models, Picture)
OPTIONS = {field.name: field for record in RECORDS for field in option_fields(record)}
MODEL_FIELDS, PICTURE_FIELDS = (frozenset(field.name for field in fields(record)) for record in (Models, Picture))
# What differs over HTTP: names of uploads and of lists in place of paths and commands, and limits for everybody's sake.
DESCRIPTIONS: Mapping[str, str] = MappingProxyType({
    "language": "Language of the text.",
    "voice": "A voice of GET /v1/voices.",
    "plain_delivery": "The style leaves rate and loudness of the voice unchanged.",
    "dictionary": "A dictionary of GET /v1/dictionaries.",
    "talker": "A talker of GET /v1/talkers.",
    "face": "A face of GET /v1/faces, or self.",
    "identity": "Identity preset of the face.",
    "hair": "Haircut of the face, or bald.",
    "hair_color": "Colour of the hair: a name or #rrggbb.",
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
    "idle": 2.5, "listen": 2.5, "gaze": "camera", "context": 3, "exemplars": 10, "audio_map": "network",
})  # fmt: skip


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
    has_example = name in EXAMPLES or option.default is None
    return Field(
        ge=low,
        le=high,
        description=description or DESCRIPTIONS.get(name) or option.metadata["help"],
        **{"examples": [EXAMPLES.get(name)] if has_example else None} | more,
    )


def _definition(option: "Option[Any]", kind: Any, default: Any) -> tuple[Any, Any]:
    """Type and default of a field; a model that is not named is the default one."""
    kinds = [str if part is Path else part for part in get_args(kind) or (kind,)]
    choices = option.metadata.get("choices")
    value: Any = Literal[choices] if choices else kinds[0]
    optional = value | None if NoneType in kinds or default is None else value
    return Annotated[optional, described(option.name)], default
