"""Options of clips, of a text or of subtitles.

Kinds of jobs as clients ask for them: their options, their files, and the checks before they are queued.

`tts2face.serving.work.kinds` executes them.

OpenAPI description of the body of a new job, made of the kinds of jobs.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field
from starlette.datastructures import UploadFile

from lexicon.errors import DataError, InputError
from lexicon.values.checks import check_limits
from lexicon.values.toml_text import parse_toml
from tts2face.interchange.subtitles.reader import SUFFIXES
from tts2face.picture.options import AUTO_SIZE, Picture, parse_size
from tts2face.request import Request
from tts2face.serving.batch.cast import MODEL_NAMES, cast_from_tables
from tts2face.serving.batch.lines import read_lines
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import check_background, check_voice, resolve_dictionary, resolve_models
from tts2face.serving.service.orders import TALKER_KIND, JobKind, JobOrder
from tts2face.serving.service.request_fields import MODEL_FIELDS, PICTURE_FIELDS, options_model
from tts2face.serving.service.state import ServiceState
from tts2face.serving.work.clip_job import BACKGROUND, FILES
from tts2face.serving.work.resource_check import TALKER
from tts2face.serving.work.subtitles_job import LINES
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
    return OptionValues(models, request, picture)


def _check_size(size: str, most: int) -> None:
    """Refuse pictures that are larger than the settings allow."""
    try:
        width, height = parse_size(size)
    except InputError as wrong:
        raise RefusedError(400, "invalid_request", str(wrong)) from wrong
    if width * height > most:
        raise RefusedError(400, "invalid_request", f"size {size[:20]} has more than {most} pixels; give a smaller one")


BATCH_FIELDS = tuple(one.name for one in fields(BatchOptions) if one.name != "audio")  # which is a part of the form
MAX_CAST_CHARACTERS = 1_000_000


# Options of clips that subtitles do not take, with the reason.
NOT_IN_SUBTITLES: Mapping[str, str] = NOT_IN_CLIPS | MappingProxyType({
    "text": "the cues have it", "idle": "cues speak", "listen": "cues speak",
    "expression": "its times are those of one clip", "audio_map": "the words of recordings are given",
})  # fmt: skip
if TYPE_CHECKING:
    from tts2face.serving.service.request_fields import StrictModel as SubtitleFields
else:
    SubtitleFields = options_model("SubtitleFields", NOT_IN_SUBTITLES)


class SubtitlesRequest(SubtitleFields):
    """How subtitle files become clips; meanings as of the flags of `tts2face batch`."""

    per: Annotated[Literal["cue", "scene", "file", "film"], Field(description="What becomes one clip.")] = "cue"
    overflow: Annotated[
        Literal["extend", "cut-pauses", "report"], Field(description="For speech that is longer than its cue.")
    ] = "extend"
    max_rate: Annotated[float, Field(ge=1, le=2, description="Largest rate by which speech is fitted.")] = 1.4
    min_rate: Annotated[float, Field(ge=0.5, le=1, description="Smallest rate to which short speech is slowed.")] = 1.0
    max_overlap: Annotated[
        float, Field(ge=0, le=2, description="Seconds by which last words may sound on into the next cue.")
    ] = 0.3
    scene_gap: Annotated[float, Field(gt=0, le=3600, description="Seconds without a cue that divide scenes.")] = 4.0
    format: Annotated[Literal["mp4", "webm", "mov", "none"], Field(description="Videos; none: only exports.")] = "mp4"
    exports: Annotated[
        tuple[str, ...],
        Field(max_length=20, strict=False, description="Files for other programs by ending.", examples=[["glb"]]),
    ] = ()
    encoding: Annotated[
        str | None,
        Field(
            pattern="^[A-Za-z0-9_.:-]{1,40}$",
            description="Encoding of subtitles that are not UTF-8.",
            examples=["windows-1252"],
        ),
    ] = None
    cast: Annotated[
        dict[str, Any] | str | None,
        Field(
            description="Speakers with their models and voices: the tables of a cast file as JSON, or its TOML.",
            examples=[{"role": [{"speaker": "ANN", "identity": "kofi"}]}],
        ),
    ] = None


async def add_background(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note a background picture."""
    _refuse_second(part, number)
    order.upload.files[BACKGROUND] = await order.upload.folder.picture(part, file)


