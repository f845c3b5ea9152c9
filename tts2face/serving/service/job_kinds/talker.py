"""Jobs of kind ``talker``: what clients send, and the checks before they are queued."""

import asyncio
import uuid
from dataclasses import asdict
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field
from starlette.datastructures import UploadFile

from tts2face.models.consent import EXAMPLE, THREE_ANSWERS
from tts2face.serving.service.consents import check_consent
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.job_kinds.order import FormPart, JobKind, JobOrder
from tts2face.serving.service.uploads import MAX_TRANSCRIPT_BYTES
from tts2face.serving.work.client import JobClient
from tts2face.serving.work.jobs import OPEN_STATES
from tts2face.serving.work.resource_check import TALKER

MAX_OPEN, MAX_COUNTED = 4, 1000  # talkers in work of a key; its newest jobs that are counted
RECORDING = "recording"  # of the files of the job, which differ in their endings
SUBTITLE_SUFFIXES = (".srt", ".vtt")


class TalkerRequest(BaseModel):
    """How a recording becomes a talker; meanings as of the flags of `tts2face corpus build`."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: Annotated[
        str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,39}$", description="Name of the talker.", examples=["anna"])
    ]
    language: Annotated[
        str, Field(max_length=40, description="Language that is spoken, as the talker states it.", examples=["en-gb"])
    ] = "en-us"
    licence: Annotated[str, Field(max_length=200, description="Licence of the recording.", examples=["CC BY 4.0"])] = (
        "not stated"
    )
    attribution: Annotated[
        str, Field(max_length=200, description="Whom to name with the talker.", examples=["Anna Example"])
    ] = "not stated"
    appearance: Annotated[
        bool, Field(description="Also learn the person's own face, for `face: self`.", examples=[False])
    ] = False
    consent: Annotated[
        str | None,
        Field(
            max_length=2000,
            description=f"Consent of the person shown, required with appearance and stored in it: {THREE_ANSWERS}.",
            examples=[EXAMPLE],
        ),
    ] = None


async def add_video(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note the recording."""
    if number > 1:
        raise RefusedError(422, "invalid_request", f"{part} was sent twice; send one recording")
    path, seconds = await order.upload.folder.video(part, file)
    order.upload.files[f"{RECORDING}{path.suffix}"] = path
    order.upload.seconds = seconds


async def add_words(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note the transcript or the subtitles."""
    folder, files = order.upload.folder, order.upload.files
    if number > 1 or {f"{RECORDING}.txt", *(f"{RECORDING}{suffix}" for suffix in SUBTITLE_SUFFIXES)} & set(files):
        raise RefusedError(422, "invalid_request", "there are words twice; send a transcript, or subtitles")
    if part == "transcript":
        files[f"{RECORDING}.txt"] = await folder.text(part, file, ".txt", MAX_TRANSCRIPT_BYTES)
        return
    # a byte order mark may stand before WEBVTT
    suffix = ".vtt" if (await file.read(6)).lstrip(b"\xef\xbb\xbf").startswith(b"WEB") else ".srt"
    await file.seek(0)
    path, _ = await folder.subtitles(part, file, suffix, None, order.state.settings.job_cues)
    files[f"{RECORDING}{suffix}"] = path


async def prepare_talker(order: JobOrder) -> dict[str, Any]:
    """JSON of a job of kind ``talker``."""
    asked: TalkerRequest = order.options
    if order.upload.seconds is None:
        raise RefusedError(422, "invalid_request", "there is no recording; send it as the part `video` of a form")
    consent = check_consent(asked.consent)
    if asked.appearance != (consent is not None):
        raise RefusedError(
            422, "consent",
            "a talker with its own face needs the consent of the person shown; give appearance and consent, or neither",
        )  # fmt: skip
    library = order.state.library
    await _check_open_jobs(order)
    await asyncio.to_thread(library.check_room, order.key, TALKER, asked.name, 0)
    return {
        "owner": order.key.name, "name": asked.name, "appearance": asked.appearance, "consent": consent,
        "provenance": {
            "name": asked.name, "language": asked.language, "licence": asked.licence,
            "attribution": asked.attribution, "sources": "a recording sent to the service",
        },
        "seconds": order.upload.seconds, "limits": asdict(library.limits(order.key)), "order": uuid.uuid4().hex,
    }  # fmt: skip


async def _check_open_jobs(order: JobOrder) -> None:
    """Refuse a recording of a key with many that wait: each keeps its file until it is built."""

    def count(client: JobClient) -> int:
        pages = [client.table.page(order.key.name, state, None, MAX_COUNTED) for state in OPEN_STATES]
        return sum(job.kind == TALKER for page in pages for job in page)

    n_open = await order.state.jobs.call(count)
    if n_open >= MAX_OPEN:
        raise RefusedError(
            429, "queue_full", f"the key {order.key.name} has {n_open} talkers in work; wait until one is built",
            {"Retry-After": "60"},
        )  # fmt: skip


TALKER_KIND = JobKind(
    "build",
    TalkerRequest,
    {
        "video": FormPart("Recording of a person who speaks, with sound.", add_video),
        "transcript": FormPart(
            "Spoken words, UTF-8 text, also a TextGrid or a table of labels; without words, phones are recognised.",
            add_words,
        ),
        "subtitles": FormPart("Spoken words with their times: SubRip or WebVTT.", add_words, is_list=True),
    },
    prepare_talker,
)
