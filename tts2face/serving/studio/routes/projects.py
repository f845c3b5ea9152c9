"""Projects as a page fetches them and a program may ask for them (docs/studio.md), with the errors of the service."""

import asyncio
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Body, File, Form, Query, UploadFile
from fastapi import Request as HttpRequest
from fastapi.responses import FileResponse, JSONResponse, Response

from lexicon.errors import InputError
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.page_addresses import PAGES
from tts2face.serving.service.uploads import BLOCK_BYTES
from tts2face.serving.studio.face_answer import face_answer
from tts2face.serving.studio.importing import ImportChoices, import_file, import_text
from tts2face.serving.studio.project_archive import archive
from tts2face.serving.studio.requests import data_of, events_of
from tts2face.serving.studio.studio import Studio
from tts2face.serving.studio.work import BackgroundWork
from tts2face.serving.studio.workspace import Workspace
from tts2face.serving.work.jobs import DONE
from tts2face.session.project_file import project_json

API = f"{PAGES}/api"
WAIT_S = 120.0  # for a preview that is asked to be complete

router = APIRouter(prefix=API, include_in_schema=False)


def _studio(request: HttpRequest) -> Studio:
    studio: Studio = request.app.state.studio
    return studio


@asynccontextmanager
async def opened(request: HttpRequest, project: str) -> AsyncIterator[Workspace]:
    """The project of a request."""
    try:
        workspace = await _studio(request).open(request.state.key, project)
    except InputError as wrong:
        raise RefusedError(404, "not_found", str(wrong)) from wrong
    yield workspace


@router.get("/projects")
async def list_projects(request: HttpRequest) -> list[dict[str, Any]]:
    """Projects of the key, those changed last first."""
    return [asdict(entry) for entry in await _studio(request).entries(request.state.key)]


@router.post("/projects", status_code=201)
async def create_project(
    request: HttpRequest, text: Annotated[str, Body()], name: Annotated[str, Body()] = ""
) -> dict[str, str]:
    """A new project that speaks a text."""
    return await _made(import_text(_studio(request), request.state.key, text, name))


@router.post("/imports", status_code=201)
async def import_upload(  # noqa: PLR0913 - one parameter a field of the form
    request: HttpRequest,
    file: Annotated[UploadFile, File()],
    transcript: Annotated[str, Form()] = "",
    *,
    encoding: Annotated[str | None, Form(max_length=40)] = None,
    language: Annotated[str | None, Form(max_length=40)] = None,
    keep: Annotated[list[str] | None, Form()] = None,
    speakers: Annotated[bool, Form()] = True,
    tier: Annotated[str | None, Form(max_length=200)] = None,
) -> dict[str, Any]:
    """A new project from a file.

    ``tier`` names the tier of the words in TextGrids and other files of tiers; the four fields before it are of
    subtitles, as the options of ``tts2face batch``.
    """
    subtitles = SubtitleOptions(language=language, keep=tuple(keep or ()), speakers=speakers)
    choices = ImportChoices(transcript, encoding, subtitles, tier)
    with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
        path = Path(folder, "upload")
        with path.open("wb") as saved:
            while block := await file.read(BLOCK_BYTES):
                saved.write(block)
        made = await import_file(_studio(request), request.state.key, path, file.filename or "", choices)
        return {"id": made.project, "notes": made.notes}


@router.get("/projects/{project}/project.json")
async def download_project(request: HttpRequest, project: str) -> JSONResponse:
    """The project as the command line renders it."""
    async with opened(request, project) as workspace:
        content = project_json(workspace.project, workspace.folder)
        return JSONResponse(content, headers={"Content-Disposition": 'attachment; filename="project.json"'})


@router.get("/projects/{project}/project.zip")
async def download_archive(request: HttpRequest, project: str) -> Response:
    """The project with the recordings and the palette that it needs, as the command line renders it."""
    async with opened(request, project) as workspace:
        content = await asyncio.to_thread(archive, workspace.project)
        headers = {"Content-Disposition": 'attachment; filename="project.zip"'}
        return Response(content, media_type="application/zip", headers=headers)


@router.delete("/projects/{project}", status_code=204)
async def delete_project(request: HttpRequest, project: str) -> Response:
    """Remove a project with everything in it."""
    async with opened(request, project):
        await _studio(request).remove(request.state.key, project)
    return Response(status_code=204)


@router.post("/projects/{project}/edits")
async def edit_project(
    request: HttpRequest, project: str, edit: Annotated[dict[str, Any], Body(embed=True)],
    tab: Annotated[str, Body(max_length=64)] = "",
) -> dict[str, Any]:  # fmt: skip
    """Change a project; nothing is changed while a tab edits it."""
    async with opened(request, project) as workspace:
        await workspace.edit(edit, tab)
        return _state(workspace)


