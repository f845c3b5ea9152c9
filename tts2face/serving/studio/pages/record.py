"""Pages that record a person: prompts, takes, the coverage of phones, and the talker that is built of them."""

import tempfile
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from fastapi import FastAPI, Request
from nicegui import events, ui

from lexicon.errors import InputError, Tts2faceError
from tts2face.interchange.exports.visemes import viseme_table
from tts2face.serving.service.page_addresses import PAGES, RECORDINGS
from tts2face.serving.studio.components.recorder import STYLE, Recorder, VisemeMap
from tts2face.serving.studio.pages.choices import languages
from tts2face.serving.studio.pages.consent_form import ConsentForm
from tts2face.serving.studio.pages.frame import RECORD_PAGE, begin_page, confirm, heading, page_bar, sentence
from tts2face.serving.studio.recorded_talker import CLIP, REPORT, TALKER
from tts2face.serving.studio.recording_work import Recordings, recording_owner
from tts2face.serving.studio.recordings import RecordingEntry
from tts2face.serving.studio.routes.recordings import recording_router

FILES = RECORDINGS.removeprefix(PAGES)  # links are relative to the mounted pages
TITLE = "Record your own talker"
RECORDINGS_LIST = ("All recordings", RECORD_PAGE)
ENGLISH = "en-us"
MAX_TEXT_BYTES = 2 << 20
MINUTES = {2: "2 minutes, 25 prompts", 5: "5 minutes, 60 prompts", 10: "10 minutes, 120 prompts"}
REFRESH_S = 0.4
FIRST_SENTENCE = "Hello, this is my own face."


def add_record_page(app: FastAPI, recordings: Recordings) -> None:
    """Add the pages to NiceGUI, which is to be mounted at `PAGES`, and their routes to the application around it."""
    app.include_router(recording_router(recordings))

    @ui.page(RECORD_PAGE, title="Record - tts2face studio", language="en-US")
    def show_list(request: Request) -> None:
        with _page(request, TITLE):
            try:
                name = recording_owner(request.state.key)
            except InputError as refused:
                _show_refusal(refused)
                return
            _list_page(recordings, name)

    @ui.page(RECORD_PAGE + "/{number}", title="Record - tts2face studio", language="en-US")
    def show_recording(request: Request, number: str) -> None:
        try:
            here = recordings.store.folder(number, recording_owner(request.state.key))
        except InputError as unknown:
            with _page(request, TITLE, RECORDINGS_LIST):
                _show_refusal(unknown)
            return
        with _page(request, f"Record {recordings.store.name(number)}", RECORDINGS_LIST):
            _RecordingPage(recordings, number, here).show()


@contextmanager
def _page(request: Request, title: str, back: tuple[str, str] | None = None) -> Iterator[None]:
    """Frame of a page around its content."""
    begin_page(request)
    ui.add_css(STYLE.read_text(encoding="utf-8"), shared=False)
    with page_bar(request, title, back):
        pass
    with ui.element("div").classes("projects record-page"):
        yield


def _show_refusal(refused: InputError) -> None:
    with ui.element("section").classes("panel"):
        heading(2, "This page cannot be used")
        ui.label(sentence(refused))
        ui.link("Go to the projects", "/")


def _list_page(recordings: Recordings, owner: str) -> None:
    entries = recordings.store.entries(owner)
    if entries:
        with ui.element("section").classes("panel"):
            heading(2, "Recordings")
            for entry in entries:
                _show_entry(entry)
    with ui.element("section").classes("panel"):
        heading(2, "New recording")
        ui.label(
            "Read sentences aloud in front of the webcam. Each take is checked while you read the next one; from two "
            "minutes on they become a talker with your lips and your face. Everything stays on the computer that runs "
            "the studio, and one button deletes all of it."
        )
        with ui.element("div").classes("record-fields"):
            name = ui.input("Name of the talker").props("outlined dense").classes("record-field")
            minutes = ui.select(MINUTES, value=5, label="Length").props("outlined dense").classes("record-field")
            language = ui.select(languages(), value=ENGLISH, label="Language", with_input=True)
            language.props("outlined dense options-dense").classes("record-field")
        text: list[bytes] = []

        async def keep_text(upload: events.UploadEventArguments) -> None:
            text[:] = [await upload.file.read()]
            chosen.text = f"Prompts are selected from {upload.file.name}."

        upload = ui.upload(auto_upload=True, max_file_size=MAX_TEXT_BYTES, on_upload=keep_text).style("display: none")
        with ui.row().style("align-items: center"):
            ui.button("Prompts from my own text", on_click=lambda: upload.run_method("pickFiles")).props("outline")
            chosen = ui.label("Needed in other languages than English: a text file (UTF-8) with some pages in them.")
            chosen.props("role=status").classes("quiet")

        async def create() -> None:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "text"
                path.write_bytes(text[0] if text else b"")
                prompts = await recordings.prompts(
                    float(minutes.value), str(language.value), str(path) if text else None
                )
            ui.navigate.to(f"{RECORD_PAGE}/{recordings.store.create(owner, name.value, prompts)}")

        ui.button("Start recording", on_click=_reporting(create)).style("width: auto; align-self: flex-start")


