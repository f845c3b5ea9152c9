"""An open project: edits and their history, saving, the preview, and who may edit."""

import asyncio
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lexicon.errors import InputError, Tts2faceError
from tts2face import __version__
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.messages import Work
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.comparison import ComparedProject
from tts2face.serving.studio.editing import Edit, apply
from tts2face.serving.studio.history import History
from tts2face.serving.studio.preview_bundle import Preview
from tts2face.serving.studio.previews import ProjectPreview
from tts2face.serving.studio.project_store import ProjectStore
from tts2face.serving.studio.requests import OPTION_PARTS, check_options, project_work
from tts2face.session.project import Project, cut_timeline, without_edges
from tts2face.storage.memory import ResultMemory

SAVE_S = 0.5  # between an edit and the time at which it is on disk
SAVE_AGAIN_S = 5.0  # after a failure, such as a full disk
CONTINUE_S = 1.5  # within which edits of the same kind are one step of the history
MOVE_S = 0.3  # within which an element that is removed and added has been moved
LEASE_S = 45.0  # after the last heartbeat of a tab, for which it stays the one that edits
SHOWN_ONLY = frozenset({"name"})  # kinds of edits that change neither motion nor sound
PICTURE_ONLY = frozenset({"picture"})  # kinds that change final pictures only

# gets "project", "preview", "comparison", "saved", "failed" (to save), "lease", "styles" (own palette) or "removed"
Listener = Callable[[str], None]


