"""Projects on disk: each in a folder of its own with its file, its history and its assets.

``projects/ID/project.json`` is the project as the command line renders it; ``history.json`` beside it holds what can be
undone, ``owner`` the name of the key, ``assets/`` recordings, ``renders/`` finished files. All methods block.

A project with all files that it needs, for the command line on another computer.

The own styles of each owner on disk: one palette file, which also holds the shipped styles, and the take in work.

``palettes/OWNER.styles/my-styles.palette`` exists while there are own styles; ``swatches/`` their moving pictures;
``take/`` the one take of which a style is to be made, until it is made or deleted. All methods block.
"""

import hashlib
import io
import json
import os
import re
import shutil
import tempfile
import threading
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from lexicon.dictionary import parse_dictionary
from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from lexicon.values.json_text import LARGEST_JSON_BYTES, parse_json
from tts2face import __version__
from tts2face.models.palette import Palette, load_palette, write_palette
from tts2face.serving.studio.editing import History, Step
from tts2face.serving.studio.recordings import OwnedFolders
from tts2face.session.named_models import Models
from tts2face.session.project import Project
from tts2face.session.project_file import MODEL_FILES, REQUEST_FILES, parse_project, project_json, save_project
from tts2face.storage.files import translate_disk_errors, write_atomically

ASSET = re.compile(r"[a-z0-9][a-z0-9-]{0,40}\.[a-z0-9]{1,5}")
PROJECT, HISTORY, ASSETS, RENDERS = "project.json", "history.json", "assets", "renders"
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
            ProjectEntry(one.name, _name(one / PROJECT), (one / PROJECT).stat().st_mtime, _size(one))
            for one in self._projects.of(owner)
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
                tuple(Step(parse_project(one["project"], HISTORY, folder), str(one["topic"])) for one in content[part])
                for part in ("past", "future")
            )
        except (OSError, DataError, KeyError, TypeError):
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
        """Keep a pronunciation for new projects, or drop it if `phones` is empty.

        Raises
        ------
        DataError
            It is invalid.
        """
        words = {one: written for one, written in self.words(owner).items() if one.lower() != word.lower()}
        words |= {word: phones} if phones else {}
        text = "".join(f"{one} {written}\n" for one, written in sorted(words.items()))
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


def has_files(project: Project) -> bool:
    """Whether a project needs files beside its own."""
    return bool(_files(project.request, REQUEST_FILES) or _files(project.models, MODEL_FILES))


def archive(project: Project) -> bytes:
    """A .zip file: ``project.json``, and beside it the files that it names."""
    with tempfile.TemporaryDirectory(prefix="tts2face-archive-") as made:
        folder, content = Path(made), io.BytesIO()
        request = _beside(project.request, REQUEST_FILES, folder)
        models = _beside(project.models, MODEL_FILES, folder)
        save_project(replace(project, request=request, models=models), folder / PROJECT)
        with zipfile.ZipFile(content, "w") as packed:
            for file in sorted(folder.iterdir()):
                member = zipfile.ZipInfo(file.name)  # dated 1980: the same project gives the same bytes at any time
                packed.writestr(member, file.read_bytes(), zipfile.ZIP_DEFLATED, compresslevel=1)
        return content.getvalue()


def _files(options: Any, names: tuple[str, ...]) -> dict[str, Path]:
    given = {name: getattr(options, name) for name in names}
    return {name: Path(value) for name, value in given.items() if value is not None and Path(value).is_file()}


def _beside(options: Any, names: tuple[str, ...], folder: Path) -> Any:
    found = _files(options, names)
    for path in found.values():
        shutil.copyfile(path, folder / path.name)
    kinds = {name: type(getattr(options, name)) for name in found}
    return replace(options, **{name: kinds[name](folder / path.name) for name, path in found.items()})


SHIPPED = str(Models().palette)
MY_STYLES = "my-styles"  # name of the palette for clients
FILE = f"{MY_STYLES}.palette"
MAX_OWN_STYLES = 50
TAKE, CACHE, MADE = "take", "cache", "made.palette"
SUFFIXES = frozenset({".webm", ".mp4", ".mov", ".mkv", ".avi", ".mpg", ".csv"})  # of takes


