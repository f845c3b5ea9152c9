"""A dialog in which a character of another program becomes a face of the key."""

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import events, ui

from lexicon.errors import Tts2faceError
from tts2face.interchange.characters.shapes import TRANSFER
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.sent_resources import MAX_MAPPING, MAX_NAME, Sent, store_resource
from tts2face.serving.studio.pages.frame import file_field, heading, held_dialog, sentence
from tts2face.serving.studio.pages.open_page import OpenPage
from tts2face.serving.studio.pages.photo_dialog import Made, face_name
from tts2face.serving.work.resource_check import FACE
from tts2face.serving.work.resources import MB

TITLE = "A face from a character"
FILES = ".glb,.vrm,.zip"
SHAPES, MAPPING = "Shapes of a shipped head, for a head that has none", "Names of its shapes, if they are not found"
# what a refusal of the service names, and what stands in the dialog for it
PARTS = {"the part shapes, transfer": f"“{SHAPES}”", "in a file and give it as the part mapping": f"in “{MAPPING}”"}


def may_add_faces(page: OpenPage) -> bool:
    """Whether the key may add models."""
    return "build" in page.workspace.key.scopes


class CharacterDialog:
    """Asks for a file and a name; shows what the import found and replaced; `made` gets the name of the face."""

    def __init__(self, page: OpenPage, made: Made) -> None:
        self._page, self._made = page, made
        self._file: events.UploadEventArguments | None = None
        limit = int(page.studio.state.settings.body_mb * MB)
        with ui.dialog().props(f'aria-label="{TITLE}"') as self._dialog, ui.card().classes("photo-dialog"):
            heading(2, TITLE)
            ui.label(
                "A head or a figure of another program, .glb or .vrm; a folder of .obj files, or a .gltf file with its "
                "images, as .zip. Making the face takes up to a minute."
            ).classes("quiet")
            self._upload = file_field("Choose a file, or drop it here", FILES, limit, self._uploaded)
            self._name = ui.input("Name of the face").props(f"dense outlined maxlength={MAX_NAME}")
            self._transfer = ui.checkbox(SHAPES)
            self._mapping = ui.textarea(MAPPING, placeholder="jawOpen MouthWide").props(
                f"outlined autogrow dense maxlength={MAX_MAPPING}"
            )
            self._status = ui.label().props("role=status").classes("note")
            self._notes = ui.column().classes("quiet")
            with ui.row():
                self._make = ui.button("Make the face", on_click=self._store)
                self._close = ui.button("Close", on_click=self._dialog.close).props("flat")
        self._dialog.on("hide", self._forget)
        self._forget()

    def open(self) -> None:
        """Show the dialog."""
        self._dialog.open()

    def _uploaded(self, event: events.UploadEventArguments) -> None:
        self._file = event
        self._name.value = self._name.value or face_name(event.file.name)
        self._make.set_enabled(True)

    async def _store(self) -> None:
        assert self._file is not None
        file, name = self._file.file, (self._name.value or "").strip()
        shapes = TRANSFER if self._transfer.value else None
        sent = Sent(FACE, name, file.size(), file.save, mapping=mapping_rows(self._mapping.value or ""), shapes=shapes)
        self._notes.clear()
        with self._busy():
            stored = await store_resource(self._page.studio.state, self._page.workspace.key, sent)
            await self._made(name)
            self._status.text = f"{name} speaks now."
            with self._notes:
                for note in stored.description.get("notes", ()):
                    ui.label(note)

    @contextmanager
    def _busy(self) -> Iterator[None]:
        """Nothing else can be done meanwhile; an error is shown in the dialog, which names what helps."""
        controls = (self._upload, self._make, self._close, self._transfer, self._mapping, self._name)
        self._status.text = "The face is made."
        try:
            with held_dialog(self._dialog, controls):
                yield
        except (Tts2faceError, RefusedError) as wrong:
            text = sentence(wrong)
            for part, shown in PARTS.items():
                text = text.replace(part, shown)
            self._status.text = text

    def _forget(self) -> None:
        self._file = None
        self._upload.reset()
        self._notes.clear()
        self._name.value = self._mapping.value = self._status.text = ""
        self._transfer.value = False
        self._make.set_enabled(False)


def mapping_rows(text: str) -> str | None:
    """Text of a mapping, in whose rows a space may stand for the first tab, which a browser does not type."""
    if not text.strip() or "[" in text:
        return text.strip() or None
    return "\n".join(line if "\t" in line else "\t".join(line.split(None, 1)) for line in text.splitlines())