async def add_clip_file(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note the recording or the timeline of a clip."""
    _refuse_second(part, number)
    folder = order.upload.folder
    made = await folder.sound(part, file) if FILES[part].endswith(".wav") else await folder.text(part, file, ".json")
    order.upload.files[FILES[part]] = made


async def add_lines(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Note the table of lines, which is checked when the subtitles are known."""
    _refuse_second(part, number)
    order.upload.files[LINES] = await order.upload.folder.text(part, file, ".csv")


async def add_subtitles(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note a subtitle file."""
    settings, suffix = order.state.settings, Path(file.filename or "").suffix.lower()
    if number > settings.job_files:
        raise RefusedError(413, "too_large", f"there are more than {settings.job_files} subtitle files; send less")
    name = f"{part}-{number:03d}"
    path, numbers = await order.upload.folder.subtitles(
        name, file, suffix if suffix in SUFFIXES else ".srt", order.options.encoding, settings.job_cues
    )
    order.upload.n_cues += int(numbers["cues"])
    if order.upload.n_cues > settings.job_cues:
        raise RefusedError(413, "too_large", f"the files have more than {settings.job_cues} cues; divide them")
    if numbers["seconds"] > settings.job_s:
        raise RefusedError(413, "too_large", f"{name} is longer than {settings.job_s:g} s; divide it")
    order.upload.files[f"{name}{path.suffix}"] = path


async def add_track(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note the recording of a whole subtitle file."""
    if number > order.state.settings.job_files:
        raise RefusedError(413, "too_large", f"there are more than {order.state.settings.job_files} recordings")
    order.upload.files[f"subtitles-{number:03d}.wav"] = await order.upload.folder.sound(f"{part}-{number:03d}", file)


async def prepare_clip(order: JobOrder) -> dict[str, Any]:
    """JSON of a job of kind ``clip``.

    Raises
    ------
    InputError, RefusedError
        An option is wrong.
    """
    given: dict[str, Any] = order.options.model_dump(exclude_none=True, exclude_defaults=True)
    format = given.pop("format", ClipRequest.model_fields["format"].default)
    fields = await divide_options(order.state, order.key, given)
    order.state.check_length(given.get("text", ""))
    has_audio = FILES["audio"] in order.upload.files
    if not (given.get("text", "").strip() or has_audio or "idle" in given or "listen" in given):
        raise RefusedError(400, "invalid_request", "there is nothing to say; give text, audio, idle or listen")
    sounds = {name: Path(file) for name, file in FILES.items() if name != "timeline" and file in order.upload.files}
    Request(**fields.request | sounds)
    Picture(**fields.picture)
    work = order.state.work(models=fields.models, request=fields.request, picture=fields.picture, format=format)
    return work.as_json()


async def prepare_subtitles(order: JobOrder) -> dict[str, Any]:
    """JSON of a job of kind ``subtitles``; errors as `prepare_clip`."""
    given: dict[str, Any] = order.options.model_dump(exclude_none=True, exclude_defaults=True)
    cast = given.pop("cast", {})
    options: dict[str, Any] = {name: given.pop(name) for name in BATCH_FIELDS if name in given}
    subtitles = sorted(name for name in order.upload.files if Path(name).suffix in SUFFIXES)
    n_tracks = sum(name.endswith(".wav") for name in order.upload.files)
    if not subtitles:
        raise RefusedError(422, "invalid_request", "there are no subtitles; send them as parts `subtitles` of a form")
    if n_tracks not in {0, len(subtitles)}:
        raise RefusedError(
            422,
            "invalid_request",
            f"there are {n_tracks} recordings of {len(subtitles)} subtitle files; send one of each",
        )
    BatchOptions(**options)
    if LINES in order.upload.files:
        _check_lines(order.upload.files[LINES], [Path(name).stem for name in subtitles])
    fields = await divide_options(order.state, order.key, given)
    Request(**fields.request)
    picture = Picture(**fields.picture)
    if picture.is_transparent and options.get("format", "mp4") in {"mp4", "mov"}:
        raise RefusedError(400, "invalid_request", "mp4 and mov have no transparency; choose webm")
    work = order.state.work(models=fields.models, request=fields.request, picture=fields.picture)
    tables = _cast_tables(cast)
    resolved = [await _resolve_role(order, one) for one in (tables.get("default", {}), *tables.get("role", []))]
    return {
        **{name: value for name, value in work.as_json().items() if name in {"models", "request", "picture"}},
        "options": options,
        "subtitles": subtitles,
        "has_audio": n_tracks > 0,
        "cast": {"default": resolved[0], "role": resolved[1:]},
    }


def _check_lines(table: Path, names: Sequence[str]) -> None:
    """Refuse a table of lines that cannot be used, and voices that are not known by name."""
    try:
        lines = read_lines(table, names)
    except DataError as wrong:
        raise RefusedError(422, "invalid_request", str(wrong).replace(str(table), "lines")) from wrong
    for one in lines.settings.values():
        check_voice(one.voice)


def _cast_tables(cast: dict[str, Any] | str) -> dict[str, Any]:
    """Tables of a cast after their check."""
    if isinstance(cast, str):
        check_limits("characters of cast", len(cast), (0, MAX_CAST_CHARACTERS))
        cast = parse_toml(cast, "cast")
    cast_from_tables(cast, "the cast")
    return cast


async def _resolve_role(order: JobOrder, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of a role with the paths of uploads in place of their names."""
    named = {name: settings[name] for name in MODEL_NAMES if name in settings}
    models = await resolve_models(order.state.library, order.key, named)
    check_voice(settings.get("voice"))
    return {**await resolve_dictionary(order.state.library, order.key, settings), **models}


def _refuse_second(part: str, number: int) -> None:
    if number > 1:
        raise RefusedError(422, "invalid_request", f"{part} was sent twice; send one")


JOB_KINDS: dict[str, JobKind] = {
    "clip": JobKind(
        "speak",
        ClipRequest,
        {
            "audio": ("Speech in place of a voice.", add_clip_file),
            "background": ("Picture behind the face.", add_background),
            "partner": ("Sound that the face listens to.", add_clip_file),
            "timeline": ("Timeline of gestures, JSON.", add_clip_file),
        },
        prepare_clip,
    ),
    "subtitles": JobKind(
        "speak",
        SubtitlesRequest,
        {
            "subtitles": ("Subtitle files: SubRip, WebVTT, ASS, TTML; one or several.", add_subtitles),
            "audio": ("A recording of each subtitle file in place of a voice, in the same order.", add_track),
            "background": ("Picture behind the face.", add_background),
            "lines": ("Table of rate, voice and offset of single lines, CSV.", add_lines),
        },
        prepare_subtitles,
    ),
    "talker": TALKER_KIND,
}


def new_job_schema(names: Sequence[str]) -> dict[str, Any]:
    """Body of a new job of some kinds for the OpenAPI description: as JSON, or as a form with files."""
    schemas = [_kind_schema(name) for name in names]
    parts: dict[str, Any] = {
        "job": {
            "type": "string",
            "description": "The job as JSON: kind, request, webhook.",
            "examples": [json.dumps({"kind": names[0], "request": {}})],
        }
    }
    for kind in (JOB_KINDS[name] for name in names):
        for part, (text, _) in kind.parts.items():
            file = {"type": "string", "format": "binary"}
            several = {"type": "array", "items": file} if part in {"subtitles", "audio"} else file
            parts.setdefault(part, {**several, "description": text})
    form = {"multipart/form-data": {"schema": {"type": "object", "required": ["job"], "properties": parts}}}
    if all(name == TALKER for name in names):  # nothing without files
        return {"description": "A form with a job and its files.", "required": True, "content": form}
    return {
        "description": "A job as JSON; or a form whose part `job` holds it, with files.",
        "required": True,
        "content": {
            "application/json": {
                "schema": {"oneOf": schemas},
                "example": {"kind": "clip", "request": {"text": "Hello there.", "format": "mp4"}},
            },
            **form,
        },
    }


def _kind_schema(name: str) -> dict[str, Any]:
    return {
        "type": "object",
        "title": f"Job of kind {name}",
        "required": ["kind"],
        "additionalProperties": False,
        "properties": {
            "kind": {"const": name, "description": "Kind of the job."},
            "request": JOB_KINDS[name].model.model_json_schema(),
            "webhook": {
                "type": ["string", "null"],
                "maxLength": 2000,
                "description": "URL, of a host in the setting webhook_hosts, that learns of the end of the job.",
                "examples": ["https://example.org/done"],
            },
        },
    }