class Workspace:
    """An open project of a key. All methods belong to the event loop."""

    def __init__(
        self, state: ServiceState, store: ProjectStore, key: ApiKey, number: str, memory: ResultMemory
    ) -> None:
        self.id, self.key = number, key
        self._state, self._store = state, store
        self.folder: Path = store.folder(number, key.name)
        self.history: History = store.read(number, key.name)
        self.preview = ProjectPreview(
            lambda work: state.results.messages(work, self.key),
            memory,
            on_change=self._show_preview,
            on_fit=self._fit,
            on_speech=lambda seconds: state.limits.add_speech(self.key, seconds),
        )
        self.comparison = ComparedProject(state, self, memory, lambda: self._notify("comparison"))
        self.listeners: set[Listener] = set()
        self._save_task: asyncio.Task[None] | None = None
        self._saved: History = self.history
        self.save_error = ""  # why the last edits are not on disk, while that is tried again
        self._edited_at, self._last_kind = -CONTINUE_S, ""
        self._editor, self._lease_until = "", 0.0
        self._turn = asyncio.Lock()
        self.used_at = self._now()

    @property
    def project(self) -> Project:
        """The project as it is now."""
        return self.history.present

    @property
    def appearance(self) -> str:
        """Word that names what the face of the project, as it is now, is made of."""
        made_of = f"{__version__} {self.project.models} {self.project.request.has_gestures}"
        return f"{zlib.crc32(made_of.encode()):08x}"

    @property
    def is_saved(self) -> bool:
        """Whether all edits are on disk."""
        return self._saved is self.history

    def claim(self, tab: str, *, takes_over: bool = False) -> bool:
        """Whether a tab may edit: no other one does, or it takes over."""
        self.used_at = now = self._now()
        if not takes_over and self._editor not in {"", tab} and now < self._lease_until:
            return False
        is_new = self._editor != tab
        self._editor, self._lease_until = tab, now + LEASE_S
        if is_new:
            self._notify("lease")
        return True

    def may_edit(self, tab: str) -> bool:
        """Whether a tab is the one that edits, or none is."""
        return self._editor in {"", tab} or self._now() >= self._lease_until

    def release(self, tab: str) -> None:
        """End the right of a tab to edit."""
        if self._editor == tab:
            self._editor = ""
            self._notify("lease")

    async def edit(self, edit: Edit, tab: str = "") -> None:
        """Change the project, begin its new preview, and save it within `SAVE_S`."""
        self._check_tab(tab)
        async with self._turn:
            edit = await self._checked(edit)
            kind = str(edit.get("kind"))
            project = apply(self.project, edit, self.preview.current.sentences() if kind == "edge" else None)
            topic = kind + "".join(sorted(edit["options"])) if kind in OPTION_PARTS else kind.removeprefix("remove_")
            is_typing = kind in OPTION_PARTS | SHOWN_ONLY and self._now() < self._edited_at + CONTINUE_S
            is_moving = self._last_kind == f"remove_{kind}" and self._now() < self._edited_at + MOVE_S
            self._edited_at, self._last_kind = self._now(), kind
            self._set(self.history.add(project, topic, continues=is_typing or is_moving), kind)
            if kind == "pronounce" and edit.get("keep"):
                await asyncio.to_thread(
                    self._store.keep_word, self.key.name, str(edit["word"]).strip(), str(edit["phones"]).strip()
                )

    def undo(self, tab: str = "") -> None:
        """Return to the state before the last edit; errors as `edit`."""
        self._check_tab(tab)
        self._set(self.history.undo())

    def redo(self, tab: str = "") -> None:
        """Return to the state that was undone last; errors as `edit`."""
        self._check_tab(tab)
        self._set(self.history.redo())

    def show(self) -> None:
        """Begin the preview unless it is there."""
        self.used_at = self._now()
        if not self.preview.is_made and not self.preview.is_running:
            self._start_preview()
        elif self.preview.is_made:
            self.comparison.follow()

    def leave(self, listener: Listener) -> None:
        """Tell a page nothing more; without any page no preview is made."""
        self.listeners.discard(listener)
        if not self.listeners:
            self.preview.cancel()
            self.comparison.preview.cancel()

    async def work(self, kind: str, **more: Any) -> Work:
        """An order about the project as it is now; see `project_work`."""
        self.used_at = self._now()
        return await project_work(self._state, self.key, self.project, self.folder, kind, **more)

    async def save(self) -> None:
        """Write what is not on disk yet."""
        while self._saved is not self.history:
            history = self.history
            await asyncio.to_thread(self._store.write, self.id, history)
            self._saved = history
        self.save_error = ""
        self._notify("saved")

    def revise(self, change: Callable[[Project], Project]) -> None:
        """Change the project in all states of its history."""
        self._set(self.history.revise(change))

    def tell_styles(self) -> None:
        """Tell pages that the own palette has other styles."""
        self._notify("styles")

    async def close(self) -> None:
        """Save, and end the preview."""
        self.preview.cancel()
        self.comparison.preview.cancel()
        if self._save_task is not None:
            self._save_task.cancel()
        await self._try_to_save()

    def tell_removed(self) -> None:
        """Tell pages that the project is gone."""
        self._notify("removed")

    def _set(self, history: History, kind: str = "") -> None:
        if history is self.history:
            return
        self.history = history
        self._save_soon()
        self._notify("project")
        if kind not in SHOWN_ONLY | PICTURE_ONLY:
            self._start_preview()

    def _start_preview(self) -> None:
        project = self.project
        self.preview.start(lambda have: project_work(self._state, self.key, project, self.folder, "project", have=have))

    def _show_preview(self) -> None:
        if self.preview.current.is_complete and not self.preview.current.error:
            self.comparison.follow()  # after the project's own preview, which it never delays
        self._notify("preview")

    def _fit(self, shown: Preview, dropped: list[tuple[str, int]], cut_to: float | None) -> list[str]:
        """Remove from the project what no longer fits its text or sound; a note for each."""
        notes = []
        project = self.project
        sentences = shown.sentences()
        present = [(sentence.text, sentence.occurrence) for sentence in project.edges]
        dropped = [
            *dropped,
            *(gone for gone in present if gone not in sentences and gone not in dropped),
        ]
        if dropped:
            project = without_edges(project, dropped)
            notes += [
                f"the moved phone edges of {repr(text[:40]) if text else 'the recording'} were removed: its words or "
                "its sound changed"
                for text, _ in dropped
            ]
        if cut_to is not None:
            project = cut_timeline(project, cut_to)
            notes.append(f"the clip lasts {cut_to:.1f} s now; what the timeline had behind was cut")
        if notes:
            self.history = self.history.amend(project)
            self._save_soon()
            self._notify("project")
        return notes

    def _save_soon(self) -> None:
        if self._save_task is None or self._save_task.done():
            self._save_task = asyncio.get_running_loop().create_task(self._save_later())

    async def _save_later(self) -> None:
        await asyncio.sleep(SAVE_S)
        while not await self._try_to_save():
            await asyncio.sleep(SAVE_AGAIN_S)

    async def _try_to_save(self) -> bool:
        try:
            await self.save()
        except Tts2faceError as wrong:
            self.save_error = str(wrong)
            log_event("project not saved", project=self.id, reason=self.save_error)
            self._notify("failed")
            return False
        return True

    async def _checked(self, edit: Edit) -> Edit:
        kind = edit.get("kind")
        if kind in OPTION_PARTS and "options" in edit:
            return {**edit, "options": await check_options(self._state, self.key, self.folder, kind, edit["options"])}
        return edit

    def _check_tab(self, tab: str) -> None:
        """Refuse an edit while another tab edits; a program without a tab may edit while none does."""
        is_free = self.claim(tab) if tab else self.may_edit("")
        if not is_free:
            raise InputError("this project is being edited in another tab; take over to edit it here")

    def _notify(self, what: str) -> None:
        for listener in list(self.listeners):
            listener(what)

    @staticmethod
    def _now() -> float:
        return asyncio.get_running_loop().time()
