"""Projects on disk: each in a folder of its own with its file, its history and its assets.

``projects/ID/project.json`` is the project as the command line renders it; ``history.json`` beside it holds what can be
undone, ``owner`` the name of the key, ``assets/`` recordings, ``renders/`` finished files. All methods block.
"""

import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lexicon.dictionary import parse_dictionary
from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from lexicon.values.json_text import LARGEST_JSON_BYTES, parse_json
from tts2face.serving.studio.history import History, Step
from tts2face.serving.studio.owned_folders import OwnedFolders
from tts2face.session.project import Project
from tts2face.session.project_file import parse_project, project_json
from tts2face.storage.files import translate_disk_errors, write_atomically

if TYPE_CHECKING:
    from collections.abc import Mapping

ASSET = re.compile(r"[a-z0-9][a-z0-9-]{0,40}\.[a-z0-9]{1,5}")
PROJECT = "project.json"
HISTORY = "history.json"
ASSETS = "assets"
RENDERS = "renders"
WORDS = "words"  # folder of pronunciations that users keep for all their projects
MAX_HISTORY_BYTES = 4_000_000  # older steps beyond are not kept over a restart


@dataclass(frozen=True, slots=True)
class ProjectEntry:
    """A project in a list: name, time of its last change in seconds since 1970, and bytes with assets and renders."""

    id: str
    name: str
    changed: float
    n_bytes: int


class ProjectStore:
    """Projects of all owners in a folder, which is made at its first use."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._projects = OwnedFolders(folder / "projects", PROJECT, "project")
        self._written: dict[int, tuple[Step, str]] = {}  # steps of histories as they were written last

    def create(self, owner: str, project: Project) -> str:
        """Id of a new project of an owner."""
        number = self._projects.make(owner, ASSETS).name
        self.write(number, History(project))
        return number

    def entries(self, owner: str) -> list[ProjectEntry]:
        """Projects of an owner, those changed last first; a damaged one has its id as name."""
        return [
            ProjectEntry(folder.name, _name(folder / PROJECT), (folder / PROJECT).stat().st_mtime, _size(folder))
            for folder in self._projects.of(owner)
        ]

    def folder(self, number: str, owner: str) -> Path:
        """Folder of a project.

        Raises
        ------
        InputError
            The owner has no such project.
        """
        return self._projects.find(number, owner)

    def read(self, number: str, owner: str) -> History:
        """History of a project; without what could be undone if that file is damaged.

        Raises
        ------
        InputError
            The owner has no such project.
        DataError
            It is damaged.
        """
        folder = self.folder(number, owner)
        file = folder / PROJECT
        present = parse_project(parse_json(read_text(file, LARGEST_JSON_BYTES), str(file)), "the project", folder)
        try:
            content = parse_json(read_text(folder / HISTORY, LARGEST_JSON_BYTES), HISTORY)
            past, future = (
                tuple(
                    Step(parse_project(step["project"], HISTORY, folder), str(step["topic"])) for step in content[part]
                )
                for part in ("past", "future")
            )
        except (OSError, DataError, KeyError, TypeError):
            # what could be undone is worth less than the project
            return History(present)
        return History(present, past, future)

    def write(self, number: str, history: History) -> None:
        """Write a project, and what can be undone.

        Raises
        ------
        BackendError
            The disk is full.
        """
        folder = self._projects.at(number)
        content = json.dumps(project_json(history.present, folder), ensure_ascii=False, indent=1)
        write_atomically(folder / PROJECT, f"{content}\n".encode())
        steps = {id(step): self._step(step, folder) for step in (*history.past, *history.future)}
        self._written = {**self._written, **steps} if len(self._written) < 10_000 else steps
        past = _recent([steps[id(step)][1] for step in history.past])
        future = _recent([steps[id(step)][1] for step in history.future])
        write_atomically(folder / HISTORY, f'{{"past": [{",".join(past)}], "future": [{",".join(future)}]}}\n'.encode())

    def add_asset(self, number: str, name: str, source: Path) -> Path:
        """Path of a new asset with the content of a checked file."""
        if not ASSET.fullmatch(name):
            raise InputError(f"an asset cannot be called {name[:40]!r}")
        target = self._projects.at(number) / ASSETS / name
        with translate_disk_errors(target):
            target.parent.mkdir(exist_ok=True)
            shutil.copyfile(source, target.with_name(f".{name}"))
            target.with_name(f".{name}").replace(target)
        return target

    def remove(self, number: str, owner: str) -> None:
        """Remove a project with everything in it; errors as `folder`."""
        self._projects.remove(self.folder(number, owner).name)

    def words(self, owner: str) -> dict[str, str]:
        """Pronunciations that an owner keeps for new projects."""
        try:
            lines = read_text(self._words_file(owner), LARGEST_JSON_BYTES).splitlines()
        except OSError:
            return {}
        return dict(line.split(" ", 1) for line in lines if " " in line)

    def keep_word(self, owner: str, word: str, phones: str) -> None:
        """Keep a pronunciation for new projects, or drop it if `phones` is empty."""
        words = {known: written for known, written in self.words(owner).items() if known.lower() != word.lower()}
        words |= {word: phones} if phones else {}
        text = "".join(f"{known} {written}\n" for known, written in sorted(words.items()))
        parse_dictionary(text, "your pronunciations")
        file = self._words_file(owner)
        with translate_disk_errors(file):
            file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, text.encode())

    def _words_file(self, owner: str) -> Path:
        return self._folder / WORDS / f"{owner}.dict"

    def _step(self, step: Step, folder: Path) -> tuple[Step, str]:
        known = self._written.get(id(step))
        if known is not None and known[0] is step:
            return known
        content: Mapping[str, Any] = {"topic": step.topic, "project": project_json(step.project, folder)}
        return step, json.dumps(content, ensure_ascii=False)


def _recent(steps: list[str]) -> list[str]:
    """The last steps within `MAX_HISTORY_BYTES`."""
    left, kept = MAX_HISTORY_BYTES, []
    for step in reversed(steps):
        left -= len(step)
        if left < 0:
            break
        kept.append(step)
    return kept[::-1]


def _name(file: Path) -> str:
    try:
        return str(parse_json(read_text(file, LARGEST_JSON_BYTES), PROJECT)["name"])
    except (OSError, DataError, KeyError, TypeError):
        return file.parent.name


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
