"""Traces: sent to the collector that the standard variables name, without texts; otherwise nothing is sent."""

import gzip
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

import httpx
import pytest

from lexicon.errors import BackendError, InputError
from tests.packages import needs
from tests.running import HostService, RunningService, ServeProcess, eventually
from tts2face.serving.service.tracing import is_tracing_requested, tracing_from_environment

needs("opentelemetry.sdk")

TEXT = "Zebras graze quietly."
TRACE, PARENT = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"
ENDPOINT = "OTEL_EXPORTER_OTLP_ENDPOINT"
# FastAPI itself imports OpenTelemetry's interface, which does nothing alone.
IMPORTS = """
import sys
from tts2face.serving.service.server import create_app
from tts2face.serving.service.settings import ServiceSettings
app = create_app(ServiceSettings(processes=1))
assert app.state.service.tracing is None
assert not [name for name in sys.modules if name.startswith(("opentelemetry.sdk", "opentelemetry.exporter"))]
"""
AUDITED = """
import sys
LOCAL = {"127.0.0.1", "localhost", "::1", None}
def look(event, arguments):
    if event in {"socket.connect", "socket.sendto", "socket.sendmsg"}:
        print("NETWORK", event, arguments[1:], file=sys.stderr)
    if event in {"socket.getaddrinfo", "socket.bind"}:
        host = arguments[0] if event == "socket.getaddrinfo" else arguments[1][0]
        if host not in LOCAL:
            print("NETWORK", event, host, file=sys.stderr)
sys.addaudithook(look)
from cli.main import main
main()
"""


class Collector:
    """A collector of OTLP over HTTP on this machine."""

    def __init__(self) -> None:
        from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

        self.bodies: list[bytes] = []
        self.spans: list[Any] = []
        self.resources: list[Any] = []
        collector = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                assert self.path == "/v1/traces"
                body = self.rfile.read(int(self.headers["content-length"]))
                body = gzip.decompress(body) if self.headers.get("content-encoding") == "gzip" else body
                collector.bodies.append(body)
                for one in ExportTraceServiceRequest.FromString(body).resource_spans:
                    collector.resources.append(one.resource)
                    collector.spans += [span for scope in one.scope_spans for span in scope.spans]
                self.send_response(200)
                self.end_headers()

            def log_message(self, format: str, *arguments: Any) -> None:
                """Print nothing."""

        self.server = HTTPServer(("127.0.0.1", 0), Handler)
        self.thread = threading.Thread(target=self.server.serve_forever, daemon=True)
        self.thread.start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server.server_address[1]}"

    def wait_for_span(self, name: str) -> Any:
        def find() -> Any:
            return next((span for span in list(self.spans) if span.name == name), None)

        return eventually(find, what=lambda: f"{name} is not among {[span.name for span in list(self.spans)]}")

    def close(self) -> None:
        self.server.shutdown()
        self.server.server_close()
        self.thread.join()


@pytest.fixture(scope="module")
def collector() -> Iterator[Collector]:
    made = Collector()
    yield made
    made.close()


@pytest.fixture(scope="module")
def traced(host: HostService, collector: Collector) -> Iterator[RunningService]:
    with host(**{ENDPOINT: collector.url, "OTEL_BSP_SCHEDULE_DELAY": "100"}, workers=0) as running:
        yield running


def test_a_request_becomes_a_span_with_its_stages(traced: RunningService, collector: Collector) -> None:
    body = {"input": TEXT, "model": "tts-1", "voice": "alloy"}
    headers = {"traceparent": f"00-{TRACE}-{PARENT}-01", "x-request-id": "id-9"}
    answer = httpx.post(f"{traced.url}/v1/audio/speech", json=body, headers=headers, timeout=60)
    assert answer.status_code == 200
    root = collector.wait_for_span("POST /v1/audio/speech")
    assert (root.trace_id.hex(), root.parent_span_id.hex()) == (TRACE, PARENT)
    attributes = {one.key: one.value.int_value or one.value.string_value for one in root.attributes}
    assert attributes == {
        "http.request.method": "POST", "http.route": "/v1/audio/speech", "http.response.status_code": 200,
        "http.response.body.size": len(answer.content), "tts2face.request_id": "id-9",
    }  # fmt: skip
    stages = {span.name: span for span in collector.spans if span.parent_span_id == root.span_id}
    assert set(stages) == {"queue", "synthesis", "first_byte"}
    for span in stages.values():
        assert span.trace_id == root.trace_id
        assert root.start_time_unix_nano <= span.start_time_unix_nano <= span.end_time_unix_nano
        assert span.end_time_unix_nano <= root.end_time_unix_nano
    assert stages["queue"].end_time_unix_nano <= stages["synthesis"].start_time_unix_nano
    assert abs(root.start_time_unix_nano / 1e9 - time.time()) < 120
    names = {one.key: one.value.string_value for one in collector.resources[0].attributes}
    assert names["service.name"] == "tts2face"
    assert not any(b"Zebra" in content for content in collector.bodies)


