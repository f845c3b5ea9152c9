"""The studio as its parts need it, without an import circle."""

from pathlib import Path
from typing import Protocol

from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.project_store import ProjectEntry, ProjectStore
from tts2face.serving.studio.work import WorkList
from tts2face.serving.studio.workspace import Workspace
from tts2face.session.project import Project


class StudioHost(Protocol):
    """Projects of all keys, those that are open, and the service around them (`studio.Studio`)."""

    state: ServiceState
    store: ProjectStore
    work: WorkList

    @property
    def folder(self) -> Path:
        """Folder of projects, styles and takes."""

    async def entries(self, key: ApiKey) -> list[ProjectEntry]:
        """Projects of a key."""

    async def create(self, key: ApiKey, project: Project) -> str:
        """Id of a new project."""

    async def open(self, key: ApiKey, number: str) -> Workspace:
        """An open project."""

    def open_projects(self, key: ApiKey) -> list[Workspace]:
        """Open projects of a key."""

    def check_scope(self, key: ApiKey) -> None:
        """Refuse keys that may not make speech."""
