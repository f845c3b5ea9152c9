"""Jobs over HTTP: long clips and subtitle batches that outlive their request, and the server."""

import asyncio
import json
import re
import uuid
from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Header, Query
from fastapi import Path as PathParameter
from fastapi import Request as HttpRequest
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response, StreamingResponse
from pydantic import BaseModel, ValidationError
from starlette.datastructures import FormData, UploadFile

from lexicon.errors import InputError
from lexicon.sentence_length import marked_silence_s
from lexicon.text_marks import parse_marks
from tts2face.serving.batch.content_address import content_address
from tts2face.serving.service.access import require_scope
from tts2face.serving.service.client_names import Adjustments
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.guard import VIDEO_PATH
from tts2face.serving.service.job_kinds.order import JobKind, JobOrder, Upload
from tts2face.serving.service.job_kinds.table import JOB_KINDS, new_job_schema
from tts2face.serving.service.job_views import EXAMPLE_ID, JobDetail, JobPage, NewJobBody, job_detail, job_view
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.results import error_event
from tts2face.serving.service.state import service_state
from tts2face.serving.service.uploads import MAX_TEXT_BYTES, upload_folder
from tts2face.serving.service.webhooks import check_webhook
from tts2face.serving.work.client import JobClient
from tts2face.serving.work.jobs import JobEvent, JobFile, JobRecord, NewJob, State
from tts2face.serving.work.kinds import media_type
from tts2face.serving.work.resource_check import TALKER

router = APIRouter(prefix="/v1", tags=["jobs"])

JOB_ID = re.compile(r"[0-9a-f]{32}")
CHARACTERS_PER_S, CUE_S = 15.0, 3.0  # of speech; what a job takes of its key's day before it is made
POLL_S, HEARTBEAT_S = 0.5, 15.0  # of the stream of events
MAX_PARTS = 2  # besides files
NOT_FOUND: dict[int | str, dict[str, Any]] = {404: {"description": "The key has no such job."}}
IdempotencyKey = Annotated[
    str | None,
    Header(
        min_length=1, max_length=255, pattern="^[!-~]+$", description="The same key and body give the same job.",
        examples=["order-17"],
    ),
]  # fmt: skip
JobId = Annotated[str, PathParameter(description="Name of the job.", examples=[EXAMPLE_ID])]


@router.post(
    "/jobs",
    response_model=JobDetail,
    status_code=202,
    summary="Queue a job",
    responses={200: {"model": JobDetail, "description": "The job that this Idempotency-Key has queued before."}},
    openapi_extra={"requestBody": new_job_schema(tuple(JOB_KINDS))},
)
async def create_job(request: HttpRequest, idempotency_key: IdempotencyKey = None) -> JSONResponse:
    """Queue a long clip or a batch of subtitle files; the answer comes at once."""
    return await _queue(request, idempotency_key, JOB_KINDS)


@router.post(
    VIDEO_PATH.removeprefix("/v1"),
    response_model=JobDetail,
    status_code=202,
    summary="Build a talker",
    responses={200: {"model": JobDetail, "description": "The job that this Idempotency-Key has queued before."}},
    openapi_extra={"requestBody": new_job_schema((TALKER,))},
)
async def build_talker(request: HttpRequest, idempotency_key: IdempotencyKey = None) -> JSONResponse:
    """Queue a job of kind `talker`, whose recording may be as large as the setting video_mb; scope build."""
    require_scope(request, JOB_KINDS[TALKER].scope, "recordings of talkers")
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        raise RefusedError(422, "invalid_request", "send a form (multipart/form-data) with the parts job and video")
    with service_state(request).decoders.receiving(request.state.key.name):
        return await _queue(request, idempotency_key, {TALKER: JOB_KINDS[TALKER]})


