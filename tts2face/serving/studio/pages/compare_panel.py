"""The part of the inspector that compares: what A is, and how alike the project and A are."""

import tempfile
import time
from collections.abc import Coroutine, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from nicegui import events, ui

from tts2face.serving.studio.comparison import MAX_TAKE_BYTES
from tts2face.serving.studio.pages.choices import models
from tts2face.serving.studio.pages.frame import file_field, heading, shown_errors
from tts2face.serving.studio.pages.open_page import OpenPage
from tts2face.serving.studio.reference import RECORDING, SETTINGS, TAKE
from tts2face.serving.work.resource_check import TALKER
from tts2face.types import HEAD_CHANNELS

RECORDINGS = "a recording of the talker"
LIVE_LINK = "a Live Link take"
SEED = "another seed"
TALKERS = "talker "
SETTINGS_OFFERED: Mapping[str, Mapping[str, Any]] = {
    "gestures from fields": {"gestures": "fields"},
    "gestures from noise": {"gestures": "noise"},
    "gestures as published (Ju and Lee 2008)": {"gestures": "ju2008"},
    "no gestures": {"gestures": "none"},
    "lips as published (Theobald et al. 2007)": {"synthesis": "theobald2007"},
}
N_CHANNELS = 10  # of the table, those that move most
LIP_NAMES = {"opening": "lip opening", "width": "lip width"}
EXPLAINED = "r: correlation at the same instants. Size: how widely the project moves, in widths of A."
OTHER_TIMES = "A has other times, so that there is no correlation; equal sentences are warped onto each other."
KNOWN = "The talker is made of this recording too: its lips are closer to it than to speech that it lacks."


