"""Who may use the studio, and what its pages may do in a browser."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from starlette.testclient import TestClient, WebSocketDenialResponse

from tests.running import eventually
from tests.serving.service.in_process import another_client
from tts2face.serving.service.page_addresses import COOKIE, POLICY, cookie_key, set_cookie

HTML = {"Accept": "text/html"}
CONNECTIONS = ("/_nicegui_ws/socket.io/?EIO=4&transport=websocket", "/api/takes/live")


@contextmanager
def browser(closed: TestClient, key: str = "") -> Iterator[TestClient]:
    client = another_client(closed, "studio/", **HTML)
    if key:
        assert client.post("/login", data={"key": key}).status_code == 303
    yield client


@pytest.fixture
def studio(closed: TestClient, keys: dict[str, str]) -> Iterator[TestClient]:
    """Client of the studio with a key."""
    with browser(closed, keys["ann"]) as client:
        yield client


def test_pages_need_a_login(closed: TestClient) -> None:
    with browser(closed) as client:
        for path in ("/", "/animate/0123456789abcdef"):
            answer = client.get(path)
            assert (answer.status_code, answer.headers["location"]) == (303, "/studio/login")
        assert client.get("/api/projects", headers={"Accept": "application/json"}).status_code == 401
        assert client.post("/api/projects", json={"text": "Hello."}).status_code == 401
        assert client.get("/_nicegui_ws/socket.io/").status_code != 200
        assert "API key" in client.get("/login").text


def test_a_login_keeps_the_key_in_a_cookie_that_scripts_cannot_read(closed: TestClient, keys: dict[str, str]) -> None:
    with browser(closed) as client:
        refused = client.post("/login", data={"key": "t2f_wrong<b>"})
        assert refused.status_code == 401
        assert "unknown" in refused.text
        assert "set-cookie" not in refused.headers
        answer = client.post("/login", data={"key": keys["ann"]})
        assert answer.headers["set-cookie"] == (
            f"{COOKIE}={keys['ann']}; Path=/studio; Max-Age=2592000; HttpOnly; SameSite=Strict"
        )
        assert client.get("/").status_code == 200
        assert client.post("/logout").status_code == 303
        assert client.get("/").status_code == 303


def test_the_cookie_serves_the_studio_only(closed: TestClient, keys: dict[str, str]) -> None:
    cookie = {"Cookie": f"{COOKIE}={keys['ann']}"}
    assert closed.get("/studio/api/projects", headers=cookie).status_code == 200
    assert closed.get("/v1/jobs", headers=cookie).status_code == 401


def test_a_key_sees_its_own_projects_only(closed: TestClient, keys: dict[str, str]) -> None:
    with browser(closed, keys["ann"]) as ann, browser(closed, keys["bob"]) as bob:
        number = ann.post("/api/projects", json={"text": "Hello."}).json()["id"]
        assert number in ann.get("/api/projects").text
        assert number not in bob.get("/api/projects").text
        paths = ("preview", "project.json", "face.glb", "picture.png?time=0", "explanation?time=0", "renders")
        for path in (*paths, "comparison", "comparison/preview", "comparison/measures", "recordings"):
            assert bob.get(f"/api/projects/{number}/{path}").status_code == 404
        change = {"edit": {"kind": "name", "name": "x"}}
        assert bob.post(f"/api/projects/{number}/edits", json=change).status_code == 404
        assert bob.delete(f"/api/projects/{number}").status_code == 404
        assert "cannot be opened" in bob.get(f"/animate/{number}").text
        kept = {"reference": {"kind": "kept"}}
        assert bob.put(f"/api/projects/{number}/comparison", json=kept).status_code == 404
        report = ann.post("/api/reports", json={"kind": "gestures", "model": "starter"}).json()["id"]
        assert bob.get("/api/reports").json() == []
        assert bob.delete(f"/api/reports/{report}").status_code == 404
        assert ann.delete(f"/api/reports/{report}").status_code == 204


def test_a_key_without_speak_makes_no_project(closed: TestClient, keys: dict[str, str]) -> None:
    with browser(closed, keys["reader"]) as client:
        answer = client.post("/api/projects", json={"text": "Hello."})
        assert (answer.status_code, "lacks the scope speak" in answer.text) == (400, True)


def test_a_key_without_build_is_told_where_recordings_need_it(closed: TestClient, keys: dict[str, str]) -> None:
    with browser(closed, keys["ann"]) as client:
        assert "Record your own talker" not in client.get("/").text
        page = client.get("/record").text
        assert "lacks the scope build" in page
        assert "Go to the projects" in page


def test_pages_of_other_origins_reach_nothing(studio: TestClient) -> None:
    evil = {"Origin": "https://evil.example"}
    assert studio.post("/api/projects", json={"text": "Hello."}, headers=evil).status_code == 403
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
               "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}  # fmt: skip
    path = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    assert studio.get(path, headers=upgrade | evil).status_code == 403
    assert studio.get("/", headers={"Host": "evil.example"}).status_code == 421


def test_a_page_may_load_and_send_nothing_elsewhere(studio: TestClient) -> None:
    for path in ("/", "/animate/0123456789abcdef", "/api/projects"):
        answer = studio.get(path)
        assert answer.headers["content-security-policy"] == POLICY
        assert answer.headers["referrer-policy"] == "no-referrer"
    sources = {name: set(values.split()) for name, _, values in (one.partition(" ") for one in POLICY.split("; "))}
    allowed = {"'self'", "'none'", "'unsafe-inline'", "'unsafe-eval'", "data:", "blob:"}
    assert all(values <= allowed for values in sources.values())
    assert sources["default-src"] == sources["form-action"] == {"'self'"}
    hosts = set(
        re.findall(r"""(?:src|href|url\(|from|import)\s*[=(]?\s*["']?(https?://[^"'\s)]+)""", studio.get("/").text)
    )
    assert not hosts


def test_other_answers_of_the_service_have_no_policy_of_pages(closed: TestClient) -> None:
    assert "content-security-policy" not in closed.get("/healthz").headers


def test_the_body_of_an_upload_is_bounded(studio: TestClient) -> None:
    large = b"x" * 21_000_000
    assert studio.post("/api/imports", files={"file": ("x.txt", large)}).status_code == 413


@pytest.mark.parametrize("cookie", ["", "a=b", "tts2face_key", '"', "tts2face_key=\x01"])
def test_other_cookies_hold_no_key(cookie: str) -> None:
    assert cookie_key({b"cookie": cookie.encode()}) == ""


def test_a_cookie_over_https_is_sent_over_https_only() -> None:
    assert set_cookie("k", is_secure=True).endswith("; Secure")
    assert "Max-Age=0" in set_cookie("", is_secure=False)


def test_pages_keep_no_telemetry() -> None:
    from nicegui import app

    from tts2face.serving.studio.app import _disable_telemetry

    _disable_telemetry()
    assert not app._native_telemetry.enabled()


def test_styles_and_scripts_are_in_the_package() -> None:
    import tts2face.serving.studio

    folder = Path(tts2face.serving.studio.__file__).parent
    assert (folder / "pages" / "studio.css").is_file()
    assert {"stage.js", "timeline.js", "clock.js", "preview.js"} <= {one.name for one in folder.glob("components/*.js")}


@pytest.mark.parametrize("path", CONNECTIONS)
def test_a_reload_ends_the_connections_of_a_removed_key(closed: TestClient, keys: dict[str, str], path: str) -> None:
    """Open pages and live cameras, which cannot connect again."""
    from tts2face.serving.service.keys import add_key, remove_key

    secret = add_key(Path(keys["file"]), "leaving", ["speak", "build"])
    headers = {"Cookie": f"{COOKIE}={secret}", "Upgrade": "websocket"}
    state, portal = closed.app.state.service, closed.portal  # type: ignore[attr-defined]
    assert portal is not None
    try:
        portal.call(state.reload_keys)
        with closed.websocket_connect(f"ws://localhost/studio{path}", headers=headers) as one:
            eventually(lambda: any(open.key.name == "leaving" for open in state.exchanges))
            remove_key(Path(keys["file"]), "leaving")
            portal.call(state.reload_keys)
            while (message := one.receive())["type"] != "websocket.close":
                assert message["type"] == "websocket.send"
            assert message["code"] == 1008
        eventually(lambda: not any(open.key.name == "leaving" for open in state.exchanges))
        with (
            pytest.raises(WebSocketDenialResponse),
            closed.websocket_connect(f"ws://localhost/studio{path}", headers=headers),
        ):
            pass
    finally:
        if "leaving" in Path(keys["file"]).read_text():
            remove_key(Path(keys["file"]), "leaving")
        portal.call(state.reload_keys)


def test_styles_and_takes_belong_to_a_key(closed: TestClient, keys: dict[str, str]) -> None:
    mix = {"name": "anns", "mix": {"source": "grid_s1"}}
    with browser(closed, keys["ann"]) as ann, browser(closed, keys["bob"]) as bob:
        assert ann.post("/api/styles", json=mix).status_code == 201
        assert "anns" in {one["name"] for one in ann.get("/api/styles").json()["styles"]}
        assert "anns" not in {one["name"] for one in bob.get("/api/styles").json()["styles"]}
        assert "is not one of your own styles" in bob.delete("/api/styles/anns").json()["error"]["message"]
        assert "you have no own styles yet" in bob.get("/api/styles/my-styles.palette").json()["error"]["message"]
        number = bob.post("/api/projects", json={"text": "Hello."}).json()["id"]
        folder = closed.app.state.service.settings.data_folder  # type: ignore[attr-defined]
        edit = {"kind": "models", "options": {"palette": f"{folder}/studio/palettes/ann.styles/my-styles.palette"}}
        answer = bob.post(f"/api/projects/{number}/edits", json={"edit": edit})
        assert "there is no palette" in answer.json()["error"]["message"]
        for address in ("/api/styles/take/0", "/api/takes/new"):
            answer = ann.put(address, content=b"Timecode", headers={"Content-Type": "text/csv"})
            assert "lacks the scope build" in answer.json()["error"]["message"]
    with browser(closed, keys["reader"]) as reader:
        assert "lacks the scope speak" in reader.post("/api/styles", json=mix).json()["error"]["message"]