async def _queue(request: HttpRequest, idempotency_key: str | None, kinds: Mapping[str, JobKind]) -> JSONResponse:
    """Read and check a job of one of some kinds, and queue it."""
    state = service_state(request)
    service = state.jobs
    _ = service.client  # refuses before any work
    async with AsyncExitStack() as stack:
        form = FormData()
        body: bytes | str = b""
        if request.headers.get("content-type", "").startswith("multipart/form-data"):
            n_files = 2 * state.settings.job_files + MAX_PARTS
            form = await stack.enter_async_context(request.form(max_files=n_files, max_fields=MAX_PARTS))
            body = await _part(form, "job")
        else:
            body = await request.body()
        asked: NewJobBody = _parse(NewJobBody, body)
        kind = _kind(asked.kind, kinds)
        key = require_scope(request, kind.scope, f"jobs of kind {asked.kind}")
        # what builds a talker makes no speech
        if kind.scope == "speak":
            state.limits.check_speech(key)
        if asked.webhook is not None:
            check_webhook(asked.webhook, state.settings)
        folder = await stack.enter_async_context(upload_folder(state.settings, state.decoders, key.name))
        order = JobOrder(state, key, _parse(kind.model, json.dumps(asked.request)), Upload(folder))
        await _add_files(kind, order, form)
        content = await kind.prepare(order)
        record, is_new = await service.call(lambda client: _submit(client, order, asked, content, idempotency_key))
        if is_new:
            state.limits.add_speech(key, _expected_speech_s(order))
    adjustments = Adjustments()
    adjustments.note_sounds(folder.notes)
    answer = JSONResponse(job_detail(record).model_dump(), 202 if is_new else 200)
    answer.headers["Location"] = f"/v1/jobs/{record.id}"
    return adjustments.on(answer)


@router.get("/jobs", response_model=JobPage, summary="List jobs")
async def list_jobs(
    request: HttpRequest,
    state: Annotated[State | None, Query(description="Only jobs in this state.", examples=["done"])] = None,
    before: Annotated[
        str | None, Query(pattern="^[0-9a-f]{32}$", description="`next` of the page before.", examples=[EXAMPLE_ID])
    ] = None,
    limit: Annotated[int, Query(ge=1, le=100, description="Largest number of jobs.", examples=[50])] = 50,
) -> JobPage:
    """Jobs of the key, the newest first; those of all keys for the scope admin."""
    owner = _owner(request.state.key)
    found = await service_state(request).jobs.call(lambda client: client.table.page(owner, state, before, limit + 1))
    following = found[limit - 1].id if len(found) > limit else None
    return JobPage(jobs=[job_view(record) for record in found[:limit]], next=following)


@router.get("/jobs/{job_id}", response_model=JobDetail, summary="Show a job", responses=NOT_FOUND)
async def show_job(request: HttpRequest, job_id: JobId) -> JobDetail:
    """A job with its state, progress and results."""
    return job_detail(await _find(request, job_id))


@router.get(
    "/jobs/{job_id}/events",
    response_class=StreamingResponse,
    summary="Follow a job",
    responses={200: {"content": {"text/event-stream": {}}, "description": "Events."}, **NOT_FOUND},
)
async def follow_job(
    request: HttpRequest,
    job_id: JobId,
    last_event_id: Annotated[
        str | None,
        Header(max_length=20, description="Id of the last event received; only later ones are sent.", examples=["3"]),
    ] = None,
) -> StreamingResponse:
    """Server-sent events of a job, from its begin or after `Last-Event-ID`, up to its end."""
    record = await _find(request, job_id)
    after = int(last_event_id) if last_event_id and re.fullmatch(r"[0-9]{1,9}", last_event_id) else 0
    request.state.exchange.ending = error_event
    return StreamingResponse(_events(request, record.id, after), media_type="text/event-stream")


@router.post("/jobs/{job_id}/cancel", response_model=JobDetail, summary="Cancel a job", responses=NOT_FOUND)
async def cancel_job(request: HttpRequest, job_id: JobId) -> JobDetail:
    """Cancel a waiting or running job; one that has ended stays as it is."""
    record = await _find(request, job_id)
    await service_state(request).jobs.call(lambda client: client.cancel(record.id))
    return job_detail(await _find(request, job_id))


@router.delete("/jobs/{job_id}", status_code=204, response_class=Response, summary="Delete a job", responses=NOT_FOUND)
async def delete_job(request: HttpRequest, job_id: JobId) -> Response:
    """Delete a job, and its results unless another job has the same; an open job is cancelled first."""
    record = await _find(request, job_id)
    await service_state(request).jobs.call(lambda client: client.delete(record.id))
    return Response(status_code=204)


async def _find(request: HttpRequest, job_id: str) -> JobRecord:
    """A job of the key."""
    owner = _owner(request.state.key)
    if JOB_ID.fullmatch(job_id):
        found = await service_state(request).jobs.call(lambda client: client.table.get(job_id))
        if found is not None and owner in {None, found.key_name}:
            return found
    raise RefusedError(404, "not_found", f"there is no job {job_id[:40]!r}; GET /v1/jobs lists yours")


