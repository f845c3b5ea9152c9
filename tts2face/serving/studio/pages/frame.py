"""What all pages share: style, dark mode, icons with names, and errors that are shown.

What a person can choose from in a project: voices, languages, models, styles with their colours.

What the panels of the page "animate" need of it.

The page on which a person gives an API key, which a cookie then keeps.
"""

import asyncio
import html
import os
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Any, Protocol

from fastapi import APIRouter, Form
from fastapi import Request as HttpRequest
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from nicegui import Client, ui

from lexicon.errors import Tts2faceError
from tts2face.request import OWN_FACE
from tts2face.serving.service.browser_key import set_cookie
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import Library, shipped_names
from tts2face.serving.service.page_addresses import LOGIN_PATH, PAGES
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.components.stage import StageElement
from tts2face.serving.studio.components.timeline import TimelineElement
from tts2face.serving.studio.editing import Edit
from tts2face.serving.studio.studio import Studio
from tts2face.serving.studio.workspace import Workspace
from tts2face.serving.work.resource_check import FACE, PALETTE
from tts2face.session import catalogue
from tts2face.storage.shipped import find_file

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
_ICONS = {None: "brightness_auto", True: "dark_mode", False: "light_mode"}


def begin_page(request: HttpRequest) -> None:
    """Style of a page, and its colours as the browser chose them last."""
    ui.add_css(_style())
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


def heading(level: int, text: str) -> None:
    """Heading of a level."""
    ui.html(f"<h{level}>{escape(text)}</h{level}>", sanitize=False)


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


@lru_cache(maxsize=1)
def _style() -> str:
    return Path(__file__).with_name("studio.css").read_text(encoding="utf-8")


# Of styles in their order: far apart in hue and lightness also for colour-blind people (Okabe and Ito 2008, extended).
COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#7f3fbf", "#b5bd00", "#5d6d7e",
    "#c0392b", "#17706e",
)  # fmt: skip


@lru_cache(maxsize=1)
def voices() -> dict[str, str]:
    """Voices by name with what is said of them; the empty one is the best for the language."""
    found = {
        one.name: f"{one.name} - {one.summary}" for one in catalogue.voices() if one.languages and one.is_installed
    }
    return {"": "best for the language", **found}


@lru_cache(maxsize=1)
def languages() -> dict[str, str]:
    """Languages by code."""
    return {one.code: f"{one.name} ({one.code})" for one in catalogue.languages()}


def _haircuts(face: str) -> dict[str, str]:
    return {one.name: f"{one.name} - {one.summary}" for one in catalogue.haircuts_of(face)}


@lru_cache(maxsize=1)
def _hair_colours() -> dict[str, str]:
    return {one.name: one.name for one in catalogue.hair_colors()}


async def models(library: Library, key: ApiKey, kind: str) -> list[str]:
    """Names of the shipped models of a kind and of those that a key has uploaded."""
    own = await asyncio.to_thread(library.uploads, kind, key.name)
    more = [OWN_FACE] if kind == FACE else []
    return [*shipped_names(kind), *more, *(one.name for one in own)]


async def looks(library: Library, key: ApiKey, face: str) -> dict[str, dict[str, str]]:
    """Identities, haircuts and hair colours of a face by the names of the options; the empty one is its own."""
    names: tuple[str, ...] = ()
    takes_haircuts = False
    if face in shipped_names(FACE):
        entry = await asyncio.to_thread(catalogue.describe_face, find_file(face, FACE))
        names, takes_haircuts = entry.identities, entry.takes_haircuts
    elif face != OWN_FACE:
        with suppress(RefusedError):  # the face has been deleted; the preview says so
            about = (await asyncio.to_thread(library.resolve, key, FACE, face))[1]
            names, takes_haircuts = tuple(about["identities"]), about.get("takes_haircuts", True)
    own = {"": "as the face"}
    return {
        "identity": own | {name: name for name in names},
        "hair": own | (_haircuts(face) if takes_haircuts else {}),
        "hair_color": own | (_hair_colours() if takes_haircuts else {}),
    }


