"""A project with all files that it needs, for the command line on another computer."""

import io
import shutil
import tempfile
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from tts2face.serving.studio.project_store import PROJECT
from tts2face.session.project import Project
from tts2face.session.project_file import MODEL_FILES, REQUEST_FILES, save_project


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