def test_a_refused_request_names_its_error_but_no_address(traced: RunningService, collector: Collector) -> None:
    httpx.get(f"{traced.url}/v1/nothing-of-mine?key=my-secret")
    collector.wait_for_span("GET other")
    httpx.post(f"{traced.url}/v1/clips", json={"text": TEXT, "style": "gleeful"})
    refused = collector.wait_for_span("POST /v1/clips")
    attributes = {one.key: one.value.string_value for one in refused.attributes}
    assert attributes["http.route"] == "/v1/clips"
    assert not any(word in content for content in collector.bodies for word in (b"my-secret", b"nothing-of-mine"))


def test_a_broken_traceparent_begins_a_new_trace(traced: RunningService, collector: Collector) -> None:
    httpx.get(f"{traced.url}/v1/models", headers={"traceparent": "00-zz-\xff-01".encode("latin-1"), "tracestate": "=,"})
    assert not collector.wait_for_span("GET /v1/models").parent_span_id


def test_an_unreachable_collector_does_not_disturb(host: HostService) -> None:
    with host(**{ENDPOINT: "http://127.0.0.1:9", "OTEL_BSP_SCHEDULE_DELAY": "50"}, workers=0) as running:
        assert httpx.get(f"{running.url}/v1/models").status_code == 200
    assert all(event["event"] not in {"", "defect"} for event in running.events())


@pytest.mark.parametrize(
    ("environment", "is_requested"),
    [
        ({}, False),
        ({ENDPOINT: "http://127.0.0.1:4318"}, True),
        ({"OTEL_EXPORTER_OTLP_TRACES_ENDPOINT": "http://127.0.0.1:4318/v1/traces"}, True),
        ({"OTEL_TRACES_EXPORTER": "otlp"}, True),
        ({ENDPOINT: "http://127.0.0.1:4318", "OTEL_TRACES_EXPORTER": "none"}, False),
        ({ENDPOINT: "http://127.0.0.1:4318", "OTEL_SDK_DISABLED": "true"}, False),
    ],
)
def test_the_variables_of_opentelemetry_decide(environment: dict[str, str], is_requested: bool) -> None:
    assert is_tracing_requested(environment) == is_requested


@pytest.mark.parametrize(
    ("environment", "reason"),
    [
        ({"OTEL_TRACES_EXPORTER": "zipkin"}, "OTEL_TRACES_EXPORTER must be otlp or none, not 'zipkin'"),
        ({ENDPOINT: "http://a", "OTEL_EXPORTER_OTLP_PROTOCOL": "grpc"}, "sent by http/protobuf, not by 'grpc'"),
    ],
)
def test_other_exporters_and_protocols_are_refused(environment: dict[str, str], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        is_tracing_requested(environment)


def test_missing_libraries_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opentelemetry.exporter.otlp.proto.http.trace_exporter", None)
    with pytest.raises(BackendError, match=r"pip install 'tts2face\[otel\]'"):
        tracing_from_environment({ENDPOINT: "http://127.0.0.1:4318"})


def test_nothing_is_imported_without_the_variables() -> None:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("OTEL_")}
    subprocess.run([sys.executable, "-c", IMPORTS], env=kept, check=True, timeout=120)


def test_the_server_opens_no_connection(tmp_path: object) -> None:
    """By default nothing leaves the machine: the server only accepts connections."""
    running = ServeProcess(program=["-c", AUDITED])
    try:
        running.wait_until_ready()
        body = {"input": TEXT, "model": "tts-1", "voice": "alloy"}
        assert httpx.post(f"{running.url}/v1/audio/speech", json=body, timeout=60).status_code == 200
    finally:
        log = running.close()
    assert "NETWORK" not in log
