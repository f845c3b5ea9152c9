"""Talkers, faces, palettes and dictionaries: list, show, draw, upload and delete; what a key uses."""

import asyncio
import hashlib
from collections.abc import Awaitable, Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi import Path as InPath
from fastapi import Request as HttpRequest
from fastapi.responses import JSONResponse, Response
from starlette.datastructures import FormData, UploadFile

from tts2face.models.face_file import FORMAT_VERSION
from tts2face.models.face_schema import PHOTOGRAPH
from tts2face.models.hair import EYE_COLOURS, parse_eye_colour
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.guard import require_scope
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import check_new_name, describe_shipped, plural, shipped_names, shipped_picture
from tts2face.serving.service.resource_views import (
    FACTS,
    Resource,
    ResourceList,
    UsageAnswer,
    shipped_resource,
    uploaded_resource,
)
from tts2face.serving.service.routes.clips import service_state
from tts2face.serving.service.state import ServiceState
from tts2face.serving.service.uploads import UploadFolder, save_upload, upload_folder
from tts2face.serving.work.resource_check import (
    CHARACTER,
    CONTENT,
    DICTIONARY,
    FACE,
    N_MAGIC,
    PHOTO,
    RESOURCE_KINDS,
    is_of_photo,
    kind_of_face,
)
from tts2face.serving.work.resources import StoredResource
from tts2face.storage.tensors import read_metadata

router = APIRouter(prefix="/v1", tags=["resources"])

MAX_NAME, MAX_CONSENT, MAX_FIT, MAX_MAPPING = 40, 1000, 100_000, 100_000
SPEAKING_PICTURE, AVATAR = "picture", "avatar"  # what is made of a photo
NO_PHOTOS = "this service has no faces of photos; its operator allows them with the setting photos"
Name = Annotated[str, InPath(description="Its name.", max_length=MAX_NAME, examples=["head"])]
Owner = Annotated[
    str | None, Query(description="With scope admin: the key that uploaded it.", max_length=200, examples=["studio"])
]
PICTURE_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {"content": {"image/png": {}}, "description": "PNG."},
    304: {"description": "The picture has not changed."},
}
CONTENTS = {
    "talker": "A .talker file.", "face": "A .face file, a character (.glb, .vrm), or a photo where it is allowed.",
    "palette": "A .palette file.", "dictionary": "A pronunciation dictionary, UTF-8 text.",
}  # fmt: skip


def _add_reading(kind: str) -> None:
    one, many, path = Resource[FACTS[kind]], ResourceList[FACTS[kind]], f"/{plural(kind)}"  # type: ignore[valid-type]

    @router.get(path, response_model=many, summary=f"List {plural(kind)}")
    async def list_resources(request: HttpRequest) -> dict[str, Any]:
        """The service's own, and those that the key has uploaded; with scope admin those of all keys."""
        key: ApiKey = request.state.key
        return {"data": await asyncio.to_thread(_list, request, kind, None if "admin" in key.scopes else key.name)}

    @router.get(f"{path}/{{name}}", response_model=one, summary=f"Show a {kind}")
    async def show_resource(request: HttpRequest, name: Name, owner: Owner = None) -> dict[str, Any]:
        """What is known about it."""
        if name in shipped_names(kind):
            return shipped_resource(kind, name, await asyncio.to_thread(describe_shipped, kind, name))
        return uploaded_resource(await _upload(request, kind, name, owner))


