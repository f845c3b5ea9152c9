"""Talkers, faces, palettes and dictionaries: list, show, draw, upload and delete; what a key uses."""

import asyncio
import hashlib
from collections.abc import Mapping
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi import Path as InPath
from fastapi import Request as HttpRequest
from fastapi.responses import JSONResponse, Response
from starlette.datastructures import FormData, UploadFile

from tts2face.interchange.characters.shapes import TRANSFER
from tts2face.models.consent import EXAMPLE, THREE_ANSWERS
from tts2face.models.named_colours import EYE_COLOURS, parse_eye_colour
from tts2face.serving.service.access import require_scope
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import describe_shipped, plural, shipped_names
from tts2face.serving.service.resource_views import (
    FACTS,
    Resource,
    ResourceList,
    UsageAnswer,
    shipped_resource,
    uploaded_resource,
)
from tts2face.serving.service.sent_resources import (
    AVATAR,
    HEAD_SWITCHES,
    MAX_CONSENT,
    MAX_FIT,
    MAX_MAPPING,
    MAX_NAME,
    SPEAKING_PICTURE,
    Sent,
    SentPhoto,
    store_resource,
)
from tts2face.serving.service.shipped_pictures import shipped_picture
from tts2face.serving.service.state import service_state
from tts2face.serving.service.uploads import save_upload
from tts2face.serving.work.resource_check import FACE, RESOURCE_KINDS, TEXT_KINDS
from tts2face.serving.work.resources import StoredResource

router = APIRouter(prefix="/v1", tags=["resources"])
Name = Annotated[str, InPath(description="Its name.", max_length=MAX_NAME, examples=["head"])]
Owner = Annotated[
    str | None, Query(description="With scope admin: the key that uploaded it.", max_length=200, examples=["studio"])
]
PICTURE_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {"content": {"image/png": {}}, "description": "PNG."},
    304: {"description": "The picture has not changed."},
}
CONTENTS = {
    "talker": "A .talker file.",
    "face": "A .face file, a character (.glb, .vrm, .zip), or a photo where it is allowed.",
    "palette": "A .palette file.", "dictionary": "A pronunciation dictionary, UTF-8 text.",
    "text_marks": "A table of emoji, tags and actions, UTF-8 text with tabs.",
}  # fmt: skip


def _add_reading(kind: str) -> None:
    single, many = Resource[FACTS[kind]], ResourceList[FACTS[kind]]  # type: ignore[valid-type]
    path = f"/{plural(kind)}"

    @router.get(path, response_model=many, summary=f"List {plural(kind)}")
    async def list_resources(request: HttpRequest) -> dict[str, Any]:
        """The service's own, and those that the key has uploaded; with scope admin those of all keys."""
        key: ApiKey = request.state.key
        return {"data": await asyncio.to_thread(_list, request, kind, None if "admin" in key.scopes else key.name)}

    @router.get(f"{path}/{{name}}", response_model=single, summary=f"Show a {kind}")
    async def show_resource(request: HttpRequest, name: Name, owner: Owner = None) -> dict[str, Any]:
        """What is known about it."""
        if name in shipped_names(kind):
            return shipped_resource(kind, name, await asyncio.to_thread(describe_shipped, kind, name))
        return uploaded_resource(await _upload(request, kind, name, owner))


def _add_writing(kind: str) -> None:
    single, path = Resource[FACTS[kind]], f"/{plural(kind)}"  # type: ignore[valid-type]

    @router.post(
        path, response_model=single, status_code=201, summary=f"Upload a {kind}",
        openapi_extra={"requestBody": _form(kind)},
    )  # fmt: skip
    async def add_resource(request: HttpRequest) -> JSONResponse:
        """Check a file, and store it under a name; needs the scope build."""
        stored = await _store(request, kind)
        content = single.model_validate(uploaded_resource(stored)).model_dump(mode="json")
        return JSONResponse(content, 201, {"Location": f"/v1/{plural(kind)}/{stored.name}"})

    @router.delete(f"{path}/{{name}}", status_code=204, summary=f"Delete a {kind}", response_class=Response)
    async def delete_resource(request: HttpRequest, name: Name, owner: Owner = None) -> Response:
        """Delete an upload, whose name is free again then; needs the scope build."""
        require_scope(request, "build", "deletions")
        library = service_state(request).library
        await asyncio.to_thread(library.remove, kind, _owner(request, owner), name)
        return Response(status_code=204)


