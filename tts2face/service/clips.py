"""Clips with all options of a request and of its picture."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import StreamingResponse
from pydantic import BaseModel, ConfigDict, Field

from tts2face.service.answers import service_state, stream_work
from tts2face.service.names import check_background, check_models, check_voice
from tts2face.synthesis.byte_stream import MEDIA_TYPES

router = APIRouter(prefix="/v1", tags=["clips"])

MODEL_FIELDS = ("talker", "face", "identity", "palette")
PICTURE_FIELDS = ("size", "camera", "background", "supersampling")
Format = Literal["mp4", "webm", "mp3", "opus", "aac", "flac", "wav", "pcm", "curves", "oculus", "azure", "livelink"]


class ClipRequest(BaseModel):
    """What is said, how the face moves and how it is drawn; meanings as of the flags of the command line."""

    model_config = ConfigDict(extra="forbid", strict=True)

    text: Annotated[str, Field(description="Text, with marks or SSML.", examples=["Hello there."])] = ""
    format: Annotated[Format, Field(description="Movie, sound, or lines.")] = "mp4"
    language: Annotated[str, Field(description="Language of the text.")] = "en-us"
    voice: Annotated[str | None, Field(description="A voice of GET /v1/voices.")] = None
    rate: Annotated[float, Field(ge=0.5, le=2.0, description="Factor of the speaking rate.")] = 1.0
    volume: Annotated[float, Field(ge=0.0, le=2.0, description="Factor of the loudness.")] = 1.0
    seed: Annotated[int, Field(ge=0, le=2**31 - 1, description="Seed of gestures and voice.")] = 0
    synthesis: Annotated[Literal["exemplar", "theobald2007"], Field(description="Method of lip motion.")] = "exemplar"
    fps: Annotated[float, Field(ge=1, le=120, description="Frames per second.")] = 30.0
    gestures: Annotated[Literal["fields", "ju2008", "noise", "none"], Field(description="Method of gestures.")] = (
        "fields"
    )
    style: Annotated[str | None, Field(description="Style of the palette.", examples=["delighted"])] = None
    gain: Annotated[str | None, Field(description="Gains of features.", examples=["head=1.5"])] = None
    expression: Annotated[str | None, Field(description="Expressions with times.", examples=["happy=0.6"])] = None
    idle: Annotated[float | None, Field(ge=0.1, le=3600, description="Seconds of idle animation, no speech.")] = None
    talker: Annotated[str | None, Field(description="A talker of GET /v1/talkers.")] = None
    face: Annotated[str | None, Field(description="A face of GET /v1/faces, or self.")] = None
    identity: Annotated[str | None, Field(description="Identity preset of the face.")] = None
    palette: Annotated[str | None, Field(description="A palette of GET /v1/palettes.")] = None
    size: Annotated[str, Field(description="Width x height in pixels.", examples=["512x512"])] = "auto"
    camera: Annotated[str, Field(description="front, three-quarter, profile, close, or yaw,pitch.")] = "front"
    background: Annotated[str, Field(description="studio, transparent, or a colour.", examples=["#204060"])] = "studio"
    supersampling: Annotated[int, Field(ge=1, le=3, description="Samples along each side of a pixel.")] = 2


@router.post("/clips", response_class=StreamingResponse, summary="Make a clip")
async def make_clip(request: HttpRequest, clip: ClipRequest) -> StreamingResponse:
    """The clip of a text as fragmented MP4, WebM, sound, or lines of curves, sent while it is made."""
    given: dict[str, Any] = clip.model_dump(exclude_none=True, exclude_defaults=True)
    format = given.pop("format", "mp4")
    models = {name: given.pop(name) for name in MODEL_FIELDS if name in given}
    picture = {name: given.pop(name) for name in PICTURE_FIELDS if name in given}
    check_models(models)
    check_voice(given.get("voice"))
    check_background(picture.get("background", "studio"))
    work = service_state(request).work(models=models, request=given, picture=picture, format=format)
    return await stream_work(request, work, MEDIA_TYPES[format])
