"""The frame of all pages: style, dark mode, icons with names, and errors that are shown."""

from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from html import escape
from pathlib import Path

from fastapi import Request as HttpRequest
from nicegui import ui
from nicegui.elements.mixins.disableable_element import DisableableElement
from nicegui.events import Handler, UploadEventArguments

from lexicon.errors import Tts2faceError
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.page_addresses import PAGES
from tts2face.serving.work.resources import MB

DARK_COOKIE = "tts2face_dark"
RECORD_PAGE = "/record"  # for keys that may build talkers
TOP_PAGES = {  # names by address
    "/": "Projects",
    "/palette": "Styles",
    "/puppet": "Puppetry",
    "/reports": "Reports",
    RECORD_PAGE: "Record your own talker",
}
_NEXT_DARK = {None: True, True: False, False: None}
_DARK_NAMES = {None: "Colours of the system", True: "Dark", False: "Light"}
_FIELD_HEADER = """<div class="row no-wrap items-center q-pa-xs">
<div class="col q-uploader__title q-pl-sm">{label}</div>
<q-btn v-if="props.canAddFiles" icon="add" flat dense aria-label="{label}" @click="props.pickFiles"></q-btn>
<label style="position: relative; width: 0; overflow: hidden">{label}<q-uploader-add-trigger></q-uploader-add-trigger>
</label></div>"""
_ICONS = {None: "brightness_auto", True: "dark_mode", False: "light_mode"}


def begin_page(request: HttpRequest) -> None:
    """Style of a page, and its colours as the browser chose them last."""
    ui.add_css(_text_beside("studio.css"))
    ui.add_body_html(f'<script type="module">{_text_beside("menus.js")}</script>')
    ui.colors(primary="#1f5fbf", negative="#b3261e", positive="#1b6e3c")
    ui.dark_mode(_chosen_dark(request))


def dark_button(request: HttpRequest) -> None:
    """Button that changes between light, dark and the colours of the system."""
    dark = ui.dark_mode(_chosen_dark(request))
    button = icon_button(_ICONS[dark.value], f"Colours: {_DARK_NAMES[dark.value]}")

    def change() -> None:
        dark.value = _NEXT_DARK[dark.value]
        button.props(f'icon={_ICONS[dark.value]} aria-label="Colours: {_DARK_NAMES[dark.value]}"')
        kept = {None: "", True: "1", False: "0"}[dark.value]
        ui.run_javascript(f'document.cookie = "{DARK_COOKIE}={kept}; path={PAGES}; max-age=31536000; samesite=strict"')


@contextmanager
def page_bar(request: HttpRequest, title: str, back: tuple[str, str] | None = None) -> Iterator[None]:
    """Bar at the top of a page with its title; the block adds to it.

    Parameters
    ----------
    back
        Name and address of the page above; without it the bar links to all pages that have none above.
    """
    with ui.element("header").classes("bar"):
        if back is not None:
            name, address = back
            icon_button("arrow_back", name, lambda: ui.navigate.to(address))
        heading(1, title)
        ui.element("span").classes("grow")
        if back is None:
            _top_links(request)
        yield
        dark_button(request)


def _top_links(request: HttpRequest) -> None:
    current = request.url.path.removeprefix(PAGES) or "/"
    with ui.element("nav").classes("bar-links").props('aria-label="Pages"'):
        for address, name in TOP_PAGES.items():
            # the page would refuse everything
            if address == RECORD_PAGE and "build" not in request.state.key.scopes:
                continue
            link = ui.link(name, address)
            if address == current:
                link.props("aria-current=page")


def icon_button(icon: str, name: str, on_click: Callable[[], object] | None = None) -> ui.button:
    """Flat button with an icon, and its name for people who do not see it and as a hint."""
    button = ui.button(icon=icon, on_click=on_click).props(f'flat dense round aria-label="{escape(name)}"')
    with button:
        ui.tooltip(name)
    return button


def file_field(label: str, kinds: str, max_bytes: int, on_upload: Handler[UploadEventArguments]) -> ui.upload:
    """Field on which a file is dropped or chosen, whose button has a name; larger files are refused."""
    field = ui.upload(
        auto_upload=True, max_file_size=max_bytes, on_upload=on_upload,
        on_rejected=lambda: ui.notify(f"The file is refused: give one of {kinds} of at most {max_bytes / MB:g} MB.",
                                      type="negative"),
    )  # fmt: skip
    field.add_slot("header", _FIELD_HEADER.format(label=escape(label)))
    return field.props(f'accept="{kinds}" flat bordered').style("width: 100%")


def heading(level: int, text: str) -> None:
    """Heading of a level."""
    ui.html(f"<h{level}>{escape(text)}</h{level}>", sanitize=False)


@contextmanager
def held_dialog(dialog: ui.dialog, controls: Sequence[DisableableElement]) -> Iterator[None]:
    """Keep a dialog open and its controls without effect while something is made."""
    dialog.props("persistent")
    for control in controls:
        control.set_enabled(False)
    try:
        yield
    finally:
        dialog.props(remove="persistent")
        for control in controls:
            control.set_enabled(True)


@contextmanager
def shown_errors() -> Iterator[None]:
    """Show an error of the block as a message on the page."""
    try:
        yield
    except (Tts2faceError, RefusedError) as wrong:
        ui.notify(sentence(wrong), type="negative", multi_line=True, timeout=10_000, close_button="Close")


def sentence(wrong: Tts2faceError | RefusedError) -> str:
    """Message of an error as a sentence."""
    text = " ".join((wrong.message if isinstance(wrong, RefusedError) else str(wrong)).split())
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


async def confirm(question: str, action: str, do: Callable[[], Awaitable[None]]) -> None:
    """Ask before something that cannot be undone."""
    with ui.dialog() as dialog, ui.card():
        ui.label(question)
        with ui.row():
            ui.button(action, on_click=lambda: dialog.submit(True)).props("color=negative")
            ui.button("Cancel", on_click=lambda: dialog.submit(False)).props("flat autofocus")
    is_sure = await dialog
    dialog.delete()
    if is_sure:
        await do()


def _chosen_dark(request: HttpRequest) -> bool | None:
    return {"1": True, "0": False}.get(request.cookies.get(DARK_COOKIE, ""))


@lru_cache(maxsize=2)
def _text_beside(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")