def _show_entry(entry: RecordingEntry) -> None:
    with ui.element("div").classes("project"), ui.element("div").classes("grow"):
        ui.link(entry.name, f"{RECORD_PAGE}/{entry.id}").classes("open")
        ui.label(f"{entry.n_accepted} of {entry.n_prompts} prompts recorded and accepted").classes("quiet")


def _reporting(action: Callable[[], Awaitable[None] | None]) -> Callable[[], Awaitable[None]]:
    """The action, which shows an error of the user's as one sentence."""

    async def run() -> None:
        try:
            result = action()
            if result is not None:
                await result
        except Tts2faceError as error:
            ui.notify(sentence(error), type="negative", multi_line=True, close_button="Close", timeout=0)

    return run


class _RecordingPage:
    """The page of one recording."""

    def __init__(self, recordings: Recordings, number: str, folder: Path) -> None:
        self._recordings = recordings
        self._number, self._folder = number, folder
        self._content = recordings.store.prompts(number)
        self._shown: object = None

    def show(self) -> None:
        """Build the page."""
        prompts = self._content["prompts"]
        with ui.element("div").classes("record-columns"):
            takes = self._takes()
            first = next((at for at in range(len(prompts)) if at not in takes), 0)
            texts = [prompt["text"] for prompt in prompts]
            with ui.element("section").classes("panel").props('aria-label="Takes"'):
                self._recorder = Recorder(texts, takes, f"{RECORDINGS}/{self._number}/takes/", first)
                self._recorder.on("remove", lambda event: self._delete_take(int(event.args)))
            with ui.element("div").classes("record-side"):
                with ui.element("section").classes("panel"):
                    heading(2, "What your takes cover")
                    ui.label(
                        "Rows: visemes and their phones. Columns: the viseme that follows. Stronger colour: more of "
                        "what running text needs."
                    ).classes("quiet")
                    running = self._content["running"]
                    visemes = {phone: viseme_table("oculus")[phone][0] for phone in running["phones"]}
                    self._map = VisemeMap(prompts, running, visemes)
                with ui.element("section").classes("panel"):
                    self._build_panel()
        self._refresh()
        ui.timer(REFRESH_S, self._refresh)

    def _build_panel(self) -> None:
        heading(2, "Your talker")
        self._count = ui.label()
        consent = ConsentForm()
        with ui.row():
            self._build = ui.button(
                "Build the talker",
                on_click=_reporting(lambda: self._recordings.build(self._number, consent.statement)),
            )
            self._cancel = ui.button("Cancel", on_click=lambda: self._recordings.cancel(self._number))
            self._cancel.props("flat")
        self._bar = ui.linear_progress(value=0, show_value=False).props('aria-label="Progress of the work"')
        self._status = ui.label().props("role=status").classes("record-status")
        with ui.element("div").classes("record-side") as self._finished:
            with ui.row():
                ui.link("Report", f"{FILES}/{self._number}/files/{REPORT}", new_tab=True)
                ui.link("Download the talker", f"{FILES}/{self._number}/files/{TALKER}")
            with ui.element("div").classes("record-sentence"):
                said = ui.input("First sentence", value=FIRST_SENTENCE).props("outlined dense").classes("record-wide")
                ui.button(
                    "Speak",
                    on_click=_reporting(lambda: self._recordings.speak(self._number, said.value or "")),
                )
            self._clip = ui.element("video").props('controls aria-label="First sentence of the talker"')
            self._clip.classes("record-clip")
        ui.button("Delete everything", icon="delete", on_click=self._confirm_deletion).props(
            "flat color=negative"
        ).style("width: auto; align-self: flex-start")

    def _takes(self) -> dict[int, dict[str, str]]:
        takes = self._recordings.store.takes(self._number)
        return {at: {"state": take.state, "advice": take.advice.rstrip(".")} for at, take in takes.items()}

    def _delete_take(self, at: int) -> None:
        self._recordings.store.delete_take(self._number, at)
        self._refresh()

    async def _confirm_deletion(self) -> None:
        async def delete() -> None:
            await self._recordings.delete(self._number)
            ui.navigate.to(RECORD_PAGE)

        await confirm(
            "Delete all takes, the report and the talker of this recording? This cannot be undone.", "Delete", delete
        )

    def _refresh(self) -> None:
        """Show what has changed."""
        work = self._recordings.work_on(self._number)
        clip = self._folder / CLIP
        now = (
            self._recordings.store.revision, work and (work.stage, work.done, work.state),
            clip.stat().st_mtime_ns if clip.is_file() else 0,
        )  # fmt: skip
        if now == self._shown or not self._folder.is_dir():
            return
        self._shown = now
        accepted = self._recordings.accepted(self._number)
        self._recorder.set_takes(self._takes())
        self._map.set_accepted(accepted)
        self._count.text = f"{len(accepted)} of {len(self._content['prompts'])} prompts recorded and accepted."
        is_running = work is not None and work.is_open
        self._build.set_enabled(bool(accepted) and not is_running)
        self._cancel.set_visibility(is_running)
        self._bar.set_visibility(is_running)
        if work is not None:
            self._bar.value = work.done / work.of if work.of else 0
            self._status.text = work.stage if is_running else work.message or work.state
        self._finished.set_visibility((self._folder / TALKER).is_file())
        self._clip.set_visibility(bool(now[2]))
        if now[2]:
            self._clip.props(f'src="{RECORDINGS}/{self._number}/files/{CLIP}?{now[2]}"')
