"""The pages of reports: those that exist and new ones, and one report inside the studio."""

import time
from html import escape

from fastapi import Request as HttpRequest
from nicegui import ui

from lexicon.errors import InputError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.studio.pages.choices import models
from tts2face.serving.studio.pages.frame import begin_page, confirm, heading, icon_button, page_bar, shown_errors
from tts2face.serving.studio.reports import KINDS, REPORT
from tts2face.serving.studio.studio import Studio
from tts2face.serving.studio.work import BackgroundWork
from tts2face.serving.work.jobs import DONE, RUNNING

ALL_REPORTS = ("All reports", "/reports")
# Loads a report into its frame in the colours of the studio: a frame knows only those of the system.
LOAD = """
{
  const frame = document.getElementById("studio-report"), address = "%s";
  const dark = "@media (prefers-color-scheme: dark)";
  let text = null, shown = "";
  const show = () => {
    const isDark = document.body.classList.contains("body--dark"), now = `@media ${isDark ? "all" : "not all"}`;
    if (text === null || now === shown) return;
    shown = now;
    const scheme = `color-scheme: ${isDark ? "dark" : "light"}`;
    frame.srcdoc = text.replaceAll(dark, now).replace("color-scheme: light dark", scheme);
  };
  new MutationObserver(show).observe(document.body, { attributeFilter: ["class"] });
  fetch(address).then((answer) => answer.text()).then((content) => { text = content; show(); });
}
"""


def register(studio: Studio) -> None:
    """Add the pages."""

    @ui.page("/reports", title="Reports - tts2face studio")
    async def show(request: HttpRequest) -> None:
        begin_page(request)
        await ReportsPage(studio, request.state.key).build(request)

    @ui.page("/reports/{number}", title="Report - tts2face studio")
    async def show_one(request: HttpRequest, number: str) -> None:
        begin_page(request)
        try:
            report = studio.reports.find(request.state.key.name, number)
            studio.reports.page(report)
        except InputError as wrong:
            with page_bar(request, "This report cannot be shown", ALL_REPORTS):
                ui.label(str(wrong))
            return
        with page_bar(request, report.title, ALL_REPORTS):
            pass
        with ui.element("div").classes("report"):
            ui.element("iframe").props(f'id=studio-report sandbox="" title="{escape(report.title)}"')
        ui.run_javascript(LOAD % f"/studio/api/reports/{report.id}/page")


class ReportsPage:
    """The list of reports of a key, and the ways to make a new one."""

    def __init__(self, studio: Studio, key: ApiKey) -> None:
        self._studio, self._key = studio, key
        self._client = ui.context.client

    async def build(self, request: HttpRequest) -> None:
        """Build the page."""
        with page_bar(request, "Reports"):
            pass
        with ui.element("div").classes("projects"):
            with ui.element("section").classes("panel"):
                heading(2, "New report")
                ui.label(
                    "What the recordings of a talker or a palette hold: which phones look alike, how accurate lips are "
                    "for recordings that were held out, how gestures compare with noise. It takes minutes, in the "
                    "background."
                ).classes("quiet")
                with ui.row().style("align-items: center"):
                    kinds = {kind: title for kind, (_, title) in KINDS.items()}
                    self._kind = ui.select(kinds, value="similarity", label="Report", on_change=self._offer)
                    self._kind.props("dense outlined options-dense").style("min-width: 16rem")
                    self._model = ui.select([], label="Of").props("dense outlined options-dense")
                    self._model.style("min-width: 12rem")
                    ui.button("Make", on_click=self._make)
            with ui.element("section").classes("panel"):
                heading(2, "Reports")
                self._list = ui.element("div")
        await self._offer()
        self._show()
        listeners = self._studio.work.listeners[REPORT, self._key.name]
        listeners.add(self._show)
        self._client.on_delete(lambda: listeners.discard(self._show))

    async def _offer(self) -> None:
        names = await models(self._studio.state.library, self._key, KINDS[str(self._kind.value)][0])
        self._model.set_options(names, value=names[0])

    async def _make(self) -> None:
        with shown_errors():
            self._studio.check_scope(self._key)
            await self._studio.reports.add(self._key, str(self._kind.value), str(self._model.value))

    def _show(self) -> None:
        self._list.clear()
        with self._client, self._list:
            found = self._studio.reports.of_owner(self._key.name)
            if not found:
                ui.label("There is no report yet. Choose what to report of which model, and make it.").classes("quiet")
            for report in found:
                self._row(report)

    def _row(self, report: BackgroundWork) -> None:
        with ui.element("div").classes("project"):
            with ui.element("div").classes("grow"):
                if report.state == DONE:
                    ui.link(report.title, f"/reports/{report.id}").classes("open")
                    ui.label(time.strftime("%Y-%m-%d %H:%M", time.localtime(report.content["created"]))).classes(
                        "quiet"
                    )
                else:
                    ui.label(report.title)
                    said = f"{report.stage}, {100 * report.share:.0f} %" if report.of else report.stage
                    ui.label(report.message or said or report.state).classes("quiet").props("role=status")
                if report.state == RUNNING:
                    progress = ui.linear_progress(report.share, show_value=False)
                    progress.props(f'aria-label="Progress of {escape(report.title)}"')
            icon_button(
                "close" if report.is_open else "delete", f"{'Cancel' if report.is_open else 'Delete'} {report.title}",
                lambda: self._ask_remove(report),
            )  # fmt: skip

    async def _ask_remove(self, report: BackgroundWork) -> None:
        if report.state != DONE:
            self._studio.work.remove(report)
            return

        async def remove() -> None:
            with shown_errors():
                self._studio.work.remove(report)

        await confirm(f"Delete the report {report.title!r}? This cannot be undone.", "Delete", remove)
