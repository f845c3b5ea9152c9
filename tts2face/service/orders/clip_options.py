"""Options of clips, of a text or of subtitles."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from lexicon.errors import InputError
from tts2face.render.picture import AUTO_SIZE, Picture, parse_size
from tts2face.service.access.keys import ApiKey
from tts2face.service.errors import RefusedError
from tts2face.service.state import ServiceState
from tts2face.service.uploads.names import (
    MODEL_FIELDS,
    check_background,
    check_voice,
    resolve_dictionary,
    resolve_models,
)
from tts2face.synthesis.byte_stream import media_types

if TYPE_CHECKING:
    Format = str
else:
    Format = Literal[tuple(media_types())]
PICTURE_FIELDS = frozenset(option.name for option in fields(Picture))


class ClipOptions(BaseModel):
    """How it is said, how the face moves and how it is drawn; meanings as of the flags of the command line."""

    model_config = ConfigDict(extra="forbid", strict=True)

    language: Annotated[str, Field(description="Language of the text.")] = "en-us"
    voice: Annotated[str | None, Field(description="A voice of GET /v1/voices.", examples=["heart"])] = None
    rate: Annotated[float, Field(ge=0.5, le=2.0, description="Factor of the speaking rate.")] = 1.0
    volume: Annotated[float, Field(ge=0.0, le=2.0, description="Factor of the loudness.")] = 1.0
    plain_delivery: Annotated[bool, Field(description="The style leaves rate and loudness of the voice unchanged.")] = (
        False
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1, description="Seed of gestures and voice.")] = 0
    synthesis: Annotated[Literal["exemplar", "theobald2007"], Field(description="Method of lip motion.")] = "exemplar"
    articulation: Annotated[
        str | None, Field(description="Rounding, spreading, opening: natural, clear, or 0.5-2.", examples=["clear"])
    ] = None
    fps: Annotated[float, Field(ge=1, le=120, description="Frames per second.")] = 30.0
    gestures: Annotated[Literal["fields", "ju2008", "noise", "none"], Field(description="Method of gestures.")] = (
        "fields"
    )
    style: Annotated[str | None, Field(description="Style of the palette.", examples=["delighted"])] = None
    gain: Annotated[str | None, Field(description="Gains of features.", examples=["head=1.5"])] = None
    talker: Annotated[str | None, Field(description="A talker of GET /v1/talkers.", examples=["grid_s1"])] = None
    face: Annotated[str | None, Field(description="A face of GET /v1/faces, or self.", examples=["ada"])] = None
    identity: Annotated[str | None, Field(description="Identity preset of the face.", examples=["kofi"])] = None
    hair: Annotated[str | None, Field(description="Haircut of the face, or bald.", examples=["long01"])] = None
    hair_color: Annotated[
        str | None, Field(description="Colour of the hair: a name or #rrggbb.", examples=["brown"])
    ] = None
    palette: Annotated[str | None, Field(description="A palette of GET /v1/palettes.", examples=["starter"])] = None
    dictionary: Annotated[str | None, Field(description="A dictionary of GET /v1/dictionaries.", examples=[None])] = (
        None
    )
    size: Annotated[str, Field(description="Width x height in pixels.", examples=["512x512"])] = "auto"
    camera: Annotated[str, Field(description="front, three-quarter, profile, close, or yaw,pitch.")] = "front"
    background: Annotated[str, Field(description="studio, transparent, blur, or a colour.", examples=["#204060"])] = (
        "studio"
    )
    supersampling: Annotated[int, Field(ge=1, le=3, description="Samples along each side of a pixel.")] = 2
    quality: Annotated[str, Field(description="draft, standard or high.", examples=["draft"])] = "standard"
    visible_mark: Annotated[bool, Field(description="Write the word synthetic into the lower right corner.")] = False


class ClipRequest(ClipOptions):
    """What is said, how the face moves and how it is drawn; meanings as of the flags of the command line."""

    text: Annotated[str, Field(description="Text, with marks or SSML.", examples=["Hello there."])] = ""
    format: Annotated[Format, Field(description="Movie, sound, or lines.")] = "mp4"
    expression: Annotated[str | None, Field(description="Expressions with times.", examples=["happy=0.6"])] = None
    idle: Annotated[
        float | None, Field(ge=0.1, le=30, description="Seconds of idle animation, no speech.", examples=[2.5])
    ] = None


@dataclass(frozen=True, slots=True)
class Fields:
    """Values of options by what takes them: models, `Request`, `Picture`."""

    models: dict[str, Any]
    request: dict[str, Any]
    picture: dict[str, Any]


async def divide_options(state: ServiceState, key: ApiKey, given: dict[str, Any]) -> Fields:
    """Divide options that differ from their defaults; names of uploads become paths.

    Raises
    ------
    RefusedError
        A model, voice or background does not exist for the key.
    """
    models = {name: value for name, value in given.items() if name in MODEL_FIELDS}
    picture = {name: value for name, value in given.items() if name in PICTURE_FIELDS}
    request = {name: value for name, value in given.items() if name not in {*models, *picture}}
    models = await resolve_models(state.library, key, models)
    request = await resolve_dictionary(state.library, key, request)
    check_voice(request.get("voice"))
    check_background(picture.get("background", "studio"))
    _check_size(picture.get("size", AUTO_SIZE), state.settings.pixels)
    return Fields(models, request, picture)


def _check_size(size: str, most: int) -> None:
    """Refuse pictures that are larger than the settings allow."""
    try:
        width, height = parse_size(size)
    except InputError as wrong:
        raise RefusedError(400, "invalid_request", str(wrong)) from wrong
    if width * height > most:
        raise RefusedError(400, "invalid_request", f"size {size[:20]} has more than {most} pixels; give a smaller one")
