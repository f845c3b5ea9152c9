"""A dialog in which a picture of a person becomes a face of the key: one that speaks in the picture, or a head."""

import asyncio
import json
import re
import shutil
import tempfile
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nicegui import events, ui

from tts2face.models.named_colours import EYE_COLOURS
from tts2face.serving.service.sent_resources import (
    AVATAR,
    MAX_NAME,
    SPEAKING_PICTURE,
    Sent,
    SentPhoto,
    find_photo_places,
    store_resource,
)
from tts2face.serving.service.uploads import UPLOAD_PREFIX, UploadFolder
from tts2face.serving.studio.components.photo_places import PhotoPlacesElement
from tts2face.serving.studio.pages.consent_form import ConsentForm
from tts2face.serving.studio.pages.frame import file_field, heading, held_dialog, shown_errors
from tts2face.serving.studio.pages.open_page import OpenPage
from tts2face.serving.work.resource_check import FACE
from tts2face.serving.work.resources import MB

PICTURES = ".jpg,.jpeg,.png,.webp,.heic,.heif,.tif,.tiff,.bmp,.gif"
TITLE = "A face from a photo"
MAKES = {SPEAKING_PICTURE: "Speaks in the picture", AVATAR: "3D head of the person"}
EYES = {"": "as in the photo"} | {name: name.replace("-", " ") for name in EYE_COLOURS}
ABOUT = {
    SPEAKING_PICTURE: "Drag lips, lids, the edge of the upper teeth and the pivot where they were found wrongly.",
    AVATAR: "The head has the person's shape, skin, eyes, hair and clothes, and turns; haircut and hair colour can be "
    "chosen afterwards. Making it takes some 15 seconds.",
}
Made = Callable[[str], Awaitable[None]]


def may_make_faces(page: OpenPage) -> bool:
    """Whether the operator allows faces of photos, and the key may add models."""
    return page.studio.state.settings.photos and "build" in page.workspace.key.scopes


class PhotoDialog:
    """Asks for a picture, a name and the person's consent; `made` gets the name of the face.

    The picture lies in a private folder while the dialog is open.
    """

    def __init__(self, page: OpenPage, made: Made) -> None:
        self._page, self._made = page, made
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._found: Mapping[str, Any] = {}
        self._fit: Mapping[str, Any] = {}
        limit = int(page.studio.state.settings.body_mb * MB)
        with ui.dialog().props(f'aria-label="{TITLE}"') as self._dialog, ui.card().classes("photo-dialog"):
            heading(2, TITLE)
            ui.label(
                "A picture of a person, a painting or a drawing, with the face from the front. The picture is deleted "
                "when the dialog is closed; every clip of a face that speaks in it says that it is synthesised."
            ).classes("quiet")
            self._upload = file_field("Choose a picture, or drop it here", PICTURES, limit, self._uploaded)
            with ui.element("div").classes("photo-found") as self._shown:
                self._makes = ui.radio(MAKES, value=SPEAKING_PICTURE, on_change=self._show_choice).props("inline dense")
                self._about = ui.label().classes("quiet")
                with ui.row().classes("items-center") as self._choices:
                    self._eyes = ui.select(EYES, label="Eyes", value="").props("dense outlined").style("width: 180px")
                    self._age_keep = ui.checkbox("Keep wrinkles")
                    self._no_glasses = ui.checkbox("Leave off glasses")
                self._places = PhotoPlacesElement(self._change)
                self._name = ui.input("Name of the face").props(f"dense outlined maxlength={MAX_NAME}")
                self._consent = ConsentForm()
            self._status = ui.label().props("role=status").classes("note")
            with ui.row():
                self._make = ui.button("Make the face", on_click=self._store)
                self._again = ui.button("Another picture", on_click=self._forget).props("outline")
                self._close = ui.button("Close", on_click=self._dialog.close).props("flat")
        self._dialog.on("hide", self._forget)
        page.client.on_delete(self._delete_picture)
        self._forget()

    def open(self) -> None:
        """Show the dialog."""
        self._dialog.open()

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        self._forget()
        self._folder = tempfile.TemporaryDirectory(prefix=UPLOAD_PREFIX)
        page, state = self._page, self._page.studio.state
        key = page.workspace.key
        folder = UploadFolder(Path(self._folder.name), state.settings, state.decoders, key.name)
        photo = folder.path / "photo"
        await event.file.save(photo)
        with shown_errors(), self._busy("Looking for lips and lids."):
            shown, self._found = await find_photo_places(state, key, folder, photo)
            self._fit = self._found["fit"]
            self._places.show(shown.read_bytes(), tuple(self._found["size"]), self._fit)
            self._name.value = self._name.value or face_name(event.file.name)
            self._show_found(True)
            self._status.text = " ".join(f"{note[:1].upper()}{note[1:]}." for note in self._found["notes"])
        if not self._shown.visible:
            self._forget()

    def _show_found(self, is_found: bool) -> None:
        for element in (self._shown, self._make, self._again):
            element.set_visibility(is_found)
        self._upload.set_visibility(not is_found)

    def _change(self, fit: Mapping[str, Any]) -> None:
        self._fit = fit

    def _show_choice(self) -> None:
        self._places.set_visibility(self._makes.value == SPEAKING_PICTURE)
        self._choices.set_visibility(self._makes.value == AVATAR)
        self._about.text = ABOUT[self._makes.value]

    async def _store(self) -> None:
        state, key = self._page.studio.state, self._page.workspace.key
        assert self._folder is not None
        photo, name = Path(self._folder.name) / "photo", (self._name.value or "").strip()

        async def save(path: Path) -> None:
            await asyncio.to_thread(shutil.copyfile, photo, path)

        consent = self._consent.statement or None
        made = SentPhoto(consent)
        if self._makes.value == AVATAR:
            switches = {"age_keep": self._age_keep.value, "no_glasses": self._no_glasses.value}
            made = SentPhoto(consent, AVATAR, eye_color=self._eyes.value or None, **switches)
        elif self._fit != self._found["fit"]:
            made = SentPhoto(consent, fit=json.dumps(self._fit))
        with shown_errors(), self._busy("The face is made."):
            sent = Sent(FACE, name, photo.stat().st_size, save, made)
            await store_resource(state, key, sent)
            self._dialog.close()
            await self._made(name)

    @contextmanager
    def _busy(self, status: str) -> Iterator[None]:
        """Show what is done, while nothing else can be."""
        controls = (self._upload, self._make, self._again, self._close)
        self._status.text = status
        try:
            with held_dialog(self._dialog, controls):
                yield
        finally:
            self._status.text = "" if self._status.text == status else self._status.text

    def _forget(self) -> None:
        """Delete the picture, and show what the dialog begins with."""
        self._delete_picture()
        self._upload.reset()
        self._places.hide()
        self._show_found(False)
        self._name.value = self._status.text = ""
        self._consent.clear()
        self._makes.value = SPEAKING_PICTURE
        self._eyes.value = ""
        self._age_keep.value = self._no_glasses.value = False
        self._show_choice()

    def _delete_picture(self) -> None:
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None


def face_name(file: str) -> str:
    """A name for the face of a picture file."""
    letters = re.sub(r"[^a-z0-9]+", "-", Path(file).stem.lower()).strip("-")
    return letters[:MAX_NAME].strip("-") or "photo"
