"""A receiver of webhooks, which checks their signatures."""

import base64
import hashlib
import hmac
import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

SECRET = "a secret of the tests"


class Receiver:
    """Server on this machine; the first `n_refused` messages get 503, and those to /moved a redirect."""

    def __init__(self, n_refused: int = 0) -> None:
        self.messages: list[tuple[str, dict[str, Any]]] = []  # ids and contents of the accepted messages
        self.n_refused, self.n_redirected, self.wrong = n_refused, 0, []  # type: ignore[var-annotated]
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                outer._receive(self)

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.host = f"127.0.0.1:{self._server.server_address[1]}"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    def __enter__(self) -> "Receiver":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()

    @property
    def environment(self) -> dict[str, str]:
        """Variables of a service that may send messages here."""
        return {"TTS2FACE_SERVE_WEBHOOK_HOSTS": self.host, "TTS2FACE_SERVE_WEBHOOK_SECRET": SECRET}

    def _receive(self, request: BaseHTTPRequestHandler) -> None:
        body = request.rfile.read(int(request.headers["content-length"]))
        status = 204
        if request.path == "/moved":
            self.n_redirected += 1
            status = 307
        elif self.n_refused > 0:
            self.n_refused -= 1
            status = 503
        else:
            name, time = request.headers["webhook-id"], request.headers["webhook-timestamp"]
            digest = hmac.new(SECRET.encode(), f"{name}.{time}.".encode() + body, hashlib.sha256).digest()
            if request.headers["webhook-signature"] != f"v1,{base64.b64encode(digest).decode()}":
                self.wrong.append(name)
            self.messages.append((name, json.loads(body)))
        request.send_response(status)
        if status == 307:
            request.send_header("Location", f"http://{self.host}/elsewhere")
        request.end_headers()
