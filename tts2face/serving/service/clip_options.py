"""Options of clips as fields of requests over HTTP, and their values by what takes them."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from lexicon.errors import InputError
from tts2face.picture.options import AUTO_SIZE, parse_size
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.named_values import check_background, check_voice, resolve_dictionary, resolve_models
from tts2face.serving.service.request_fields import MODEL_FIELDS, PICTURE_FIELDS, options_model
from tts2face.serving.service.state import ServiceState
from tts2face.session.encoded_stream import media_types

# Options that a door does not take, with the reason.
NOT_IN_CLIPS: Mapping[str, str] = MappingProxyType({
    "audio": "a part of the form", "partner": "a part of the form", "timeline": "a part of the form",
    "renderer": "the operator's machine draws",
})  # fmt: skip


if TYPE_CHECKING:
    from tts2face.serving.service.request_fields import StrictModel as ClipFields

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


async def divide_options(state: ServiceState, key: ApiKey, given: dict[str, Any]) -> OptionValues:
    """Divide options that differ from their defaults; names of uploads become paths."""
    models = {name: value for name, value in given.items() if name in MODEL_FIELDS}
    picture = {name: value for name, value in given.items() if name in PICTURE_FIELDS}
    request = {name: value for name, value in given.items() if name not in {*models, *picture}}
    models = await resolve_models(state.library, key, models)
    request = await resolve_dictionary(state.library, key, request)
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
