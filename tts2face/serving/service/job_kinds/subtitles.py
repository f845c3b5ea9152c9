"""Jobs of kind ``subtitles``: their options, their files, and the checks before they are queued."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field
from starlette.datastructures import UploadFile

from lexicon.errors import DataError
from lexicon.values.checks import check_limits
from lexicon.values.toml_text import parse_toml
from tts2face.interchange.subtitles.formats import SUFFIXES
from tts2face.interchange.subtitles.frames import RATE_LIMITS
from tts2face.interchange.subtitles.options import MAX_SHIFT_S
from tts2face.interchange.subtitles.unspoken import KINDS
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.serving.batch.cast import MODEL_NAMES, cast_from_tables
from tts2face.serving.batch.lines import read_lines
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.service.clip_options import (
    NOT_IN_CLIPS,
    check_voice,
    divide_options,
    options_model,
    resolve_models,
    resolve_texts,
)
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.job_kinds.clip import add_background
from tts2face.serving.service.job_kinds.order import FormPart, JobKind, JobOrder, refuse_second
from tts2face.serving.work.subtitles_job import LINES

BATCH_FIELDS = tuple(
    field.name for field in fields(BatchOptions) if field.name != "audio"
)  # which is a part of the form
MAX_CAST_CHARACTERS = 1_000_000
# Options of clips that subtitles do not take, with the reason.
NOT_IN_SUBTITLES: Mapping[str, str] = NOT_IN_CLIPS | MappingProxyType({
    "text": "the cues have it", "idle": "cues speak", "listen": "cues speak",
    "expression": "its times are those of one clip", "audio_map": "the words of recordings are given",
})  # fmt: skip


if TYPE_CHECKING:
    from tts2face.serving.service.clip_options import StrictModel as SubtitleFields
else:
    SubtitleFields = options_model("SubtitleFields", NOT_IN_SUBTITLES)


class SubtitlesRequest(SubtitleFields):
    """How subtitle files become clips; meanings as of the flags of `tts2face batch`."""

    per: Annotated[Literal["cue", "scene", "file", "film"], Field(description="What becomes one clip.")] = "cue"
    overflow: Annotated[
        Literal["extend", "cut-pauses", "report"], Field(description="For speech that is longer than its cue.")
    ] = "extend"
    max_rate: Annotated[
        float, Field(ge=1, le=2, description="Largest rate by which speech is fitted.", examples=[1.4])
    ] = 1.4
    min_rate: Annotated[
        float, Field(ge=0.5, le=1, description="Smallest rate to which short speech is slowed.", examples=[1.0])
    ] = 1.0
    max_overlap: Annotated[
        float,
        Field(ge=0, le=2, description="Seconds by which last words may sound on into the next cue.", examples=[0.3]),
    ] = 0.3
    scene_gap: Annotated[
        float, Field(gt=0, le=3600, description="Seconds without a cue that divide scenes.", examples=[4.0])
    ] = 4.0
    format: Annotated[Literal["mp4", "webm", "mov", "none"], Field(description="Videos; none: only exports.")] = "mp4"
    exports: Annotated[
        tuple[str, ...],
        Field(max_length=20, strict=False, description="Files for other programs by ending.", examples=[["glb"]]),
    ] = ()
    encoding: Annotated[
        str | None,
        Field(
            pattern="^[A-Za-z0-9_.:-]{1,40}$",
            description="Encoding of subtitles that are not UTF-8; by default guessed, by the language if given.",
            examples=["windows-1252"],
        ),
    ] = None
    keep: Annotated[
        tuple[Literal["annotations", "lyrics", "signs", "effects", "credits", "repeats"], ...],
        Field(
            max_length=len(KINDS),
            strict=False,
            description="Kinds of what subtitles show and nobody says, to be spoken nevertheless.",
            examples=[["signs"]],
        ),
    ] = ()
    speakers: Annotated[
        bool, Field(description="Names before a colon are speakers; else they are words.", examples=[True])
    ] = True
    subtitle_fps: Annotated[
        float | None,
        Field(
            ge=RATE_LIMITS[0],
            le=RATE_LIMITS[1],
            description="Frames a second of times that are frames.",
            examples=[25.0],
        ),
    ] = None
    track: Annotated[
        str | None,
        Field(
            max_length=40,
            description="Subtitle track of a film, by number or language; class of a SAMI file.",
            examples=["en"],
        ),
    ] = None
    shift: Annotated[
        float,
        Field(ge=-MAX_SHIFT_S, le=MAX_SHIFT_S, description="Seconds that are added to all times.", examples=[-3600.0]),
    ] = 0.0
    cast: Annotated[
        dict[str, Any] | str | None,
        Field(
            description="Speakers with their models and voices: the tables of a cast file as JSON, or its TOML.",
            examples=[{"role": [{"speaker": "ANN", "identity": "kofi"}]}],
        ),
    ] = None


async def add_lines(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Note the table of lines, which is checked when the subtitles are known."""
    refuse_second(part, number)
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
    if numbers["seconds"] + order.options.shift > settings.job_s:
        raise RefusedError(413, "too_large", f"{name} is longer than {settings.job_s:g} s; divide it")
    order.upload.files[f"{name}{path.suffix}"] = path


async def add_track(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note the recording of a whole subtitle file."""
    if number > order.state.settings.job_files:
        raise RefusedError(413, "too_large", f"there are more than {order.state.settings.job_files} recordings")
    order.upload.files[f"subtitles-{number:03d}.wav"] = await order.upload.folder.sound(f"{part}-{number:03d}", file)


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
    work = order.state.results.work(models=fields.models, request=fields.request, picture=fields.picture)
    tables = _cast_tables(cast)
    resolved = [await _resolve_role(order, role) for role in (tables.get("default", {}), *tables.get("role", []))]
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
    for settings in lines.settings.values():
        check_voice(settings.voice)


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
    return {**await resolve_texts(order.state.library, order.key, settings), **models}


SUBTITLES_KIND = JobKind(
    "speak",
    SubtitlesRequest,
    {
        "subtitles": FormPart(
            "Subtitle files (SubRip, WebVTT, ASS, TTML, ...) or films with subtitles; one or several.",
            add_subtitles,
            is_list=True,
        ),
        "audio": FormPart(
            "A recording of each subtitle file in place of a voice, in the same order.", add_track, is_list=True
        ),
        "background": FormPart("Picture behind the face.", add_background),
        "lines": FormPart("Table of rate, voice and offset of single lines, CSV.", add_lines),
    },
    prepare_subtitles,
)
