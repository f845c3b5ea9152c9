"""The OpenAPI description holds: requests made from it get documented answers and no server error."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.packages import needs
from tests.running import HostService, RunningService
from tts2face.serving.service.application import create_app
from tts2face.serving.service.settings import ServiceSettings

# Generated texts and pictures at the limits of the schema would take minutes to make: the server under test allows
# little. Jobs are accepted and not worked on.
SMALL = {
    "text_characters": 20, "pixels": 262144, "sound_s": 2, "body_mb": 0.2, "body_s": 5, "waiting": 200, "workers": 0,
}  # fmt: skip
# Meaning is checked after form: a text may be empty, so that requests of the right form may be refused.
OPTIONS = (
    "--request-timeout", "300", "--no-color", "--workers", "2", "--generation-database", "none",
    "--exclude-path-regex", "/events$",  # of a job that nobody works on: they never end
    "--suppress-health-check", "all", "--seed", "7", "--exclude-checks", "positive_data_acceptance",
)  # fmt: skip

# What is wrong may also be too large (413), which is found before it is read.
CONFIGURATION = (
    "[checks.negative_data_rejection]\nexpected-statuses = [400, 401, 403, 404, 405, 406, 409, 413, 415, 422]\n"
)


@pytest.fixture(scope="module")
def small(host: HostService) -> Iterator[RunningService]:
    """A service with small limits."""
    with host(**SMALL) as running:
        yield running


def run_schemathesis(service: RunningService, folder: Path, *options: str) -> None:
    needs("schemathesis")
    Path(folder, "schemathesis.toml").write_text(CONFIGURATION, encoding="utf-8")
    command = [sys.executable, "-m", "schemathesis.cli", "run", f"{service.url}/openapi.json", *OPTIONS, *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False, cwd=folder)
    assert done.returncode == 0, done.stdout[-6000:]
    assert not [event for event in service.events() if event["event"] == "defect"]


@pytest.mark.parametrize(
    ("phases", "n_examples"),
    [
        ("examples,fuzzing", 2),
        pytest.param("examples,coverage", 8, marks=pytest.mark.nightly),
        pytest.param("fuzzing,stateful", 8, marks=pytest.mark.nightly),
    ],
)
def test_requests_made_from_the_schema_get_documented_answers(
    small: RunningService, tmp_path: Path, phases: str, n_examples: int
) -> None:
    """All routes; data at the edges of the schema, random data, and sequences of calls that use earlier answers."""
    run_schemathesis(small, tmp_path, "--phases", phases, "--max-examples", str(n_examples))
    assert httpx.get(f"{small.url}/readyz").status_code == 200


def test_every_field_is_described(small: RunningService) -> None:
    """Fields have a description, and routes document the errors of the service."""
    schema = httpx.get(f"{small.url}/openapi.json").json()
    bare = [
        f"{name}.{field}"
        for name, one in schema["components"]["schemas"].items()
        for field, content in one.get("properties", {}).items()
        if "description" not in content and "$ref" not in content
    ]
    assert bare == []
    for path, methods in schema["paths"].items():
        for method, route in methods.items():
            assert route["summary"], (path, method)
            assert {"401", "403", "421", "429", "431", "500", "503"} <= set(route["responses"]), (path, method)


def fields_of(name: str, schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Fields of an object and of the objects in it, with their places."""
    for part in ("oneOf", "anyOf"):
        for number, one in enumerate(schema.get(part, ())):
            yield from fields_of(f"{name} {number}", one)
    for field, content in schema.get("properties", {}).items():
        yield f"{name}.{field}", content
        yield from fields_of(f"{name}.{field}", content)


def has_example(content: dict[str, Any]) -> bool:
    """Whether a field shows a value, whatever its type; objects show those of their parts, files have none.

    A default is no example: a field with one alone would pass, as those of switches did.
    """
    if {"example", "examples", "enum", "const", "$ref"} & content.keys():
        return True
    if content.get("type") == "object" or content.get("format") == "binary" or "properties" in content:
        return True
    return ("items" in content and has_example(content["items"])) or any(map(has_example, content.get("anyOf", ())))


@pytest.mark.parametrize(
    "content",
    [
        {"type": "boolean", "default": False},
        {"type": "integer", "default": 3},
        {"type": "array", "items": {"type": "string"}},
        {"anyOf": [{"type": "number"}, {"type": "null"}], "default": None},
    ],
)
def test_a_default_is_no_example(content: dict[str, Any]) -> None:
    assert not has_example(content)
    assert has_example({**content, "examples": [content.get("default")]})


def test_every_field_has_a_description_and_an_example(tmp_path: Path) -> None:
    described = create_app(ServiceSettings(processes=1, data=tmp_path)).openapi()
    found = [one for name, schema in described["components"]["schemas"].items() for one in fields_of(name, schema)]
    for path, operations in described["paths"].items():
        for method, operation in operations.items():
            place = f"{method} {path}"
            for kind, body in operation.get("requestBody", {}).get("content", {}).items():
                found += fields_of(f"{place} {kind}", body["schema"])
            found += [(f"{place} {one['name']}", {**one["schema"], **one}) for one in operation.get("parameters", ())]
    assert len(found) > 250
    assert [name for name, content in found if not content.get("description")] == []
    assert [name for name, content in found if not has_example(content)] == []
