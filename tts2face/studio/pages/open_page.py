"""What the panels of the page "animate" need of it."""

from typing import Any, Protocol

from nicegui import Client

from tts2face.studio.components.stage import Stage
from tts2face.studio.components.timeline import Timeline
from tts2face.studio.projects.editing import Edit
from tts2face.studio.projects.workspace import Workspace
from tts2face.studio.studio import Studio


class OpenPage(Protocol):
    """A tab that shows a project, and edits it while no other tab does."""

    studio: Studio
    workspace: Workspace
    client: Client
    tab: str
    stage: Stage
    timeline: Timeline

    @property
    def address(self) -> str:
        """Address of what the page fetches of its project."""

    async def edit(self, edit: Edit) -> Any:
        """Change the project."""

    async def undo(self) -> Any:
        """Take the last edit back."""

    async def redo(self) -> Any:
        """Make the edit again that was taken back last."""

    async def speak(self, text: str) -> Any:
        """Change the text."""
