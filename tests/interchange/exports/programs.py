"""Node packages and browsers that read exported files; a test that needs a missing one is skipped with the reason."""

import functools
import http.server
import os
import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])), {maxIssues: 50}).then(
  report => console.log(JSON.stringify(report)), error => { console.error(error); process.exit(1); });
"""


def node_package(name: str) -> Path:
    """Folder of node packages that holds a package: TTS2FACE_NODE_MODULES, or the global one of npm."""
    if shutil.which("node") is None:
        pytest.skip("node is not installed")
    given = os.environ.get("TTS2FACE_NODE_MODULES")
    folder = Path(given) if given else _global_packages()
    if not (folder / name).is_dir():
        pytest.skip(f"needs the node package {name} (`npm install --global {name}`, or TTS2FACE_NODE_MODULES)")
    return folder


@functools.cache
def _global_packages() -> Path:
    if shutil.which("npm") is None:
        return Path("no npm")
    return Path(subprocess.run(["npm", "root", "-g"], capture_output=True, text=True, check=True).stdout.strip())


def run_node(script: str, packages: Path, *arguments: str) -> str:
    """Output of a script."""
    environment = os.environ | {"NODE_PATH": str(packages)}
    command = ["node", "-e", script, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment, timeout=60).stdout


def browser() -> str:
    """Path of a browser."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("Chromium is not installed")
    return found


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Address of a folder on this machine."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *arguments: object) -> None:
            super().__init__(*arguments, directory=str(folder))  # type: ignore[arg-type]

        def log_message(self, *_: object) -> None:
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def page_content(address: str, done: str, *flags: str) -> str:
    """Document of a page after its scripts have run: when it contains `done`, with more time on a busy machine."""
    command = [browser(), "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    for budget_ms in (20_000, 60_000, 180_000):
        limit = f"--virtual-time-budget={budget_ms}"
        shown = subprocess.run(
            [*command, *flags, limit, "--dump-dom", address], capture_output=True, text=True, check=True, timeout=120
        ).stdout
        if done in shown:
            return shown
    raise AssertionError(f"the page does not contain {done!r}: {shown[:500]}")