async def styles(library: Library, key: ApiKey, palette: str | None) -> list[dict[str, str]]:
    """Styles of a palette with a colour for each; none without a palette, or if it has been deleted."""
    if palette is None:
        return []
    try:
        path = palette  # the own palette is given as its path, which no client can choose
        if palette not in shipped_names(PALETTE) and os.sep not in palette:
            path, _ = await asyncio.to_thread(library.resolve, key, PALETTE, palette)
        found = await asyncio.to_thread(catalogue.styles, path)
    except (RefusedError, Tts2faceError):
        return []
    return [
        {"name": one.name, "color": COLOURS[number % len(COLOURS)], "summary": one.summary}
        for number, one in enumerate(found)
    ]


class OpenPage(Protocol):
    """A tab that shows a project, and edits it while no other tab does."""

    studio: Studio
    workspace: Workspace
    client: Client
    tab: str
    stage: StageElement
    timeline: TimelineElement

    @property
    def address(self) -> str:
        """Address of what the page fetches of its project."""

    async def edit(self, edit: Edit) -> Any:
        """Change the project."""

    async def undo(self) -> Any:
        """Take the last edit back."""

    async def redo(self) -> Any:
        """Make the edit again that was taken back last."""

    async def speak(self, text: str) -> Any:
        """Change the text."""


LOGOUT_PATH = f"{PAGES}/logout"
TEMPLATE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Log in - tts2face studio</title>
<style>
:root {{ color-scheme: light dark; --text: #1c2430; --line: #5f6b7a; --field: #fff; --back: #f3f5f8;
  --action: #1f5fbf; }}
@media (prefers-color-scheme: dark) {{
  :root {{ --text: #e7ebf0; --line: #93a0b0; --field: #1b2129; --back: #12161c; --action: #2a6fd6; }}
}}
body {{ margin: 0; min-height: 100vh; display: grid; place-items: center; background: var(--back); color: var(--text);
  font: 16px/1.5 system-ui, sans-serif; }}
main {{ width: min(24rem, 90vw); }}
h1 {{ font-size: 1.4rem; }}
label {{ display: block; font-weight: 600; margin-bottom: .4rem; }}
input, button {{ box-sizing: border-box; width: 100%; font: inherit; padding: .6rem; border-radius: .3rem; }}
input {{ border: 1px solid var(--line); background: var(--field); color: inherit; }}
button {{ margin-top: 1rem; border: 0; background: var(--action); color: #fff; font-weight: 600; cursor: pointer; }}
:focus-visible {{ outline: 3px solid var(--action); outline-offset: 2px; }}
</style>
</head>
<body><main>
<h1>tts2face studio</h1>
{message}
<form method="post" action="{path}">
<label for="key">API key</label>
<input id="key" name="key" type="password" autocomplete="current-password" required autofocus>
<button type="submit">Log in</button>
</form>
<p>The operator of this service makes keys with <code>tts2face keys add</code>.</p>
</main></body></html>
"""


def make_router(state: ServiceState) -> APIRouter:
    """Routes of the login."""
    router = APIRouter(include_in_schema=False)

    @router.get(LOGIN_PATH)
    async def show_form() -> Response:
        if state.keys.is_open:
            return RedirectResponse(f"{PAGES}/", 303)
        return _page("")

    @router.post(LOGIN_PATH)
    async def log_in(request: HttpRequest, key: str = Form(default="", max_length=200)) -> Response:
        try:
            state.keys.find(key)
        except RefusedError as refused:
            request.state.exchange.code = refused.code
            return _page("This key is unknown. Check it, or ask the operator for another one.", 401)
        answer = RedirectResponse(f"{PAGES}/", 303)
        answer.headers["Set-Cookie"] = set_cookie(key, is_secure=request.url.scheme == "https")
        return answer

    @router.post(LOGOUT_PATH)
    async def log_out(request: HttpRequest) -> Response:
        answer = RedirectResponse(LOGIN_PATH, 303)
        answer.headers["Set-Cookie"] = set_cookie("", is_secure=request.url.scheme == "https")
        return answer

    return router


def _page(message: str, status: int = 200) -> HTMLResponse:
    shown = f'<p role="alert">{html.escape(message)}</p>' if message else ""
    return HTMLResponse(TEMPLATE.format(message=shown, path=LOGIN_PATH), status)
