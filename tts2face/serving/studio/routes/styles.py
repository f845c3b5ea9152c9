"""Addresses of own styles: the take in work, moving pictures, derived styles, the palette file."""

from dataclasses import asdict
from typing import Annotated, Any

from fastapi import APIRouter, Body, Query
from fastapi import Request as HttpRequest
from fastapi.responses import FileResponse, Response

from lexicon.errors import InputError
from lexicon.values.json_text import parse_json
from lexicon.values.records import checked
from tts2face.models.palette_editing import StyleMix
from tts2face.serving.service.page_addresses import STYLES
from tts2face.serving.studio.palette_store import FILE
from tts2face.serving.studio.recordings import SUFFIXES
from tts2face.serving.studio.routes.recordings import NO_STORE, uploaded_take
from tts2face.serving.studio.styles import Styles
from tts2face.session import catalogue

router = APIRouter(prefix=STYLES, include_in_schema=False)


def _styles(request: HttpRequest) -> Styles:
    found: Styles = request.app.state.studio.styles
    return found


@router.get("")
async def list_styles(request: HttpRequest) -> dict[str, Any]:
    """Styles of the key's palette, and what is known of its take."""
    styles, key = _styles(request), request.state.key
    own = styles.store.own_names(key.name)
    listed = [
        {"name": style.name, "source": style.source, "summary": style.summary, "is_own": style.name in own}
        for style in catalogue.styles(styles.store.base(key.name))
    ]
    return {"styles": listed, "take": asdict(styles.take_state(key))}


@router.post("", status_code=201)
async def make_style(
    request: HttpRequest, name: Annotated[str, Body()], mix: Annotated[dict[str, Any] | None, Body()] = None
) -> dict[str, str]:
    """A new style: a mix of others, or of the take, which takes some seconds."""
    styles, key = _styles(request), request.state.key
    if mix is None:
        await styles.make(key, name)
        return {"name": name}
    return {"name": await styles.derive(key, name, checked(StyleMix, mix, "the mix", InputError))}


@router.put("/take/{number}", status_code=201)
async def put_take(request: HttpRequest, number: str) -> dict[str, str]:
    """A recorded take in place of an earlier one; the number, by which recorders name prompts, does not matter."""
    async with uploaded_take(request) as (upload, suffix):
        await _styles(request).add_take(request.state.key, upload, suffix)
    return {"state": "checking"}


@router.get("/take/{number}")
def get_take(request: HttpRequest, number: str) -> Response:
    """The take, to look at."""
    path = _styles(request).store.take(request.state.key.name)
    kinds = {suffix: kind for kind, suffix in SUFFIXES.items()}
    if path is None:
        raise InputError("there is no take; record or upload one")
    return FileResponse(path, media_type=kinds.get(path.suffix, "application/octet-stream"), headers=NO_STORE)


@router.delete("/take/{number}", status_code=204)
async def delete_take(request: HttpRequest, number: str) -> Response:
    """Delete the take."""
    await _styles(request).delete_take(request.state.key)
    return Response(status_code=204)


@router.get(f"/{FILE}")
def download_palette(request: HttpRequest) -> FileResponse:
    """The palette with the own styles and the shipped ones."""
    path = _styles(request).store.path(request.state.key.name)
    if not path.is_file():
        raise InputError("you have no own styles yet; make one first")
    return FileResponse(path, filename=FILE)


@router.get("/mix.webp")
async def draw_mix(request: HttpRequest, mix: Annotated[str, Query(max_length=4000)]) -> Response:
    """Moving picture of a mix, an object of JSON, that is not kept."""
    wanted = checked(StyleMix, parse_json(mix, "the mix"), "the mix", InputError)
    content = await _styles(request).draw_mix(request.state.key, wanted)
    return Response(content, media_type="image/webp")


@router.get("/{name}/swatch.webp")
async def swatch(request: HttpRequest, name: str) -> FileResponse:
    """Moving picture of a style: 20 instants, a tenth of a second apart, one beside the other."""
    path = await _styles(request).swatch(request.state.key, name)
    return FileResponse(path, media_type="image/webp", headers={"Cache-Control": "private, max-age=86400"})


@router.patch("/{name}", status_code=204)
async def rename(request: HttpRequest, name: str, new: Annotated[str, Body(embed=True, alias="name")]) -> Response:
    """Rename an own style, in projects, too."""
    await _styles(request).rename(request.state.key, name, new)
    return Response(status_code=204)


@router.delete("/{name}", status_code=204)
async def remove(request: HttpRequest, name: str) -> Response:
    """Delete an own style, and what is painted in it."""
    await _styles(request).remove(request.state.key, name)
    return Response(status_code=204)