def _add_picture(kind: str) -> None:
    @router.get(
        f"/{plural(kind)}/{{name}}/picture", summary=f"Picture of a {kind}", response_class=Response,
        responses=PICTURE_ANSWERS,
    )  # fmt: skip
    async def draw_resource(request: HttpRequest, name: Name, owner: Owner = None) -> Response:
        """The face at rest, of a talker or face; of a palette, each style on the head."""
        state = service_state(request)
        if name in shipped_names(kind):
            return await _picture(
                request, await shipped_picture(state.decoders, state.settings.data_folder, kind, name)
            )
        stored = await _upload(request, kind, name, owner)
        return await _picture(request, await asyncio.to_thread(state.library.picture, stored))


def _form(kind: str) -> dict[str, Any]:
    parts: dict[str, dict[str, Any]] = {
        "file": {"type": "string", "format": "binary", "description": CONTENTS[kind]},
        "name": {
            "type": "string", "pattern": "^[a-z0-9][a-z0-9-]{0,39}$", "example": "anna",
            "description": "Its name in requests: letters a-z, digits and hyphens.",
        },
    }  # fmt: skip
    if kind == FACE:
        parts["mapping"] = {
            "type": "string", "maxLength": MAX_MAPPING, "example": "jawOpen\tMouthWide\t0.8",
            "description": "With a character: names of its shapes, in place of the guessed ones; a file of "
                           "`face import --mapping` (docs/characters.md), its rows or its TOML.",
        }  # fmt: skip
        parts["shapes"] = {
            "type": "string", "enum": [TRANSFER],
            "description": "With a character: carry over the shapes of a shipped head, for a head that has none; its "
                           "own if left out.",
        }  # fmt: skip
        parts["consent"] = {
            "type": "string",
            "example": EXAMPLE,
            "description": f"With a photo: the person's consent, kept in the face: {THREE_ANSWERS}.",
        }
        parts["makes"] = {
            "type": "string",
            "enum": [SPEAKING_PICTURE, AVATAR],
            "default": SPEAKING_PICTURE,
            "description": "With a photo: a face that speaks in the picture, or a head of the person, which turns.",
        }
        parts["fit"] = {
            "type": "string", "maxLength": MAX_FIT, "example": '{"teeth": [397, 544]}',
            "description": "With a photo that speaks: corrections of what is found in it, JSON (docs/photo.md).",
        }  # fmt: skip
        parts["eye_color"] = {
            "type": "string", "maxLength": MAX_NAME, "example": "green",
            "description": f"With a head: {', '.join(EYE_COLOURS)} or #rrggbb; that of the photo if left out.",
        }  # fmt: skip
        for part, does in HEAD_SWITCHES.items():
            parts[part] = {
                "type": "boolean",
                "default": False,
                "example": False,
                "description": f"With a head: {does}.",
            }
    schema = {"type": "object", "properties": parts, "required": ["file", "name"]}
    return {"required": True, "content": {"multipart/form-data": {"schema": schema}}}


for _kind in RESOURCE_KINDS:
    _add_reading(_kind)
    _add_writing(_kind)
    if _kind not in TEXT_KINDS:
        _add_picture(_kind)


@router.get("/usage", response_model=UsageAnswer, summary="What the key uses and may use")
async def show_usage(request: HttpRequest) -> dict[str, Any]:
    """Uploads and limits of the key."""
    key: ApiKey = request.state.key
    library = service_state(request).library
    used, limits = await asyncio.to_thread(library.usage, key), library.limits(key)
    return {
        "key": key.name, "scopes": list(key.scopes),
        "resources": {"used": used.n_resources, "limit": limits.n_resources},
        "resource_bytes": {"used": used.n_bytes, "limit": limits.n_bytes},
        "requests_per_minute": key.requests_per_minute, "concurrent": key.concurrent,
    }  # fmt: skip


def _list(request: HttpRequest, kind: str, owner: str | None) -> list[dict[str, object]]:
    shipped = [shipped_resource(kind, name, describe_shipped(kind, name)) for name in shipped_names(kind)]
    return [*shipped, *map(uploaded_resource, service_state(request).library.uploads(kind, owner))]


