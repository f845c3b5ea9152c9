"""HTTP, the command line and Python give byte-identical motion for the same request."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import httpx
import pytest

import tts2face
from cli.main import run
from tests.running import RunningService
from tts2face.session.named_models import Models

TEXT = "Bob may move. We were away."
LONG = (
    "The garden behind the old house near the river had been green for years, and nobody knew who had planted it or "
    "when, because the books were lost."
)
SSML = (
    '<speak>We were <emphasis level="strong">away</emphasis> <break time="300ms"/> a year '
    '<prosody rate="120%">ago</prosody>.</speak>'
)
MODEL_TEXT = (
    "<think>Be kind.</think>[happy] **Sure!** 😊 Here is the *plan*:\n\n## Today\n1. Relax 🧘\n2. Call [Ann](tel:5)\n\n"
    "| who | when |\n|---|---|\n| Bob | now |\n\n```sh\nls\n```\n*nods* Good luck! :) I ❤️ it (about two hours), &amp; "
    "<sad>we were ~~here~~ away.</sad> [pause] He (happy) may #GoNow <x>again.</x>"
)
WORDS = "bob  B IY1 M\n"
REQUESTS: dict[str, dict[str, Any]] = {
    "plain": {"text": TEXT},
    "style": {"text": TEXT, "style": "brows=annoyed,head=delighted", "gain": "head=1.5", "expression": "happy=0.5"},
    "seed": {"text": TEXT, "seed": 7, "fps": 25.0},
    "marks": {"text": "Well, [pause 0.4] no [nod] more. [style:delighted]Yes.[/style]"},
    "ssml": {"text": SSML},
    "text of a model": {"text": MODEL_TEXT},
    "markup llm": {"text": MODEL_TEXT, "markup": "llm"},
    "no words": {"text": "*nods* 😀", "seed": 2},
    "dictionary": {"text": TEXT, "dictionary": "names"},
    "gestures none": {"text": TEXT, "gestures": "none"},
    "gestures ju2008": {"text": TEXT, "gestures": "ju2008", "synthesis": "theobald2007"},
    "articulation": {"text": TEXT, "articulation": "natural"},
    "espeak": {"text": "Guten Morgen, liebe Welt.", "language": "de", "rate": 1.2, "volume": 0.8},
    "long first sentence": {"text": LONG},
    "talker and face": {"text": TEXT, "talker": "grid_s1", "face": "head"},
    "identity": {"text": TEXT, "identity": "kofi"},
    "idle": {"idle": 2.0, "seed": 3},
    "switch": {"text": TEXT, "plain_delivery": True, "style": "depressed"},
}
MODELS = tuple(one.name for one in fields(Models))


@pytest.fixture(scope="module")
def url(service: RunningService) -> str:
    """Address of a service with a dictionary."""
    made = httpx.post(
        f"{service.url}/v1/dictionaries", data={"name": "names"}, files={"file": ("own.txt", WORDS.encode())},
        timeout=60.0,
    )  # fmt: skip
    assert made.status_code == 201, made.text
    return service.url


def of_python(options: dict[str, Any], out: Path) -> bytes:
    models = {name: options[name] for name in MODELS if name in options}
    session = tts2face.Session(**models)
    request = tts2face.Request(**{name: value for name, value in options.items() if name not in MODELS})
    session.export(request, out)
    return out.read_bytes()


def of_command_line(options: dict[str, Any], out: Path) -> bytes:
    words = [options["text"]] if "text" in options else []
    for name, value in options.items():
        flag = name.replace("_", "-")
        if isinstance(value, bool):
            words.append(f"--{flag}" if value else f"--no-{flag}")
        elif name != "text":
            words += [f"--{flag}", str(value)]
    assert run([*words, "--quiet", "--out", str(out)]) == 0
    return out.read_bytes()


@pytest.mark.parametrize("name", REQUESTS)
def test_the_doors_agree_byte_for_byte(name: str, url: str, tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text(WORDS)
    options = REQUESTS[name]
    local = options | {"dictionary": own} if "dictionary" in options else options
    received = httpx.post(f"{url}/v1/clips", json={**options, "format": "curves"}, timeout=120.0)
    assert received.status_code == 200, received.text
    python = of_python(local, tmp_path / "python.curves.jsonl")
    assert received.content == python
    assert of_command_line(local, tmp_path / "command.curves.jsonl") == python


def test_the_requests_differ(url: str) -> None:
    """No two requests have the same curves, so that no option is lost on the way."""
    bodies = [
        httpx.post(f"{url}/v1/clips", json={**options, "format": "curves"}, timeout=120.0).content
        for options in REQUESTS.values()
        if options.get("text") == TEXT
    ]
    assert len(set(bodies)) == len(bodies)
