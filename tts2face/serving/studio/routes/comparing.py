"""Addresses of the comparison of a project (docs/studio.md)."""

import tempfile
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Body, File, Query, UploadFile
from fastapi import Request as HttpRequest
from fastapi.responses import Response

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.uploads import BLOCK_BYTES
from tts2face.serving.studio.comparison import NOT_READY, ComparedProject
from tts2face.serving.studio.reference import KEPT
from tts2face.serving.studio.routes.projects import API, WAIT_S, opened

router = APIRouter(prefix=f"{API}/projects/{{project}}", include_in_schema=False)


@router.get("/comparison")
async def show_comparison(request: HttpRequest, project: str) -> dict[str, Any]:
    """The other side of the comparison."""
    async with opened(request, project) as workspace:
        return comparison_state(workspace.comparison)


@router.put("/comparison")
async def choose_comparison(
    request: HttpRequest, project: str, reference: Annotated[dict[str, Any], Body(embed=True)]
) -> dict[str, Any]:
    """Compare with something else."""
    async with opened(request, project) as workspace:
        workspace.show()
        if reference.get("kind") == KEPT and "project" not in reference:
            await workspace.comparison.keep(str(reference.get("label", "")))
        else:
            await workspace.comparison.choose(reference)
        return comparison_state(workspace.comparison)


@router.delete("/comparison", status_code=204)
async def end_comparison(request: HttpRequest, project: str) -> Response:
    """Compare with nothing."""
    async with opened(request, project) as workspace:
        await workspace.comparison.clear()
    return Response(status_code=204)


@router.post("/comparison/take", status_code=201)
async def import_take(request: HttpRequest, project: str, file: Annotated[UploadFile, File()]) -> dict[str, Any]:
    """Compare with a Live Link file."""
    async with opened(request, project) as workspace:
        workspace.show()
        with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
            path = Path(folder, "upload")
            with path.open("wb") as saved:
                while block := await file.read(BLOCK_BYTES):
                    saved.write(block)
            await workspace.comparison.import_take(path, file.filename or "")
        return comparison_state(workspace.comparison)


@router.get("/comparison/preview")
async def comparison_preview(
    request: HttpRequest, project: str, have: int | None = None, wait: float = Query(default=0.0, ge=0, le=WAIT_S)
) -> Response:
    """Curves and sound of what the project is compared with, as the project's own preview."""
    async with opened(request, project) as workspace:
        comparison = workspace.comparison
        workspace.show()
        await workspace.preview.wait(wait)
        comparison.follow()
        await comparison.preview.wait(wait)
        content = comparison.preview.bundle(have) if comparison.is_ready else None
        if content is None and comparison.preview.is_running:  # contents that were dropped are made again
            await comparison.preview.wait(WAIT_S if comparison.is_ready else 0.0)
            content = comparison.preview.bundle(have) if comparison.is_ready else None
        if content is None:
            raise RefusedError(409, "not_ready", comparison.error or NOT_READY)
        return Response(content, media_type="application/octet-stream")


@router.get("/comparison/measures")
async def comparison_measures(request: HttpRequest, project: str) -> dict[str, Any]:
    """How alike the two are."""
    async with opened(request, project) as workspace:
        return await workspace.comparison.measures()


@router.get("/recordings")
async def talker_recordings(request: HttpRequest, project: str) -> list[tuple[str, str]]:
    """Recordings of the project's talker: names and words."""
    async with opened(request, project) as workspace:
        return await workspace.comparison.recordings()


def comparison_state(comparison: ComparedProject) -> dict[str, Any]:
    """JSON of a comparison."""
    reference = comparison.reference
    return {
        "kind": None if reference is None else reference.kind, "label": "" if reference is None else reference.label,
        "is_ready": comparison.is_ready, "error": comparison.error, "revision": comparison.preview.current.revision,
    }  # fmt: skip