def own_palette(studio: Path, owner: str) -> Path:
    """Path of the palette of an owner, who may have none."""
    return studio / "palettes" / f"{owner}.styles" / FILE


def is_own_palette(name: str, own: Path) -> bool:
    """Whether a name or a path in a project means an owner's own palette."""
    return name in {MY_STYLES, FILE} or (os.sep in name and os.path.normpath(name) == str(own))


class PaletteStore:
    """Own styles of all owners in the folder of a studio."""

    def __init__(self, studio: Path) -> None:
        self._studio = studio
        self._lock = threading.Lock()

    def path(self, owner: str) -> Path:
        """Path of an owner's palette; there is no file without own styles."""
        return own_palette(self._studio, owner)

    def read(self, owner: str) -> Palette:
        """The owner's palette; the shipped one while there are no own styles.

        Raises
        ------
        DataError
            It is damaged.
        """
        path = self.path(owner)
        return load_palette(str(path)) if path.is_file() else shipped()

    def own_names(self, owner: str) -> tuple[str, ...]:
        """Names of the own styles, derived ones first."""
        return _own_names(self.read(owner))

    def base(self, owner: str) -> str:
        """Palette to which a style is added: the own one, or the shipped one."""
        path = self.path(owner)
        return str(path) if path.is_file() else SHIPPED

    def change(self, owner: str, change: Callable[[Palette], Palette]) -> None:
        """Replace the palette by a changed one; without own styles, the file is removed.

        Raises
        ------
        InputError
            `change` refuses, or there are too many styles.
        BackendError
            The file cannot be written.
        """
        with self._lock:
            before = self.read(owner)
            after = change(before)
            names, path = _own_names(after), self.path(owner)
            if len(names) > max(MAX_OWN_STYLES, len(_own_names(before))):
                raise InputError(f"there are {MAX_OWN_STYLES} own styles already; delete one")
            with translate_disk_errors(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                if names:
                    write_palette(path, after)
                else:
                    path.unlink(missing_ok=True)
            for gone in set(_own_names(before)) - set(names):
                self.swatch(owner, gone).unlink(missing_ok=True)

    def swatch(self, owner: str, style: str) -> Path:
        """File of the moving picture of a style, which may not exist yet."""
        own = style not in shipped().names
        folder = self.path(owner).parent / "swatches" if own else self._studio / "swatches"
        return folder / f"{hashlib.sha256(f'{__version__} {style}'.encode()).hexdigest()[:24]}.webp"

    def take_folder(self, owner: str) -> Path:
        """Folder of the take, which may not exist."""
        return self.path(owner).parent / TAKE

    def take(self, owner: str) -> Path | None:
        """The take of which a style is to be made."""
        return next((file for file in self.take_folder(owner).glob("take.*") if file.suffix in SUFFIXES), None)

    def put_take(self, owner: str, source: Path, suffix: str, sound: Path | None = None) -> Path:
        """Keep a file, which is moved, as the take in place of an earlier one; the sound of a table is copied.

        Raises
        ------
        InputError
            Its ending is not one of `SUFFIXES`.
        """
        if suffix not in SUFFIXES:
            raise InputError(f"a take {suffix[:10]!r} cannot be read; give {', '.join(sorted(SUFFIXES))}")
        self.delete_take(owner)
        target = self.take_folder(owner) / f"take{suffix}"
        with translate_disk_errors(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.move(source, target)
            if sound is not None:
                shutil.copyfile(sound, target.with_suffix(".wav"))
        return target

    def delete_take(self, owner: str) -> None:
        """Delete the take, and what its check and the making of a style have stored of it."""
        folder = self.take_folder(owner)
        with translate_disk_errors(folder):
            if folder.is_dir():
                shutil.rmtree(folder)


@lru_cache(maxsize=1)
def shipped() -> Palette:
    """The shipped palette."""
    return load_palette(SHIPPED)


def _own_names(palette: Palette) -> tuple[str, ...]:
    known = shipped().names
    return tuple(name for name in palette.names if name not in known)
