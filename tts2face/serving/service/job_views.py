"""Jobs as the API shows them, and the envelope of a new one."""

import json
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from tts2face.serving.work.jobs import JobFile, JobRecord

HASH = "ab3f" * 16
EXAMPLE_ID = "0f8fad5bd9cb469fa16570867728950e"


class NewJobBody(BaseModel):
    """A job that is asked for; the options are those of its kind."""

    model_config = ConfigDict(extra="forbid", strict=True)

    kind: str
    request: dict[str, Any] = {}
    webhook: Annotated[str | None, Field(max_length=2000)] = None


class Progress(BaseModel):
    """How much is done."""

    done: Annotated[int, Field(description="Parts that are done.", examples=[3])]
    of: Annotated[int, Field(description="All parts; 0 while they are not known.", examples=[12])]


class ResultFile(BaseModel):
    """A file that a job has made."""

    name: Annotated[str, Field(description="Name of the file.", examples=["clip.mp4"])]
    url: Annotated[str, Field(description="Path from which it is fetched.", examples=[f"/v1/results/{HASH}"])]
    sha256: Annotated[str, Field(description="Hash of its content.", examples=[HASH])]
    media_type: Annotated[str, Field(description="Its media type.", examples=["video/mp4"])]
    bytes: Annotated[int, Field(description="Its size.", examples=[123456])]


class WebhookState(BaseModel):
    """The message about the end of a job."""

    url: Annotated[str, Field(description="Where it is sent.", examples=["https://example.org/done"])]
    state: Annotated[str, Field(description="waiting, delivered or failed.", examples=["delivered"])]
    tries: Annotated[int, Field(description="Number of times it was sent.", examples=[1])]


class Job(BaseModel):
    """A job without its options and results."""

    id: Annotated[str, Field(description="Name of the job.", examples=[EXAMPLE_ID])]
    kind: Annotated[str, Field(description="clip, subtitles, ...", examples=["clip"])]
    state: Annotated[str, Field(description="waiting, running, done, failed or cancelled.", examples=["done"])]
    created: Annotated[float, Field(description="Seconds since 1970.", examples=[1790000000.0])]
    started: Annotated[float | None, Field(description="When a worker took it.", examples=[1790000001.0])]
    finished: Annotated[float | None, Field(description="When it ended.", examples=[1790000009.0])]
    progress: Annotated[Progress, Field(description="How many of its parts are done.")]
    error: Annotated[
        str | None, Field(description="Why it failed, why some results are missing, or why it waits.", examples=[None])
    ]
    webhook: Annotated[WebhookState | None, Field(description="The message about its end.")]


class JobDetail(Job):
    """A job with its results."""

    results: Annotated[list[ResultFile], Field(description="Its files, when it is done.")]


class JobPage(BaseModel):
    """Jobs, the newest first."""

    jobs: Annotated[list[Job], Field(description="Jobs of this page.")]
    next: Annotated[
        str | None, Field(description="Value of `before` for the next page; null: there is none.", examples=[None])
    ]


def job_view(record: JobRecord) -> Job:
    """A job for the list."""
    return Job.model_validate(record, from_attributes=True)


def job_detail(record: JobRecord) -> JobDetail:
    """A job with its results."""
    return JobDetail(**dict(job_view(record)), results=[_file(file) for file in record.outputs])


def _file(file: JobFile) -> ResultFile:
    return ResultFile(
        name=file.name,
        url=f"/v1/results/{file.sha256}",
        sha256=file.sha256,
        media_type=file.media_type,
        bytes=file.n_bytes,
    )


def message_of(record: JobRecord) -> bytes:
    """Body of the message about a job."""
    content = {"type": f"job.{record.state}", "job": job_detail(record).model_dump(exclude={"webhook"})}
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode()