def _add_writing(kind: str) -> None:
    one, path = Resource[FACTS[kind]], f"/{plural(kind)}"  # type: ignore[valid-type]

    @router.post(
        path, response_model=one, status_code=201, summary=f"Upload a {kind}",
        openapi_extra={"requestBody": _form(kind)},
    )  # fmt: skip
    async def add_resource(request: HttpRequest) -> JSONResponse:
        """Check a file, and store it under a name; needs the scope build."""
        stored = await _store(request, kind)
        content = one.model_validate(uploaded_resource(stored)).model_dump(mode="json")
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
        parts["consent"] = {
            "type": "string",
            "example": "I agree that my face speaks what this service is asked for.",
            "description": "With a photo: the person's statement, kept in the face; drawn if it is nobody's.",
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
        parts["age_keep"] = {
            "type": "boolean", "default": False, "description": "With a head: keep the wrinkles of the skin."
        }  # fmt: skip
    schema = {"type": "object", "properties": parts, "required": ["file", "name"]}
    return {"required": True, "content": {"multipart/form-data": {"schema": schema}}}


for _kind in RESOURCE_KINDS:
    _add_reading(_kind)
    _add_writing(_kind)
    if _kind != DICTIONARY:
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
    async with request.form(max_files=2, max_fields=3 + len(fields(SentPhoto))) as form:
        return await store_resource(state, key, await _read_form(form, kind))


@dataclass(frozen=True, slots=True)
class SentPhoto:
    """What comes with a photo: the statement of the person shown, what it makes, and the choices of each.

    A picture that speaks takes the JSON of a ``fit``, a head the colour of its eyes and whether wrinkles stay.
    """

    consent: str | None = None
    makes: str = SPEAKING_PICTURE
    fit: str | None = None
    eye_color: str | None = None
    age_keep: bool = False


NO_CHOICES = SentPhoto()


@dataclass(frozen=True, slots=True)
class Sent:
    """A file that a client sends to be kept under a name: its kind, its size in bytes, and how it is saved to a path.

    With a photo comes what is said of it, with a character the names of its shapes: the text of a mapping's file.
    """

    kind: str
    name: str
    size: int
    save: Callable[[Path], Awaitable[None]]
    photo: SentPhoto = NO_CHOICES
    mapping: str | None = None


async def store_resource(state: ServiceState, key: ApiKey, sent: Sent) -> StoredResource:
    """Check a file in a child process, and store it.

    Raises
    ------
    RefusedError
        The key may not build, the name is wrong or taken, the quota is used up, too many files are checked, or this
        one is refused.
    """
    key = state.key_with(key, "build")
    check_new_name(sent.kind, sent.name)
    await asyncio.to_thread(state.library.check_room, key, sent.kind, sent.name, sent.size)
    async with upload_folder(state.settings, state.decoders, key.name) as folder:
        given = folder.path / f"{sent.kind}.upload"
        await sent.save(given)
        checked = await _checked(state, key, sent, folder, given)
        return await asyncio.to_thread(state.library.add, key, sent.kind, sent.name, checked)


async def _checked(state: ServiceState, key: ApiKey, sent: Sent, folder: UploadFolder, given: Path) -> Path:
    """Folder with a checked resource of a saved file."""
    n_bytes = state.library.limits(key).n_bytes
    kind = await asyncio.to_thread(_kind_of, sent.kind, given)
    if sent.mapping is not None and kind != CHARACTER:
        raise RefusedError(422, "invalid_request", "a mapping names shapes of a character; send one, or leave it out")
    if kind == PHOTO:
        with _photo_turn(state, key):
            folder.state(given, {"name": sent.name, **asdict(sent.photo)})
            if sent.photo.makes == AVATAR:
                return await folder.avatar(given, n_bytes)
            return await folder.resource(FACE, given, n_bytes)
    if sent.photo.makes == AVATAR:
        raise RefusedError(422, "invalid_request", "a head is made of a picture; send one, or leave out makes")
    if sent.mapping is not None:
        folder.state(given, {"mapping": sent.mapping})
    checked = await folder.resource(sent.kind, given, n_bytes)
    if sent.kind == FACE and not state.settings.photos:
        await asyncio.to_thread(_refuse_photograph, checked / CONTENT)
    return checked


async def find_photo_places(
    state: ServiceState, key: ApiKey, folder: UploadFolder, photo: Path
) -> tuple[Path, dict[str, Any]]:
    """Lips, lids, teeth and pivot in a photo that is saved in a private folder, as `UploadFolder.places`.

    Raises
    ------
    RefusedError
        The operator allows no photos, the key may not build or reads one already, too many files are checked, or it
        shows no face.
    """
    key = state.key_with(key, "build")
    with _photo_turn(state, key, counts=False):
        folder.state(photo, {"name": photo.name})
        return await folder.places(photo)


def _photo_turn(state: ServiceState, key: ApiKey, *, counts: bool = True) -> AbstractContextManager[None]:
    """A turn of a key to read a photo, if the operator allows them; errors as `RateLimits.photo`."""
    if not state.settings.photos:
        raise RefusedError(403, "forbidden", NO_PHOTOS)
    return state.limits.photo(key, state.settings.photos_per_day, counts=counts)


async def _read_form(form: FormData, kind: str) -> Sent:
    more = ["mapping", *(one.name for one in fields(SentPhoto))] if kind == FACE else []
    unknown = set(form) - {"file", "name", *more}
    name, file = form.get("name"), form.get("file")
    if unknown:
        raise RefusedError(422, "invalid_request", f"there is no part {min(unknown)[:40]!r}; send file and name")
    if not isinstance(name, str) or not isinstance(file, UploadFile):
        raise RefusedError(422, "invalid_request", "the form needs a part file, with a file name, and a part name")
    mapping = _text({"mapping": await _content(form.get("mapping"))}, "mapping", MAX_MAPPING)
    return Sent(kind, name, file.size or 0, partial(save_upload, file), _read_choices(form), mapping)


async def _content(part: UploadFile | str | None) -> object:
    """Text of a part that may be a file; the part itself if it is none."""
    if not isinstance(part, UploadFile):
        return part
    try:
        return (await part.read(MAX_MAPPING + 1)).decode("utf-8-sig")
    except UnicodeDecodeError:
        return part


def _read_choices(form: FormData) -> SentPhoto:
    makes, age_keep = form.get("makes", SPEAKING_PICTURE), form.get("age_keep", "false")
    if makes not in (SPEAKING_PICTURE, AVATAR):
        raise RefusedError(422, "invalid_request", f"the part makes is {SPEAKING_PICTURE} or {AVATAR}")
    if age_keep not in ("true", "false"):
        raise RefusedError(422, "invalid_request", "the part age_keep is true or false")
    consent, fit, eye_color = (
        _text(form, part, most) for part, most in (("consent", MAX_CONSENT), ("fit", MAX_FIT), ("eye_color", MAX_NAME))
    )
    if fit is not None and makes == AVATAR:
        raise RefusedError(422, "invalid_request", "a fit corrects a picture that speaks; leave out fit, or makes")
    if makes == SPEAKING_PICTURE and (eye_color is not None or age_keep == "true"):
        raise RefusedError(422, "invalid_request", "eye_color and age_keep are of a head; leave them out, or add makes")
    if eye_color is not None:
        parse_eye_colour(eye_color)
    return SentPhoto(consent, str(makes), fit, eye_color, age_keep == "true")


def _text(form: Mapping[str, object], part: str, most: int) -> str | None:
    text = form.get(part)
    if text is None:
        return None
    if not isinstance(text, str) or len(text) > most:
        raise RefusedError(422, "invalid_request", f"the part {part} has up to {most} characters of text")
    return text


def _kind_of(kind: str, file: Path) -> str:
    """Kind of a file that is sent as one of a kind: of a face it may be a character or a photo."""
    with file.open("rb") as opened:
        return kind_of_face(opened.read(N_MAGIC)) if kind == FACE else kind


def _refuse_photograph(face: Path) -> None:
    """Refuse the file of a face that speaks in a photograph, or of a head that was made of one."""
    header = read_metadata(face, FACE, FORMAT_VERSION)
    if is_of_photo(header["metadata"], in_picture=PHOTOGRAPH in header):
        raise RefusedError(403, "forbidden", NO_PHOTOS)


async def _picture(request: HttpRequest, path: Path) -> Response:
    content = await asyncio.to_thread(path.read_bytes)
    headers = {"ETag": f'"{hashlib.sha256(content).hexdigest()}"', "Cache-Control": "private, max-age=60"}
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return Response(content, media_type="image/png", headers=headers)
