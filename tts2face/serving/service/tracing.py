"""OpenTelemetry traces, where the standard variables name a collector; nothing is imported without them."""

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from lexicon.errors import InputError, import_of_extra
from tts2face import __version__

if TYPE_CHECKING:
    from tts2face.serving.service.exchange import Exchange


ENDPOINTS = ("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT")
PROTOCOLS = ("OTEL_EXPORTER_OTLP_TRACES_PROTOCOL", "OTEL_EXPORTER_OTLP_PROTOCOL")
PROTOCOL = "http/protobuf"
# a collector that is away must not hold the end of the server
CLOSE_TIMEOUT_S = 5.0


def is_tracing_requested(environment: Mapping[str, str]) -> bool:
    """Whether the variables of OpenTelemetry ask for traces."""
    exporter = environment.get("OTEL_TRACES_EXPORTER", "").strip().lower()
    if environment.get("OTEL_SDK_DISABLED", "").lower() == "true" or exporter == "none":
        return False
    # gRPC would add 10 MB (decision 099)
    if exporter not in {"", "otlp"}:
        raise InputError(f"OTEL_TRACES_EXPORTER must be otlp or none, not {exporter!r}")
    if not exporter and not any(environment.get(name) for name in ENDPOINTS):
        return False
    protocol = next((environment[name] for name in PROTOCOLS if environment.get(name)), PROTOCOL)
    if protocol != PROTOCOL:
        raise InputError(f"traces are sent by {PROTOCOL}, not by {protocol!r}; change {PROTOCOLS[1]}")
    return True


def tracing_from_environment(environment: Mapping[str, str]) -> "Tracing | None":
    """Tracing as the variables of OpenTelemetry say; None if they do not ask for it."""
    if not is_tracing_requested(environment):
        return None
    with import_of_extra(
        "traces need OpenTelemetry's libraries; install them with `pip install 'tts2face[otel]'`, or unset "
        "OTEL_EXPORTER_OTLP_ENDPOINT"
    ):
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    return Tracing(BatchSpanProcessor(OTLPSpanExporter()))


class Tracing:
    """Makes the spans of finished requests; they hold routes, statuses and times, never texts, addresses or keys.

    Parameters
    ----------
    processor
        A span processor of OpenTelemetry's SDK.
    """

    def __init__(self, processor: Any) -> None:
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider

        resource = Resource.create({"service.version": __version__})
        if str(resource.attributes.get("service.name", "")).startswith("unknown_service"):  # OTEL_SERVICE_NAME wins
            resource = resource.merge(Resource({"service.name": "tts2face"}))
        self._provider = TracerProvider(resource=resource, shutdown_on_exit=False)
        self._provider.add_span_processor(processor)
        self._tracer = self._provider.get_tracer("tts2face.service", __version__)

    def record(self, request: "Exchange") -> None:
        """Make the spans of a finished request: the request, its stages, and the time to its first byte."""
        from opentelemetry.trace import SpanKind, StatusCode, set_span_in_context

        offset = time.time_ns() - time.monotonic_ns()
        root = self._tracer.start_span(
            f"{request.method} {request.route}", context=_parent(request.headers), kind=SpanKind.SERVER,
            start_time=_nanoseconds(request.began, offset),
            attributes={
                "http.request.method": request.method, "http.route": request.route,
                "http.response.status_code": request.status, "http.response.body.size": request.n_bytes,
                "tts2face.request_id": request.id,
            },
        )  # fmt: skip
        if request.code is not None:
            root.set_attribute("error.type", request.code)
        # 0: no answer was begun
        if request.status >= 500 or request.status == 0:
            root.set_status(StatusCode.ERROR)
        now, context = time.monotonic(), set_span_in_context(root)
        spans = [(stage.name, stage.start, now if stage.end is None else stage.end) for stage in request.stages]
        if request.first_byte_s is not None:
            spans.append(("first_byte", request.began, request.began + request.first_byte_s))
        for name, start, end in spans:
            self._tracer.start_span(name, context=context, start_time=_nanoseconds(start, offset)).end(
                _nanoseconds(end, offset)
            )
        root.end(_nanoseconds(now, offset))

    def close(self) -> None:
        """Send what has not been sent, for `CLOSE_TIMEOUT_S` at most, and end."""
        self._provider.force_flush(int(1000 * CLOSE_TIMEOUT_S))
        self._provider.shutdown()


def _parent(headers: Mapping[bytes, bytes]) -> Any:
    """Context of the caller's span, from the headers of W3C Trace Context."""
    from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

    names = ("traceparent", "tracestate")
    carrier = {name: headers[name.encode()].decode("latin-1") for name in names if name.encode() in headers}
    return TraceContextTextMapPropagator().extract(carrier)


def _nanoseconds(monotonic_s: float, offset: int) -> int:
    return int(monotonic_s * 1e9) + offset
