"""A dialog in which a picture of a person becomes a face of the key."""

import re
from collections.abc import Awaitable, Callable
from pathlib import Path

from nicegui import events, ui

from tts2face.jobs.resource_check import FACE
from tts2face.service.routes.resources import MAX_CONSENT, MAX_NAME, Sent, store_resource
from tts2face.studio.pages.frame import heading, shown_errors
from tts2face.studio.pages.open_page import OpenPage

PICTURES = ".jpg,.jpeg,.png,.webp,.heic,.heif,.tif,.tiff,.bmp,.gif"
MB = 1_000_000
Made = Callable[[str], Awaitable[None]]


def may_make_faces(page: OpenPage) -> bool:
    """Whether the operator allows faces of photos, and the key may add models."""
    return page.studio.state.settings.photos and "build" in page.workspace.key.scopes


class PhotoDialog:
    """Asks for a picture, a name and the person's consent; `made` gets the name of the face."""

    def __init__(self, page: OpenPage, made: Made) -> None:
        self._page, self._made = page, made
        limit = int(page.studio.state.settings.body_mb * MB)
        with ui.dialog() as self._dialog, ui.card():
            heading(2, "A face from a photo")
            ui.label(
                "A picture of a person, a painting or a drawing, with the face from the front. The picture is deleted "
                "when the face is made; every clip of it says that it is synthesised."
            ).classes("quiet")
            self._name = ui.input("Name of the face").props(f"dense outlined maxlength={MAX_NAME}")
            self._consent = ui.textarea("Statement of consent of the person, or: drawn").props(
                f"outlined autogrow maxlength={MAX_CONSENT}"
            )
            self._status = ui.label().props("role=status").classes("note")
            self._upload = ui.upload(
                label="Choose a picture, or drop it here", auto_upload=True, max_file_size=limit,
                on_upload=self._uploaded,
                on_rejected=lambda: ui.notify(f"The file is refused: give a picture of at most {limit / MB:g} MB.",
                                              type="negative"),
            ).props(f'accept="{PICTURES}" flat bordered').style("width: 100%")  # fmt: skip
            self._upload.on("finish", self._upload.reset)
            ui.button("Close", on_click=self._dialog.close).props("flat")

    def open(self) -> None:
        """Show the dialog."""
        self._dialog.open()

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        name = (self._name.value or "").strip() or face_name(event.file.name)
        self._status.text = "The face is made."
        with shown_errors():
            sent = Sent(FACE, name, event.file.size(), event.file.save, self._consent.value or None)
            await store_resource(self._page.studio.state, self._page.workspace.key, sent)
            self._dialog.close()
            await self._made(name)
        self._status.text = ""


def face_name(file: str) -> str:
    """A name for the face of a picture file."""
    letters = re.sub(r"[^a-z0-9]+", "-", Path(file).stem.lower()).strip("-")
    return letters[:MAX_NAME].strip("-") or "photo"
