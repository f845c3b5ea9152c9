"""The bar of the page "animate": history, playing, views, files, and help."""

from typing import Any

from fastapi import Request as HttpRequest
from nicegui import ui

from tts2face.serving.studio.pages.frame import dark_button, heading, icon_button, shown_errors
from tts2face.serving.studio.pages.open_page import OpenPage
from tts2face.serving.studio.renders import RENDER, formats
from tts2face.serving.studio.work import BackgroundWork
from tts2face.serving.studio.workspace import Workspace
from tts2face.serving.work.jobs import DONE, RUNNING

CLOCK = 'import("tts2face-studio/clock.js").then((m) => '
TOGGLE_SIDES = 'import("tts2face-studio/preview.js").then((m) => m.sides.toggle())'
# Keys with the ids of the buttons that they press, and what they do. None of them acts while a text is written.
SHORTCUTS = (
    ("Space", " ", "studio-play", "Play and pause"),
    ("Home", "Home", "studio-start", "Go to the start"),
    ("Ctrl+Z", "ctrl+z", "studio-undo", "Undo"),
    ("Ctrl+Shift+Z", "ctrl+shift+z", "studio-redo", "Redo"),
    ("V", "v", "studio-select", "Select and move"),
    ("B", "b", "studio-brush", "Brush: paint the chosen style"),
    ("E", "e", "studio-eraser", "Eraser: remove styles"),
    ("A", "a", "studio-ab", "Show A or the project, where they are compared"),
    ("P", "p", "studio-picture", "Final picture of this instant"),
    ("F", "f", "studio-fullscreen", "Full screen"),
    ("X", "x", "studio-files", "Render and export"),
    ("?", "?", "studio-help", "This help"),
)
KEYS_SCRIPT = """
{
  const keys = %s;
  document.addEventListener("keydown", (event) => {
    const written = event.target.closest?.("input, textarea, select, [contenteditable=true], [role=listbox]");
    const isButton = event.target.closest?.("button, a, [role=button]");
    if (written || event.altKey || event.defaultPrevented || document.querySelector(".q-dialog")) return;
    if (event.key === " " && isButton) return;
    const held = (event.ctrlKey || event.metaKey ? "ctrl+" : "") + (event.shiftKey && event.key.length === 1
      && event.key.toLowerCase() !== event.key.toUpperCase() ? "shift+" : "");
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const id = keys[held + key] ?? (held + key === "ctrl+y" ? "studio-redo" : null);
    if (!id) return;
    event.preventDefault();
    document.getElementById(id)?.click();
  });
}
"""


