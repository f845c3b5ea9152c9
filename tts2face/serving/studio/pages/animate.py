"""The page on which a project is edited: stage, timeline, and panels around them."""

from typing import Any

from fastapi import Request as HttpRequest
from nicegui import ui

from lexicon.errors import Tts2faceError
from tts2face.gestures.timeline_file import timeline_json
from tts2face.models.palette import FEATURES
from tts2face.request import OWN_FACE
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.page_addresses import PAGES
from tts2face.serving.studio.components.stage import StageElement
from tts2face.serving.studio.components.timeline import TimelineElement
from tts2face.serving.studio.editing import Edit
from tts2face.serving.studio.pages.animate_bar import Bar
from tts2face.serving.studio.pages.choices import styles
from tts2face.serving.studio.pages.frame import begin_page, heading, sentence, shown_errors
from tts2face.serving.studio.pages.inspector import Inspector
from tts2face.serving.studio.pages.speech_panel import SpeechPanel
from tts2face.serving.studio.studio import Studio
from tts2face.serving.studio.workspace import LEASE_S, Workspace

LOAD = 'import("tts2face-studio/preview.js").then((m) => m.loadPreview("%s"))'
PLAY = 'import("tts2face-studio/clock.js").then((m) => m.clock.play(0))'

SEEN_AGAIN = "studio-seen-again"  # after another tab, in which talkers and styles may have been made
WATCH = f'document.addEventListener("visibilitychange", () => document.hidden || emitEvent("{SEEN_AGAIN}"))'


def register(studio: Studio) -> None:
    """Add the page."""

    @ui.page("/animate/{project}", title="Animate - tts2face studio", response_timeout=20.0)
    async def show(request: HttpRequest, project: str) -> None:
        begin_page(request)
        try:
            workspace = await studio.open(request.state.key, project)
        except (Tts2faceError, RefusedError) as wrong:
            with ui.element("div").classes("projects"):
                heading(1, "This project cannot be opened")
                ui.label(sentence(wrong))
                ui.link("All projects", "/")
            return
        page = AnimatePage(studio, workspace)
        await page.build(request)