@router.post("/projects/{project}/undo")
async def undo(request: HttpRequest, project: str) -> dict[str, Any]:
    """Take the last edit back."""
    async with opened(request, project) as workspace:
        workspace.undo()
        return _state(workspace)


@router.post("/projects/{project}/redo")
async def redo(request: HttpRequest, project: str) -> dict[str, Any]:
    """Make the edit again that was taken back last."""
    async with opened(request, project) as workspace:
        workspace.redo()
        return _state(workspace)


@router.get("/projects/{project}/preview")
async def preview(
    request: HttpRequest, project: str, have: int | None = None, wait: float = Query(default=0.0, ge=0, le=WAIT_S)
) -> Response:
    """Changes of the preview since revision `have`; after up to `wait` seconds, complete."""
    async with opened(request, project) as workspace:
        workspace.show()
        if wait or not workspace.preview.current.pieces:
            await workspace.preview.wait(wait or WAIT_S)
        content = workspace.preview.bundle(have)
        if content is None:  # contents that were dropped are made again
            await workspace.preview.wait(WAIT_S)
            content = workspace.preview.bundle(have)
        if content is None:
            raise RefusedError(503, "unavailable", "the preview is larger than the setting previews_mb; raise it")
        return Response(content, media_type="application/octet-stream")


@router.get("/projects/{project}/face.glb")
async def face(request: HttpRequest, project: str, look: str = "") -> Response:
    """The face as binary glTF; a browser may keep it if it is the one of `look` (`Workspace.appearance`)."""
    async with opened(request, project) as workspace:
        made, path = await _studio(request).face(workspace)
    return await face_answer(request, path, is_named=look == made)


@router.get("/projects/{project}/picture.png")
async def picture(request: HttpRequest, project: str, time: float = Query(ge=0)) -> Response:
    """The renderer's picture of an instant."""
    async with opened(request, project) as workspace:
        work = await workspace.work("picture", time=time)
        return Response(await data_of(_studio(request).state, workspace.key, work), media_type="image/png")


@router.get("/projects/{project}/explanation")
async def explanation(request: HttpRequest, project: str, time: float = Query(ge=0)) -> dict[str, Any]:
    """The recorded examples that made the phone at a time."""
    async with opened(request, project) as workspace:
        return await explain(_studio(request), workspace, time)


@router.get("/projects/{project}/renders")
async def list_renders(request: HttpRequest, project: str) -> list[dict[str, Any]]:
    """Files of a project, and their progress."""
    async with opened(request, project) as workspace:
        found = _studio(request).renders.of_project(workspace.key.name, workspace.folder)
        return [render_state(film) for film in found]


@router.post("/projects/{project}/renders", status_code=202)
async def start_render(
    request: HttpRequest, project: str, format: Annotated[str, Body(embed=True, max_length=40)]
) -> dict[str, Any]:
    """Queue a film or an export."""
    async with opened(request, project) as workspace:
        return render_state(await _studio(request).renders.add(workspace, format))


@router.delete("/projects/{project}/renders/{number}", status_code=204)
async def cancel_render(request: HttpRequest, project: str, number: str) -> Response:
    """Cancel a file, or delete it."""
    async with opened(request, project) as workspace:
        renders = _studio(request).renders
        renders.cancel(renders.find(workspace.key.name, workspace.folder, number))
    return Response(status_code=204)


@router.get("/projects/{project}/renders/{number}/file")
async def download_render(request: HttpRequest, project: str, number: str) -> FileResponse:
    """A finished file."""
    async with opened(request, project) as workspace:
        found = _studio(request).renders.find(workspace.key.name, workspace.folder, number)
        if found.state != DONE:
            raise InputError(f"the file {found.title} is {found.state}; wait until it is done")
        return FileResponse(found.files[0], filename=found.title)


async def explain(studio: Studio, workspace: Workspace, time: float) -> dict[str, Any]:
    """The phone at a time with the recorded examples that made it; ``phone`` is None where there is none."""
    work = await workspace.work("explain", time=time)
    async for event, _ in events_of(studio.state.results.messages(work, workspace.key)):
        return event
    raise InputError("the clip has no phones; give a text, or the words of its recording")


def render_state(render: BackgroundWork) -> dict[str, Any]:
    """JSON of a render."""
    return {
        "id": render.id, "name": render.title, "state": render.state, "share": round(render.share, 4),
        "message": render.message,
    }  # fmt: skip


def _state(workspace: Workspace) -> dict[str, Any]:
    history = workspace.history
    return {
        "is_saved": workspace.is_saved, "n_undo": len(history.past), "n_redo": len(history.future),
        "revision": workspace.preview.current.revision,
    }  # fmt: skip


async def _made(number: Any) -> dict[str, str]:
    return {"id": await number}
