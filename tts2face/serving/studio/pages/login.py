"""The page on which a person gives an API key, which a cookie then keeps."""

import html

from fastapi import APIRouter, Form
from fastapi import Request as HttpRequest
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.page_addresses import LOGIN_PATH, PAGES, set_cookie
from tts2face.serving.service.state import ServiceState

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
