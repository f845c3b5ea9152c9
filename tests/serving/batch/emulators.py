"""Emulators of S3, Google Cloud Storage and Azure Blob Storage on this machine, behind a relay that can fail.

moto's server speaks S3, and Google Cloud Storage, as Google's XML requests are the same; azurite speaks Azure.
"""

import base64
import hashlib
import hmac
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from email.utils import formatdate
from pathlib import Path

import pytest

from tests.packages import needs
from tests.running import free_port

ACCOUNT = "devstoreaccount1"  # azurite's own, as its documentation states it
ACCOUNT_KEY = "Eby8vdM02xNOcqFlqUwJPLlmEtlCDXJ1OUzFT50uSRZ6IFsuFq2UVErCz4I6tq/K1SZFPTOtr/KBHBeksoGMGw=="
SECRET = "a-secret-that-must-not-be-printed"
START_S = 60.0


class Relay:
    """Passes connections on to a port; `fail` ends all of them, `limit` stops the upload after so many bytes."""

    def __init__(self, port: int) -> None:
        self._target = port
        self.is_failing, self.limit, self.n_bytes = False, None, 0
        self._open: set[socket.socket] = set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def fail(self) -> None:
        self.is_failing = True
        for one in list(self._open):
            one.close()

    def restore(self) -> None:
        self.is_failing, self.limit, self.n_bytes = False, None, 0

    def close(self) -> None:
        self._listener.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            if self.is_failing:
                client.close()
                continue
            server = socket.create_connection(("127.0.0.1", self._target))
            self._open |= {client, server}
            threading.Thread(target=self._pass, args=(client, server, True), daemon=True).start()
            threading.Thread(target=self._pass, args=(server, client, False), daemon=True).start()

    def _pass(self, source: socket.socket, target: socket.socket, is_upload: bool) -> None:
        try:
            while data := source.recv(65536):
                self.n_bytes += len(data) if is_upload else 0
                if is_upload and self.limit is not None and self.n_bytes > self.limit:
                    while self.limit is not None:
                        time.sleep(0.05)
                    return  # what was held back, which the system's buffers may hold as a whole, is lost
                target.sendall(data)
        except OSError:
            pass
        finally:
            self._open -= {source, target}
            for one in (source, target):
                one.close()


class Emulator:
    """A server in a child process, and the relay through which tests reach it."""

    def __init__(self, command: list[str], port: int) -> None:
        self.port = port
        self._child = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL
        )
        end = time.monotonic() + START_S
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                break
            except OSError:
                if time.monotonic() > end or self._child.poll() is not None:
                    self.close()
                    pytest.skip(f"{command[0]} does not start here")
                time.sleep(0.1)
        self.relay = Relay(port)

    def request(self, method: str, path: str, headers: dict[str, str] | None = None, data: bytes = b"") -> None:
        url = f"http://127.0.0.1:{self.port}{path}"
        asked = urllib.request.Request(url, data=data or None, method=method, headers=headers or {})
        with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(asked, timeout=30):
            pass

    def close(self) -> None:
        self._child.kill()
        self._child.wait()
        if hasattr(self, "relay"):
            self.relay.close()


def start_moto() -> Emulator:
    needs("moto", "flask")
    port = free_port()
    start = "import sys; from moto.server import main; main(sys.argv[1:])"
    return Emulator([sys.executable, "-W", "ignore", "-c", start, "-H", "127.0.0.1", "-p", str(port)], port)


def start_azurite() -> Emulator:
    script = Path(os.environ.get("TTS2FACE_NODE_MODULES", "")) / ".bin" / "azurite-blob"
    program = str(script) if script.exists() else shutil.which("azurite-blob")
    if program is None:
        pytest.skip("azurite is not installed (npm install azurite, TTS2FACE_NODE_MODULES)")
    port = free_port()
    options = ["--inMemoryPersistence", "--silent", "--skipApiVersionCheck", "--disableTelemetry"]
    return Emulator([program, *options, "--blobHost", "127.0.0.1", "--blobPort", str(port)], port)


def make_container(azurite: Emulator, name: str) -> None:
    """Create a container by a request signed with the account's key (Azure: Authorize with Shared Key)."""
    headers = {"x-ms-date": formatdate(usegmt=True), "x-ms-version": "2020-10-02"}
    signed = "PUT" + "\n" * 12 + "".join(f"{key}:{value}\n" for key, value in headers.items())
    signed += f"/{ACCOUNT}/{ACCOUNT}/{name}\nrestype:container"
    digest = hmac.new(base64.b64decode(ACCOUNT_KEY), signed.encode(), hashlib.sha256).digest()
    headers |= {"Authorization": f"SharedKey {ACCOUNT}:{base64.b64encode(digest).decode()}", "Content-Length": "0"}
    azurite.request("PUT", f"/{ACCOUNT}/{name}?restype=container", headers)
