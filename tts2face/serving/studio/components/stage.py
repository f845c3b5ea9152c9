"""The stage of a page: the head in WebGL, driven by the clock of the page's sound."""

from pathlib import Path

import nicegui.elements.scene.scene  # noqa: F401 - registers the module "nicegui-scene"
from nicegui.element import Element

COMPONENTS = Path(__file__).parent
# Modules that the components share, under this name in the page's import map.
MODULES = "tts2face-studio"


class StageElement(Element, component="stage.js", esm={MODULES: str(COMPONENTS)}):
    """Head of a project in WebGL.

    Parameters
    ----------
    face
        Address of the face as `exports.stage_glb.stage_glb` makes it; None shows how to choose one.
    environment
        ``studio`` for the renderer's wall, or a colour #rrggbb.
    preview
        Address of the preview bundle that is loaded first.

    Notes
    -----
    Emits ``view`` with the name of the chosen camera, and ``failed`` with one sentence.
    """

    def __init__(self, face: str | None, environment: str = "studio", preview: str | None = None) -> None:
        super().__init__()
        self._props.update(face=face, environment=environment, preview=preview)

    def set_face(self, url: str | None) -> None:
        """Show another face."""
        self._props["face"] = url
        self.update()

    def set_environment(self, environment: str) -> None:
        """Change the background."""
        self._props["environment"] = environment
        self.update()

    def set_preview(self, url: str) -> None:
        """Fetch what has changed of a preview; the timeline of the page shows it, too."""
        self.run_method("setPreview", url)

    def view(self, name: str) -> None:
        """Choose a camera of `tts2face.picture.camera_view.NAMED_VIEWS`."""
        self.run_method("view", name)

    def show_picture(self, url: str | None) -> None:
        """Lay a rendered picture over the head; None removes it."""
        self.run_method("showPicture", url)