def _owner(request: HttpRequest, owner: str | None) -> str:
    """Owner of the resources that a request names: the key itself, unless it has the scope admin and names another."""
    key: ApiKey = request.state.key
    if owner is None or owner == key.name:
        return key.name
    require_scope(request, "admin", "resources of other keys")
    return owner


async def _upload(request: HttpRequest, kind: str, name: str, owner: str | None) -> StoredResource:
    library = service_state(request).library
    return await asyncio.to_thread(library.upload, kind, _owner(request, owner), name)


async def _store(request: HttpRequest, kind: str) -> StoredResource:
    """Read the form of an upload, check its file in a child process, and store it."""
    key = require_scope(request, "build", "uploads")
    state = service_state(request)
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        raise RefusedError(422, "invalid_request", "send a form (multipart/form-data) with the parts file and name")
    async with request.form(max_files=2, max_fields=4 + len(fields(SentPhoto))) as form:
        return await store_resource(state, key, await _read_form(form, kind))


async def _read_form(form: FormData, kind: str) -> Sent:
    more = ["mapping", "shapes", *(field.name for field in fields(SentPhoto))] if kind == FACE else []
    unknown = set(form) - {"file", "name", *more}
    name, file = form.get("name"), form.get("file")
    if unknown:
        raise RefusedError(422, "invalid_request", f"there is no part {min(unknown)[:40]!r}; send file and name")
    if not isinstance(name, str) or not isinstance(file, UploadFile):
        raise RefusedError(422, "invalid_request", "the form needs a part file, with a file name, and a part name")
    mapping = _text({"mapping": await _content(form.get("mapping"))}, "mapping", MAX_MAPPING)
    shapes = form.get("shapes")
    if shapes not in (None, TRANSFER):
        raise RefusedError(422, "invalid_request", f"the part shapes is {TRANSFER}; leave it out for its own shapes")
    saved = partial(save_upload, file)
    return Sent(kind, name, file.size or 0, saved, _read_choices(form), mapping, TRANSFER if shapes else None)


async def _content(part: UploadFile | str | None) -> object:
    """Text of a part that may be a file; the part itself if it is none."""
    if not isinstance(part, UploadFile):
        return part
    try:
        return (await part.read(MAX_MAPPING + 1)).decode("utf-8-sig")
    except UnicodeDecodeError:
        return part


def _read_choices(form: FormData) -> SentPhoto:
    makes = form.get("makes", SPEAKING_PICTURE)
    switches = {part: form.get(part, "false") for part in HEAD_SWITCHES}
    if makes not in (SPEAKING_PICTURE, AVATAR):
        raise RefusedError(422, "invalid_request", f"the part makes is {SPEAKING_PICTURE} or {AVATAR}")
    for part, value in switches.items():
        if value not in ("true", "false"):
            raise RefusedError(422, "invalid_request", f"the part {part} is true or false")
    consent, fit, eye_color = (
        _text(form, part, most) for part, most in (("consent", MAX_CONSENT), ("fit", MAX_FIT), ("eye_color", MAX_NAME))
    )
    if fit is not None and makes == AVATAR:
        raise RefusedError(422, "invalid_request", "a fit corrects a picture that speaks; leave out fit, or makes")
    if makes == SPEAKING_PICTURE and (eye_color is not None or "true" in switches.values()):
        reason = f"eye_color, {' and '.join(HEAD_SWITCHES)} are of a head; leave them out, or add makes"
        raise RefusedError(422, "invalid_request", reason)
    if eye_color is not None:
        parse_eye_colour(eye_color)
    return SentPhoto(consent, str(makes), fit, eye_color, **{part: value == "true" for part, value in switches.items()})


def _text(form: Mapping[str, object], part: str, most: int) -> str | None:
    text = form.get(part)
    if text is None:
        return None
    if not isinstance(text, str) or len(text) > most:
        raise RefusedError(422, "invalid_request", f"the part {part} has up to {most} characters of text")
    return text


async def _picture(request: HttpRequest, path: Path) -> Response:
    content = await asyncio.to_thread(path.read_bytes)
    headers = {"ETag": f'"{hashlib.sha256(content).hexdigest()}"', "Cache-Control": "private, max-age=60"}
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return Response(content, media_type="image/png", headers=headers)