class ComparePanel:
    """Choice of the other side of a comparison, and measures of both."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._measured: tuple[int, int] | None = None
        heading(2, "Compare")
        with ui.row().style("align-items: center; gap: .25rem"):
            self._keep = ui.button("Keep as A", on_click=self._keep_project).props("dense outline no-caps")
            self._end = ui.button("End", on_click=lambda: self._do(page.workspace.comparison.clear())).props(
                "dense flat no-caps"
            )
        self._choice = ui.select(
            [*SETTINGS_OFFERED, SEED, RECORDINGS, LIVE_LINK], label="Compare with", on_change=self._choose
        ).props("dense outlined options-dense").style("width: 100%")  # fmt: skip
        self._details = ui.element("div").style("width: 100%")
        self._status = ui.label().classes("quiet").props("role=status")
        self._table = ui.element("div").style("width: 100%")
        ui.timer(0.0, self._offer_talkers, once=True)
        self.refresh()

    def set_enabled(self, is_enabled: bool) -> None:
        """Allow or refuse changes."""
        for control in (self._keep, self._end, self._choice):
            control.set_enabled(is_enabled)

    def refresh(self) -> None:
        """Show what A is, and measure again where one of both has changed."""
        comparison = self._page.workspace.comparison
        reference = comparison.reference
        self._end.set_visibility(reference is not None)
        if reference is None:
            self._status.set_text(
                "Keep the project as it is now as A, or choose one; the key A then shows A or the project."
            )
        else:
            state = comparison.error or ("" if comparison.is_ready else "It is being made.")
            known = KNOWN if reference.kind == RECORDING and comparison.is_ready else ""
            self._status.set_text(f"A: {reference.label or reference.kind}. {state}{known}")
        if not comparison.is_ready:
            self._measured = None
            self._table.clear()
        elif self._page.workspace.preview.current.is_complete and self._measured != self._state():
            self._measured = self._state()
            with self._status:
                ui.timer(0.0, self._measure, once=True)

    def _state(self) -> tuple[int, int]:
        workspace = self._page.workspace
        return workspace.comparison.preview.current.revision, workspace.preview.current.revision

    async def _offer_talkers(self) -> None:
        page = self._page
        names = await models(page.studio.state.library, page.workspace.key, TALKER)
        others = [name for name in names if name != page.workspace.project.models.talker]
        self._choice.set_options([*self._choice.options, *(f"{TALKERS}{name}" for name in others)])

    async def _keep_project(self) -> None:
        await self._do(self._page.workspace.comparison.keep(f"the project as of {time.strftime('%H:%M:%S')}"))
        self._choice.value = None

    async def _choose(self, event: events.ValueChangeEventArguments[Any]) -> None:
        name, project = event.value, self._page.workspace.project
        self._details.clear()
        self._choice.run_method("blur")  # so that keys act
        if name == RECORDINGS:
            await self._offer_recordings()
        elif name == LIVE_LINK:
            self._offer_take()
        elif name == SEED:
            seed = project.seed + 1
            await self._compare({"kind": SETTINGS, "label": f"seed {seed}", "request": {"seed": seed}})
        elif name in SETTINGS_OFFERED:
            await self._compare({"kind": SETTINGS, "label": name, "request": SETTINGS_OFFERED[name]})
        elif name:
            talker = name.removeprefix(TALKERS)
            await self._compare({"kind": SETTINGS, "label": name, "models": {"talker": talker}})

    async def _offer_recordings(self) -> None:
        with shown_errors():
            found = await self._page.workspace.comparison.recordings()
            said = _words(self._page.workspace.project.request.source.text)
            found.sort(key=lambda example: _words(example[1]) != said)  # those with the project's words first
            with self._details:
                names = {name: f"{name} - {words}" if words else name for name, words in found}
                chosen = ui.select(names, label="Recording", with_input=True).props("dense outlined options-dense")
                chosen.style("width: 100%")
                offset = _offset()
                ui.button("Compare", on_click=lambda: self._compare({
                    "kind": RECORDING, "label": f"recording {chosen.value}", "recording": str(chosen.value or ""),
                    "offset": float(offset.value or 0.0),
                })).props("dense")  # fmt: skip

    def _offer_take(self) -> None:
        comparison = self._page.workspace.comparison
        with self._details:
            ui.label("A .csv file of Live Link Face, recorded with the sound of this project.").classes("quiet")
            upload = file_field("Choose a take, or drop it here", ".csv", MAX_TAKE_BYTES, self._imported)
            upload.on("finish", upload.reset)
            offset = _offset()
            ui.button("Set the offset", on_click=lambda: self._compare({
                "kind": TAKE, "label": comparison.reference.label if comparison.reference else "take",
                "offset": float(offset.value or 0.0),
            })).props("dense")  # fmt: skip

    async def _imported(self, event: events.UploadEventArguments) -> None:
        with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
            path = Path(folder, "upload")
            await event.file.save(path)
            await self._do(self._page.workspace.comparison.import_take(path, event.file.name))

    async def _compare(self, content: Mapping[str, Any]) -> None:
        await self._do(self._page.workspace.comparison.choose(content))

    async def _do(self, work: Coroutine[Any, Any, None]) -> None:
        with shown_errors():
            await work

    async def _measure(self) -> None:
        with shown_errors():
            found = await self._page.workspace.comparison.measures()
            self._table.clear()
            with self._table:
                ui.html(measures_html(found), sanitize=False)


def measures_html(found: Mapping[str, Any]) -> str:
    """Table of the fields of `tts2face.session.comparison.MotionComparison`."""
    rows = [(LIP_NAMES[measure["name"]], measure) for measure in found["lips"]]
    common = [measure for measure in found["channels"] if measure["ratio"]]
    rows += [(_channel_name(measure["name"]), measure) for measure in common[:N_CHANNELS]]
    n_single = len(found["channels"]) - len(common)
    single = f" Channels that move in one of both only: {n_single}." if n_single else ""
    cost = "-" if found["dtw_cost"] is None else f"{found['dtw_cost']:.2f}"
    lines = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{_number(row["r"])}</td><td>{_number(row["ratio"])}</td></tr>'
        for name, row in rows
    )
    return (
        '<table class="measures"><thead><tr><th scope="col">Project and A</th><th scope="col">r</th>'
        f'<th scope="col">size</th></tr></thead><tbody>{lines}</tbody></table>'
        f'<p class="quiet">Lips after time warping differ by {cost} standard deviations of A (mean). '
        f"{EXPLAINED if found['is_same_time'] else OTHER_TIMES}{single}</p>"
    )


def _channel_name(name: str) -> str:
    return f"head {name}" if name in HEAD_CHANNELS else name


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _words(text: str) -> Sequence[str]:
    return "".join(letter.lower() if letter.isalnum() else " " for letter in text).split()


def _offset() -> ui.number:
    """Field for the second of a recording at which the project's sound begins."""
    return ui.number("Begins at second", value=0.0, step=0.01, format="%.2f").props("dense outlined")
