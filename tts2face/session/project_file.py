"""Project files: one JSON object with everything that makes a clip (docs/file-formats.md)."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from lexicon.errors import DataError, InputError
from lexicon.values.files import is_file, read_text
from lexicon.values.json_text import LARGEST_JSON_BYTES, parse_json
from lexicon.values.records import checked, errors_at
from tts2face.gestures.timeline_file import parse_timeline_object, timeline_json
from tts2face.lips.options import ExcludedToken
from tts2face.picture.options import Picture
from tts2face.request import Request, option_fields
from tts2face.session.corrections import SentenceEdges
from tts2face.session.named_models import Models
from tts2face.session.project import Project
from tts2face.sound.voice_urls import refuse_voice_url
from tts2face.storage.files import write_atomically

FORMAT, VERSION = "tts2face project", 2
FIRST_FACE = "head"  # that files of version 1 mean where they name none
PROJECT_SUFFIX = ".json"
# Options that name files; their paths are relative to the folder of the project.
REQUEST_FILES = ("audio", "partner", "dictionary", "text_marks", "voice")
MODEL_FILES = ("talker", "face", "palette")
PICTURE_FILES = ("background",)
Options = TypeVar("Options", Request, Models, Picture)


@dataclass(frozen=True, slots=True)
class _Edges:
    phones: tuple[str, ...]
    edges: tuple[float, ...]
    text: str = ""
    occurrence: int = 0


@dataclass(frozen=True, slots=True)
class _Written:
    format: str
    version: Any
    name: str = "untitled"
    request: Mapping[str, Any] = field(default_factory=dict)
    models: Mapping[str, Any] = field(default_factory=dict)
    picture: Mapping[str, Any] = field(default_factory=dict)
    timeline: Mapping[str, Any] = field(default_factory=dict)
    pronunciations: Mapping[str, str] = field(default_factory=dict)
    edges: tuple[_Edges, ...] = ()
    excluded: tuple[ExcludedToken, ...] = ()
    muted: frozenset[str] = frozenset()
    solo: frozenset[str] = frozenset()


def load_project(path: str | Path) -> Project:
    """A project from its file; paths in it are relative to its folder.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It is not JSON or not a project; the message names the place and the value.
    """
    file = Path(path)
    try:
        content = read_text(file, LARGEST_JSON_BYTES)
    except OSError as refused:
        raise InputError(f"cannot read the project {file}: {refused.strerror}; check the path") from refused
    return parse_project(parse_json(content, str(file)), str(file), file.parent)


def parse_project(content: Any, name: str, folder: Path) -> Project:
    """A project from its object of JSON; errors as `load_project`."""
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise DataError(f'{name} is not a project: "format" is not {FORMAT!r}; choose a file written by the studio')
    # a project of version 1 without a face shows `head` (decision 164)
    if content.get("version") not in (1, VERSION):
        raise DataError(
            f"{name} has version {content.get('version')!r}; this program reads version {VERSION}; update it"
        )
    written = checked(_Written, content, name)
    first = {"face": FIRST_FACE} if written.version == 1 else {}
    refuse_voice_url(written.request.get("voice"), name)
    with errors_at(f"{name}, request"):
        request = _options(Request, written.request, folder, REQUEST_FILES)
    with errors_at(f"{name}, models"):
        models = _options(Models, first | dict(written.models), folder, MODEL_FILES)
    with errors_at(f"{name}, picture"):
        picture = _options(Picture, written.picture, folder, PICTURE_FILES)
    with errors_at(f"{name}, edges"):
        edges = tuple(SentenceEdges(part.text, part.occurrence, part.phones, part.edges) for part in written.edges)
    timeline = parse_timeline_object(written.timeline, f"{name}, timeline")
    parts = (written.pronunciations, edges, written.excluded, written.muted, written.solo)
    with errors_at(name):
        return Project(written.name, request, models, picture, timeline, *parts)


def project_json(project: Project, folder: Path) -> dict[str, Any]:
    """The project as an object of JSON without parts that have their defaults; paths relative to a folder."""
    parts: dict[str, Any] = {
        "request": _options_json(project.request, Request(text=""), folder, REQUEST_FILES),
        "models": _options_json(project.models, Models(), folder, MODEL_FILES),
        "picture": _options_json(project.picture, Picture(), folder, PICTURE_FILES),
        "timeline": timeline_json(project.timeline),
        "pronunciations": dict(project.pronunciations),
        "edges": [
            {"text": part.text, "occurrence": part.occurrence, "phones": list(part.phones), "edges": list(part.edges)}
            for part in project.edges
        ],
        "excluded": [{"utterance": token.utterance, "start": token.start} for token in project.excluded],
        "muted": sorted(project.muted),
        "solo": sorted(project.solo),
    }
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": project.name,
        **{key: value for key, value in parts.items() if value},
    }


def save_project(project: Project, path: str | Path) -> None:
    """Write a project to its file, which appears when it is complete; an earlier one is replaced.

    Raises
    ------
    BackendError
        The file cannot be written.
    """
    file = Path(path)
    content = json.dumps(project_json(project, file.parent), ensure_ascii=False, indent=1)
    write_atomically(file, f"{content}\n".encode())


def _options(kind: type[Options], given: Mapping[str, Any], folder: Path, files: tuple[str, ...]) -> Options:
    known = {option.name for option in option_fields(kind)}
    chosen = dict(given)
    for name in chosen:
        if name not in known:
            raise InputError(f"there is no option {name!r}; choose {', '.join(sorted(known))}")
    for name in files:
        value = chosen.get(name)
        if isinstance(value, str) and is_file(folder / value):
            chosen[name] = str(folder / value)
    return kind(**chosen)


def _options_json(options: Options, default: Options, folder: Path, files: tuple[str, ...]) -> dict[str, Any]:
    chosen = {}
    for option in option_fields(type(options)):
        value = getattr(options, option.name)
        if value == getattr(default, option.name):
            continue
        if option.name in files and is_file(Path(value)):
            # a project and its files can be moved together
            value = os.path.relpath(value, folder)
        chosen[option.name] = str(value) if isinstance(value, Path) else value
    return chosen
