"""Tasks of a project for the synthesis processes, and what a client may write into a project.

A client names models, voices and assets; no path of a client reaches the file system.
"""

import os
from collections.abc import AsyncIterator, Mapping
from contextlib import aclosing
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from tts2face.picture.options import parse_size
from tts2face.processes.message import Message
from tts2face.serving.service.clip_options import check_background, check_voice, resolve_models
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.messages import Work
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.palette_store import is_own_palette, own_palette
from tts2face.serving.studio.project_store import ASSET, ASSETS
from tts2face.session.named_models import Models
from tts2face.session.project import Project
from tts2face.session.project_file import parse_project, project_json

FILE_OPTIONS = ("audio", "dictionary", "text_marks", "timeline")  # of a request
KEPT_FILES = {"audio": "import its recording", "text_marks": "add the table again"}  # with what to do without one
TASKS = tuple(f"tts2face.serving.studio.{module}:TASKS" for module in ("tasks", "comparison_tasks", "style_tasks"))
OPTION_PARTS = frozenset({"request", "models", "picture"})


async def check_options(state: ServiceState, key: ApiKey, folder: Path, part: str, given: Any) -> dict[str, Any]:
    """Options of a part of a project from a client, with the paths of assets.

    Raises
    ------
    InputError
        A model, voice, background or asset does not exist for the key.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"{part} must be an object of options, not {str(given)[:40]!r}")
    options = dict(given)
    try:
        if part == "models":
            options = await _checked_models(state, key, options)
        elif part == "picture":
            check_background(_text("background", options.get("background", "studio")) or "studio")
            _check_pixels(options.get("size"), state.settings.pixels)
        else:
            check_voice(_text("voice", options.get("voice")))
    except RefusedError as refused:
        raise InputError(refused.message) from refused
    if part == "request":
        for name in FILE_OPTIONS:
            if options.get(name) is not None:
                options[name] = _asset(name, _text(name, options[name]) or "", folder)
    return options


async def check_project(state: ServiceState, key: ApiKey, folder: Path, content: Any) -> Project:
    """Project of a client's JSON, whose models, voices and assets exist for the key."""
    if not isinstance(content, dict):
        raise DataError("the file is not a project; choose a file written by the studio")
    checked = {part: await check_options(state, key, folder, part, content.get(part, {})) for part in OPTION_PARTS}
    return parse_project({**content, **checked}, "the project", folder)


async def project_work(
    state: ServiceState, key: ApiKey, project: Project, folder: Path, kind: str, **more: Any
) -> Work:
    """Work of a kind of the tables `TASKS`; errors as `check_options`.

    Parameters
    ----------
    more
        Further fields of the work's request; ``format`` is that of the work.
    """
    chosen = {field.name: getattr(project.models, field.name) for field in fields(Models)}
    try:
        models = await _resolve(state, key, chosen)
    except RefusedError as refused:
        raise InputError(refused.message) from refused
    form = str(more.pop("format", ""))
    if state.settings.visible_mark:
        project = replace(project, picture=replace(project.picture, visible_mark=True))
    request = {
        "text": project.request.source.text,
        "project": project_json(project, folder),
        "folder": str(folder),
        **more,
    }
    return Work(kind, models, request, format=form, owner=key.name, affinity=folder.name)


async def _resolve(state: ServiceState, key: ApiKey, models: Mapping[str, Any]) -> dict[str, Any]:
    """Models as `resolve_models`, with the path of the own palette."""
    name, own = models.get("palette"), _own_palette(state, key)
    if name is None or not is_own_palette(name, own):
        return await resolve_models(state.library, key, models)
    if not own.is_file():
        raise InputError("you have no own styles; make one on the page Styles, or choose another palette")
    others = {part: value for part, value in models.items() if part != "palette"}
    return {**await resolve_models(state.library, key, others), "palette": str(own)}


async def _checked_models(state: ServiceState, key: ApiKey, options: Mapping[str, Any]) -> dict[str, Any]:
    """Options of the models, whose values exist, with the path of the own palette."""
    found = await _resolve(state, key, {name: _text(name, value) for name, value in options.items()})
    own = str(_own_palette(state, key))
    return {**options, "palette": own} if found.get("palette") == own else dict(options)


def _own_palette(state: ServiceState, key: ApiKey) -> Path:
    return own_palette(studio_folder(state), key.name)


def key_of(state: ServiceState, owner: str) -> ApiKey:
    """The key of an owner; an `InputError` if it is gone."""
    key = state.keys.named(owner)
    if key is None:
        raise InputError("its key is gone")
    return key


def studio_folder(state: ServiceState) -> Path:
    """Folder of the studio's files."""
    return Path(os.path.abspath(state.settings.data_folder)) / "studio"


async def data_of(state: ServiceState, key: ApiKey, work: Work) -> bytes:
    """All bytes of a task's result."""
    content = bytearray()
    async with aclosing(state.results.messages(work, key)) as messages:  # type: ignore[type-var]
        async for message in messages:
            content += message.payload
    return bytes(content)


async def events_of(messages: AsyncIterator[Message]) -> AsyncIterator[tuple[dict[str, Any], bytes]]:
    """Each event of a result with the bytes that follow it."""
    event: dict[str, Any] | None = None
    content = bytearray()
    async for message in messages:
        if "event" in message.content:
            if event is not None:
                yield event, bytes(content)
            event, content = message.content["event"], bytearray()
        content += message.payload
    if event is not None:
        yield event, bytes(content)


def _asset(option: str, name: str, folder: Path) -> str:
    found = folder / ASSETS / Path(name).name
    # a client names files of its project alone
    if option not in KEPT_FILES or not ASSET.fullmatch(Path(name).name) or not found.is_file():
        advice = KEPT_FILES.get(option, "give it to `tts2face render`")
        raise InputError(f"the project has no file {name[:40]!r} for {option}; remove {option}, or {advice}")
    return str(found)


def _text(name: str, value: Any) -> str | None:
    if value is not None and not isinstance(value, str):
        raise InputError(f"{name} must be a text, not {str(value)[:40]!r}")
    return value


def _check_pixels(size: Any, most: int) -> None:
    if size is not None:
        width, height = parse_size(str(size))
        if width * height > most:
            raise InputError(f"size {str(size)[:20]} has more than {most} pixels; give a smaller one")