class AnimatePage:
    """A tab that shows a project, and edits it while no other tab does."""

    def __init__(self, studio: Studio, workspace: Workspace) -> None:
        self.studio, self.workspace = studio, workspace
        self.client = ui.context.client
        self.tab = self.client.id
        self._is_own_edit = self._plays_next = False
        self._appearance: Any = None

    @property
    def address(self) -> str:
        """Address of what the page fetches of its project."""
        return f"{PAGES}/api/projects/{self.workspace.id}"

    @property
    def face_address(self) -> str | None:
        """Address of the face, which changes with it; None for a talker's own face, which has no mesh."""
        if self.workspace.project.models.face == OWN_FACE:
            return None
        return f"{self.address}/face.glb?look={self.workspace.appearance}"

    @property
    def _preview_address(self) -> str:
        return f"{self.address}/preview?revision={self.workspace.preview.current.revision}"

    async def build(self, request: HttpRequest) -> None:
        """Build the page."""
        may_edit = self.workspace.claim(self.tab)
        self.bar, self.inspector = Bar(self, request), Inspector(self)
        self._banner()
        project = self.workspace.project
        with ui.element("div").classes("workbench"):
            with ui.element("section").classes("panel left").props('aria-label="Speech and head"'):
                self.speech = SpeechPanel(self)
                await self.speech.build()
            with ui.element("div").classes("stage"):
                self.stage = StageElement(self.face_address, project.picture.background, f"{self.address}/preview")
                self.stage.on("failed", lambda event: ui.notify(str(event.args), type="negative"))
            with ui.element("div").classes("time"):
                found = await styles(self.studio.state.library, self.workspace.key, project.models.palette)
                self.timeline = TimelineElement(
                    timeline_json(project.timeline), styles=found, lanes=self._lanes(),
                    on_edit=lambda event: self.edit(event.args),
                )  # fmt: skip
                self.timeline.on("pick", lambda event: self.inspector.show_item(event.args))
            with ui.element("section").classes("panel right").props('aria-label="Inspector"'):
                self.inspector.build(found)
        self._appearance = self._shown_face()
        self._set_enabled(may_edit)
        self.workspace.listeners.add(self._on_change)
        self._show_comparison()
        self.client.on_disconnect(lambda: self.workspace.release(self.tab))  # a reloaded page may edit at once
        self.client.on_connect(self._renew)
        self.client.on_delete(self._leave)
        # two renewals may be late before another tab may edit
        ui.timer(LEASE_S / 3, self._renew)
        ui.on(SEEN_AGAIN, self._show_models)
        ui.run_javascript(WATCH)
        self.workspace.show()

    async def edit(self, edit: Edit) -> None:
        """Change the project; what is refused is said, and the page shows the project as it is."""
        self._is_own_edit = True
        try:
            with self.client, shown_errors():
                await self.workspace.edit(edit, self.tab)
                return
            self.refresh()
        finally:
            self._is_own_edit = False

    async def undo(self) -> None:
        """Take the last edit back."""
        with shown_errors():
            self.workspace.undo(self.tab)

    async def redo(self) -> None:
        """Make the edit again that was taken back last."""
        with shown_errors():
            self.workspace.redo(self.tab)

    async def speak(self, text: str) -> None:
        """Change the text, and play as soon as its sound is there."""
        self._plays_next = True
        before = self.workspace.project
        await self.edit({"kind": "request", "options": {"text": text}})
        if self.workspace.project is before and self.workspace.preview.current.is_complete:
            self._play()

    def take_over(self) -> None:
        """Edit here in place of the other tab."""
        self.workspace.claim(self.tab, takes_over=True)

    def refresh(self) -> None:
        """Show the project as it is now."""
        project = self.workspace.project
        self._show_timeline()
        self.stage.set_environment(project.picture.background)
        self.speech.refresh()
        self.inspector.refresh()
        self.bar.refresh()

    def _show_timeline(self) -> None:
        self.timeline.set_timeline(timeline_json(self.workspace.project.timeline))
        self.timeline.set_lanes(self._lanes())

    def _lanes(self) -> list[dict[str, Any]]:
        project = self.workspace.project
        seeds = {**dict.fromkeys(FEATURES, project.seed), **project.timeline.seeds}
        return [
            {"feature": lane, "muted": lane in project.muted, "solo": lane in project.solo, "seed": seeds[lane]}
            for lane in FEATURES
        ]

    def _shown_face(self) -> tuple[str | None, str | None]:
        return self.face_address, self.workspace.project.models.palette

    def _on_change(self, what: str) -> None:
        with self.client:
            if what == "project":
                self._show_project()
            elif what == "preview":
                self._show_preview()
            elif what == "comparison":
                self._show_comparison()
            elif what == "lease":
                self._set_enabled(self.workspace.may_edit(self.tab))
            elif what == "styles":
                ui.timer(0.0, self._show_styles, once=True)
            elif what == "removed":
                ui.navigate.to("/")
            else:
                self.bar.refresh()

    def _show_project(self) -> None:
        if self._is_own_edit:  # controls show already what was entered in them
            self._show_timeline()
            self.bar.refresh()
        else:
            self.refresh()
        appearance = self._shown_face()
        if appearance != self._appearance:
            self._appearance = appearance
            self.stage.set_face(appearance[0])
            ui.timer(0.0, self._show_styles, once=True)

    async def _show_models(self) -> None:
        await self.speech.show_models()
        await self._show_styles()

    async def _show_styles(self) -> None:
        models = self.workspace.project.models
        found = await styles(self.studio.state.library, self.workspace.key, models.palette)
        self.timeline.set_styles(found)
        self.inspector.set_styles(found)
        await self.speech.show_appearance()

    def _show_preview(self) -> None:
        preview = self.workspace.preview.current
        if preview.pieces and not preview.error:
            self.stage.set_preview(self._preview_address)
            if self._plays_next and preview.is_complete:
                self._play()
        self.inspector.show_notes()
        self.inspector.compare.refresh()
        self.bar.refresh()

    def _show_comparison(self) -> None:
        comparison = self.workspace.comparison
        revision = comparison.preview.current.revision
        self.timeline.set_compare(
            f"{self.address}/comparison/preview?revision={revision}" if comparison.is_ready else None
        )
        self.inspector.compare.refresh()
        self.bar.refresh()

    def _play(self) -> None:
        self._plays_next = False
        ui.run_javascript(LOAD % self._preview_address + f".then(() => {PLAY})")

    def _banner(self) -> None:
        with ui.element("div").classes("banner").props("role=status") as self._other_tab:
            ui.label("This project is being edited in another tab. You see its changes here.")
            ui.button("Edit here", on_click=self.take_over).props("dense")

    def _set_enabled(self, is_enabled: bool) -> None:
        self._other_tab.set_visibility(not is_enabled)
        for panel in (self.bar, self.speech, self.inspector):
            panel.set_enabled(is_enabled)
        self.timeline.props(remove="inert") if is_enabled else self.timeline.props("inert")

    def _renew(self) -> None:
        if self.workspace.may_edit(self.tab):
            self.workspace.claim(self.tab)

    async def _leave(self) -> None:
        self.workspace.leave(self._on_change)
        self.bar.leave()
        self.workspace.release(self.tab)
        await self.workspace.save()
