"""The page "animate" as its panels need it."""

from typing import Any, Protocol

from nicegui import Client

from tts2face.serving.studio.components.stage import StageElement
from tts2face.serving.studio.components.timeline import TimelineElement
from tts2face.serving.studio.editing import Edit
from tts2face.serving.studio.studio import Studio
from tts2face.serving.studio.workspace import Workspace


class OpenPage(Protocol):
    """A tab that shows a project, and edits it while no other tab does."""

    studio: Studio
    workspace: Workspace
    client: Client
    tab: str
    stage: StageElement
    timeline: TimelineElement

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