def _owner(key: ApiKey) -> str | None:
    """Name of the key whose jobs a key sees; None: all."""
    return None if "admin" in key.scopes else key.name


def _parse(model: type[BaseModel], body: bytes | str) -> Any:
    try:
        return model.model_validate_json(body)
    except ValidationError as wrong:
        raise RequestValidationError(wrong.errors()) from wrong


def _kind(name: str, kinds: Mapping[str, JobKind]) -> JobKind:
    if name not in kinds:
        raise RefusedError(
            422, "invalid_request", f"there is no job of kind {name[:40]!r} here; the kinds are {', '.join(kinds)}"
        )
    return kinds[name]


async def _part(form: FormData, name: str) -> bytes | str:
    found = form.get(name)
    if found is None:
        raise RefusedError(422, "invalid_request", f"the form has no part {name}; send the job as JSON in it")
    return found if isinstance(found, str) else await found.read(MAX_TEXT_BYTES)


async def _add_files(kind: JobKind, order: JobOrder, form: FormData) -> None:
    """Check the files of a form, in their order."""
    numbers: dict[str, int] = {}
    for part, file in form.multi_items():
        if part == "job":
            continue
        if part not in kind.parts:
            offered = ", ".join(kind.parts) or "none"
            raise RefusedError(
                422, "invalid_request", f"there is no part {part[:40]!r} in such a job; its files are {offered}"
            )
        if not isinstance(file, UploadFile):
            raise RefusedError(422, "invalid_request", f"{part} must be a file with a file name")
        numbers[part] = numbers.get(part, 0) + 1
        await kind.parts[part].add(order, part, file, numbers[part])


def _submit(
    client: JobClient, order: JobOrder, asked: NewJobBody, content: dict[str, Any], idempotency_key: str | None
) -> tuple[JobRecord, bool]:
    """Store the files of a job and queue it."""
    paths = order.upload.files
    hashes = {name: client.blobs.put(path) for name, path in paths.items()}
    inputs = tuple(JobFile(name, hashes[name], media_type(name), _size(path)) for name, path in paths.items())
    body_hash = content_address({
        "kind": asked.kind, "request": asked.request, "webhook": asked.webhook, "files": hashes,
    })  # fmt: skip
    new = NewJob(
        uuid.uuid4().hex, order.key.name, asked.kind, content, body_hash, inputs, idempotency_key, asked.webhook
    )

    def put_missing() -> None:
        for name, path in paths.items():
            if not client.blobs.has(hashes[name]):  # removed meanwhile with the last job that had it
                client.blobs.put(path)

    return client.submit(new, order.state.settings.job_waiting, put_missing)


def _expected_speech_s(order: JobOrder) -> float:
    """Seconds of speech that a job is expected to make."""
    options = order.options
    text = getattr(options, "text", "")
    silent_s = sum(getattr(options, name, None) or 0.0 for name in ("idle", "listen"))
    with suppress(InputError):  # of a text with wrong marks, which makes nothing
        silent_s += marked_silence_s(parse_marks(text, markup=getattr(options, "markup", "auto")))
    return len(text) / CHARACTERS_PER_S + silent_s + CUE_S * order.upload.n_cues


def _size(path: Path) -> int:
    return path.stat().st_size


def _read_events(client: JobClient, *, job_id: str, after: int) -> tuple[list[JobEvent], bool]:
    return client.table.events(job_id, after)


async def _events(request: HttpRequest, job_id: str, after: int) -> AsyncIterator[bytes]:
    """Events as server-sent events, with comments while nothing happens."""
    state, loop = service_state(request), asyncio.get_running_loop()
    yield b"retry: 2000\n\n"
    sent_at = loop.time()
    # EventSource connects again by itself, with the id of the last event
    while not state.is_draining:  # a client that connects again goes on where it was
        try:
            found, may_follow = await state.jobs.call(partial(_read_events, job_id=job_id, after=after))
        except RefusedError:  # the database is away; the job waits, too
            found, may_follow = [], True
        for event in found:
            after = event.number
            content = json.dumps({**event.content, "time": event.time}, ensure_ascii=False)
            yield f"id: {after}\nevent: {event.content['type']}\ndata: {content}\n\n".encode()
            sent_at = loop.time()
        if not may_follow:
            return
        if loop.time() - sent_at > HEARTBEAT_S:
            yield b": still here\n\n"
            sent_at = loop.time()
        await asyncio.sleep(POLL_S)