class Bar:
    """The bar of a page."""

    def __init__(self, page: OpenPage, request: HttpRequest) -> None:
        self._page = page
        workspace = page.workspace
        with ui.element("header").classes("bar"):
            icon_button("arrow_back", "All projects", lambda: ui.navigate.to("/"))
            ui.html("Animate", tag="h1", sanitize=False).classes("visually-hidden")
            heading_name = ui.input(value=workspace.project.name).props(
                'dense borderless aria-label="Name of the project"'
            )
            self._name = heading_name.style("font-size: 1.1rem; font-weight: 600; width: 18rem; margin-right: 0.75rem")
            self._name.on("change", lambda: page.edit({"kind": "name", "name": self._name.value}))
            self._saved = ui.label().classes("quiet").props("role=status")
            ui.element("span").classes("grow")
            self._undo = self._button("undo", "Undo", "studio-undo", page.undo)
            self._redo = self._button("redo", "Redo", "studio-redo", page.redo)
            self._ab = icon_button("compare", "Show A or the project").props("id=studio-ab")
            self._ab.on("click", js_handler=f"() => {TOGGLE_SIDES}")
            self._picture_button()
            self._button("movie", "Render and export", "studio-files", self._open_files)
            dark_button(request)
            self._button("help_outline", "Help and keys", "studio-help", _show_help)
        keys = {key: button for _, key, button, _ in SHORTCUTS}
        ui.run_javascript(KEYS_SCRIPT % str(keys))
        self._files: ui.element | None = None
        self._listeners = page.studio.work.listeners[RENDER, workspace.key.name]
        self._listeners.add(self._show_files)
        self.refresh()

    def refresh(self) -> None:
        """Show whether all is saved, and what can be undone."""
        workspace = self._page.workspace
        if self._name.value != workspace.project.name:
            self._name.value = workspace.project.name
        self._saved.set_text(_progress(workspace))
        self._ab.set_visibility(workspace.comparison.is_ready)
        self._undo.set_enabled(bool(workspace.history.past))
        self._redo.set_enabled(bool(workspace.history.future))

    def set_enabled(self, is_enabled: bool) -> None:
        """Allow or refuse changes."""
        self._name.set_enabled(is_enabled)
        if is_enabled:
            self.refresh()
        else:
            self._undo.set_enabled(False)
            self._redo.set_enabled(False)

    def leave(self) -> None:
        """End listening."""
        self._listeners.discard(self._show_files)

    def _button(self, icon: str, name: str, number: str, on_click: Any) -> ui.button:
        return icon_button(icon, name, on_click).props(f"id={number}")

    def _picture_button(self) -> None:
        page = self._page
        show = f"(url) => {CLOCK}emit(m.clock.time))"
        button = icon_button("photo_camera", "Final picture of this instant").props("id=studio-picture")
        button.on(
            "click",
            lambda event: page.stage.show_picture(
                f"{page.address}/picture.png?time={float(event.args):.3f}&revision={page.workspace.preview.current.revision}"
            ),
            js_handler=show,
        )

    def _open_files(self) -> None:
        with ui.dialog() as dialog, ui.card().style("min-width: 26rem"):
            heading(2, "Render and export")
            ui.label("Files are made from the project as it is now; you may go on editing.").classes("quiet")
            names = {name: f"{name} - {text}" for name, text in formats().items()}
            with ui.row().style("width: 100%; align-items: center; flex-wrap: nowrap"):
                chosen = ui.select(names, value="mp4", label="Format").props("dense outlined").style("flex: 1")
                ui.button("Make", on_click=lambda: self._make(str(chosen.value)))
            self._files = ui.element("div").style("width: 100%")
            ui.button("Close", on_click=dialog.close).props("flat")
        dialog.on("hide", lambda: self._close_files(dialog))
        dialog.open()
        self._show_files()

    def _close_files(self, dialog: ui.dialog) -> None:
        self._files = None
        dialog.delete()

    async def _make(self, form: str) -> None:
        with shown_errors():
            await self._page.studio.renders.add(self._page.workspace, form)

    def _show_files(self) -> None:
        if self._files is None:
            return
        workspace, renders = self._page.workspace, self._page.studio.renders
        self._files.clear()
        with self._page.client, self._files:
            found = renders.of_project(workspace.key.name, workspace.folder)
            if not found:
                ui.label("No file has been made yet.").classes("quiet")
            for entry in reversed(found):
                self._row(entry)

    def _row(self, render: BackgroundWork) -> None:
        renders = self._page.studio.renders
        with ui.element("div").classes("project"):
            with ui.element("div").classes("grow"):
                ui.label(render.title)
                ui.label(render.message or f"{render.state}, {100 * render.share:.0f} %").classes("quiet")
                if render.state == RUNNING:
                    ui.linear_progress(render.share, show_value=False).props(f'aria-label="Progress of {render.title}"')
            if render.state == DONE:
                address = f"/api/projects/{self._page.workspace.id}/renders/{render.id}/file"
                icon_button("download", f"Download {render.title}", lambda: ui.download(address))
            icon_button(
                "close" if render.is_open else "delete", f"{'Cancel' if render.is_open else 'Delete'} {render.title}",
                lambda: renders.cancel(render),
            )  # fmt: skip


def _show_help() -> None:
    with ui.dialog() as dialog, ui.card():
        heading(2, "Keys")
        with ui.element("table").classes("examples"):
            for shown, _, _, what in SHORTCUTS:
                with ui.element("tr"):
                    with ui.element("td"):
                        ui.html(f"<kbd>{shown}</kbd>", sanitize=False)
                    with ui.element("td"):
                        ui.label(what)
        ui.label("Ctrl+Enter in the text speaks it at once. Keys act while no text is being written.").classes("quiet")
        ui.button("Close", on_click=dialog.close).props("flat autofocus")
    dialog.on("hide", dialog.delete)
    dialog.open()


def _progress(workspace: Workspace) -> str:
    if workspace.save_error:
        return f"Not saved, trying again: {workspace.save_error}"
    if workspace.preview.is_running:
        return "Making the preview"
    return "Saved" if workspace.is_saved else "Saving"
