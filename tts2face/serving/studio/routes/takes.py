"""Addresses of takes of puppetry, and the connection of a live camera."""

import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Body, Query, WebSocket
from fastapi import Request as HttpRequest
from fastapi.responses import FileResponse, Response

from lexicon.errors import InputError
from tts2face.serving.service.client_names import Adjustments
from tts2face.serving.service.page_addresses import TAKES
from tts2face.serving.studio.camera import follow_camera
from tts2face.serving.studio.face_answer import face_answer
from tts2face.serving.studio.recordings import receive_take
from tts2face.serving.studio.routes.recordings import uploaded_take
from tts2face.serving.studio.take_store import FILM, SOUND, TABLE
from tts2face.serving.studio.takes import Takes

KINDS = {TABLE: "text/csv", SOUND: "audio/wav", FILM: "video/mp4"}
SOUND_TYPES = ("audio/", "video/")

router = APIRouter(prefix=TAKES, include_in_schema=False)


def _takes(request: HttpRequest) -> Takes:
    found: Takes = request.app.state.studio.takes
    return found


@router.get("")
async def list_takes(request: HttpRequest) -> list[dict[str, Any]]:
    """Takes of the key, the last one first."""
    return [asdict(entry) for entry in _takes(request).store.entries(request.state.key.name)]


@router.get("/face.glb")
async def face(request: HttpRequest) -> Response:
    """The default head with a morph target for each channel of takes."""
    return await face_answer(request, await request.app.state.studio.plain_face(request.state.key))


@router.put("/new", status_code=201)
async def add_take(request: HttpRequest, name: Annotated[str, Query(max_length=200)] = "") -> dict[str, str]:
    """A new take: a video, or a Live Link Face table (text/csv)."""
    async with uploaded_take(request) as (upload, suffix):
        entry = await _takes(request).add(request.state.key, upload, suffix, name)
    return {"id": entry.id}


@router.put("/{number}/sound", status_code=204)
async def add_sound(request: HttpRequest, number: str) -> Response:
    """The sound of a take, or a video that has it."""
    adjustments = Adjustments()
    with tempfile.TemporaryDirectory(prefix="tts2face-take-") as folder:
        upload = Path(folder, "upload")
        await receive_take(request.stream(), upload)
        adjustments.note_sounds(await _takes(request).add_sound(request.state.key, number, upload))
    return adjustments.on(Response(status_code=204))


@router.get("/{number}/preview")
async def preview(request: HttpRequest, number: str) -> Response:
    """The take as a preview bundle."""
    content = await _takes(request).preview(request.state.key, number)
    return Response(content, media_type="application/octet-stream")


@router.post("/{number}/film", status_code=202)
async def render(request: HttpRequest, number: str) -> dict[str, str]:
    """Render a take."""
    _takes(request).film(request.state.key, number)
    return {"state": "waiting"}


@router.post("/{number}/style", status_code=204)
async def make_style(request: HttpRequest, number: str) -> Response:
    """Make the take the one of which a style is made (`tts2face.serving.studio.routes.styles`)."""
    await _takes(request).make_style_take(request.state.key, number)
    return Response(status_code=204)


@router.get("/{number}/files/{name}")
def download(request: HttpRequest, number: str, name: str) -> FileResponse:
    """Table, sound or film of a take."""
    store = _takes(request).store
    folder, entry = store.folder(request.state.key.name, number), store.entry(request.state.key.name, number)
    # names from a list, never a client's path
    if name not in KINDS or not (folder / name).is_file():
        raise InputError(f"the take has no file {name[:40]!r}; choose {', '.join(KINDS)}, and render the film first")
    shown = "".join(letter if letter.isalnum() else "-" for letter in entry.name)
    return FileResponse(folder / name, media_type=KINDS[name], filename=f"{shown}{Path(name).suffix}")


@router.patch("/{number}", status_code=204)
def rename(request: HttpRequest, number: str, name: Annotated[str, Body(embed=True)]) -> Response:
    """Rename a take."""
    _takes(request).store.rename(request.state.key.name, number, name)
    return Response(status_code=204)


@router.delete("/{number}", status_code=204)
async def remove(request: HttpRequest, number: str) -> Response:
    """Delete a take with all that was made of it."""
    await _takes(request).remove(request.state.key, number)
    return Response(status_code=204)


@router.websocket("/live")
async def live(connection: WebSocket) -> None:
    """Pictures of a camera come in, motion of the head goes out (docs/studio.md)."""
    await follow_camera(connection, connection.state.key, connection.app.state.studio.takes.live)
