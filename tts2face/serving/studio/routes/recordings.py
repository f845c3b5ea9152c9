"""Addresses of takes and of the files that are made of them."""

import secrets
import tempfile
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import APIRouter, Request
from fastapi.responses import FileResponse, JSONResponse, Response

from lexicon.errors import InputError, Tts2faceError
from tts2face.serving.service.page_addresses import RECORDINGS
from tts2face.serving.studio.recorded_talker import CLIP, REPORT, TALKER
from tts2face.serving.studio.recording_work import Recordings, recording_owner
from tts2face.serving.studio.recordings import SUFFIXES, RecordingStore, receive_take

TAKE = "/{number}/takes/{at}"
NO_STORE = {"Cache-Control": "no-store"}
# The report holds a user's names and must not act as a page of this origin.
DOWNLOADS: Mapping[str, tuple[str, Mapping[str, str]]] = {
    REPORT: ("text/html", {"Content-Security-Policy": "sandbox; default-src 'unsafe-inline' data:"}),
    CLIP: ("video/mp4", {}),
    TALKER: ("application/octet-stream", {"Content-Disposition": f'attachment; filename="{TALKER}"'}),
}


def recording_router(recordings: Recordings) -> APIRouter:
    """Routes of the takes and files of recordings."""
    store, router = recordings.store, APIRouter(prefix=RECORDINGS, include_in_schema=False)

    @router.put(TAKE)
    async def put_take(request: Request, number: str, at: int) -> Response:
        try:
            folder = store.folder(number, recording_owner(request.state.key))
            upload = folder / f"upload-{secrets.token_hex(8)}"
            try:
                await receive_take(request.stream(), upload)
                take = store.add_take(number, at, upload, request.headers.get("content-type", ""))
            finally:
                upload.unlink(missing_ok=True)
        except Tts2faceError as error:
            return JSONResponse({"error": str(error)}, 422)
        recordings.check(number, at, take)
        return JSONResponse({"state": take.state}, 201)

    @router.get(TAKE)
    def get_take(request: Request, number: str, at: int) -> Response:
        path = _take_path(store, number, recording_owner(request.state.key), at)
        if path is None:
            return JSONResponse({"error": "there is no such take"}, 404)
        kinds = {suffix: kind for kind, suffix in SUFFIXES.items()}
        return FileResponse(path, media_type=kinds[path.suffix], headers=NO_STORE)

    @router.get("/{number}/files/{name}")
    def get_file(request: Request, number: str, name: str) -> Response:
        path = _download_path(store, number, recording_owner(request.state.key), name)
        if path is None:
            return JSONResponse({"error": "there is no such file"}, 404)
        kind, headers = DOWNLOADS[name]
        return FileResponse(path, media_type=kind, headers={**NO_STORE, **headers})

    return router


@asynccontextmanager
async def uploaded_take(request: Request) -> AsyncIterator[tuple[Path, str]]:
    """File of a take that a request holds, and its suffix: a video, or a Live Link Face table."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    suffix = {**SUFFIXES, "text/csv": ".csv"}.get(kind)
    if suffix is None:
        raise InputError(f"a take must be {', '.join(SUFFIXES)} or text/csv, not {kind[:40]!r}; convert it")
    with tempfile.TemporaryDirectory(prefix="tts2face-take-") as folder:
        upload = Path(folder, "upload")
        await receive_take(request.stream(), upload)
        yield upload, suffix


def _take_path(store: RecordingStore, number: str, owner: str, at: int) -> Path | None:
    try:
        store.folder(number, owner)
        return store.path(number, store.takes(number)[at])
    except (InputError, KeyError):
        return None


def _download_path(store: RecordingStore, number: str, owner: str, name: str) -> Path | None:
    try:
        path = store.folder(number, owner) / name
    except InputError:
        return None
    return path if name in DOWNLOADS and path.is_file() else None
