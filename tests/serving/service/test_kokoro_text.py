"""Marks of Kokoro's clients: what is wrong in them is refused in their own form, and is not spoken."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from tests.serving.service.in_process import TableProcess, service_client
from tts2face.serving.service.kokoro_text import with_marks
from tts2face.serving.service.settings import ServiceSettings


@pytest.fixture
def process() -> TableProcess:
    return TableProcess()


@pytest.fixture
def client(process: TableProcess, tmp_path: Path) -> Iterator[TestClient]:
    settings = ServiceSettings(workers=0, data=tmp_path / "data", studio=False)
    with service_client(settings, process) as client:
        yield client


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[Kokoro](/xxx☃/) speaks.", "[Kokoro](/xxx☃/): '☃' (SNOWMAN) in 'xxx☃' is not a phone"),
        ("[Kokoro](//) speaks.", "[Kokoro](//) has no phones; write them in IPA or in Kokoro's alphabet"),
        ("[Kokoro](/ˈ/) speaks.", "[Kokoro](/ˈ/) has no phones"),
        ("[](/kˈOkəɹO/) speaks.", "[](/kˈOkəɹO/) has phones and no word; write the word in the square brackets"),
        ("[ ](/kˈOkəɹO/) speaks.", "[ ](/kˈOkəɹO/) has phones and no word"),
        (f"[Kokoro](/{'a' * 300}☃/) speaks.", "'☃' (SNOWMAN)"),
        ("A [pause:500ms] pause.", "cannot read the mark [pause:500ms]; write a pause in seconds, as [pause:0.5s]"),
        ("A [Pause: ] pause.", "cannot read the mark [Pause: ]; write a pause in seconds, as [pause:0.5s]"),
        ("A [pause:1s pause.", "cannot read the mark [pause:1s pause.; write a pause in seconds, as [pause:0.5s]"),
    ],
)
@pytest.mark.parametrize("path", ["/v1/audio/speech", "/dev/captioned_speech", "/dev/phonemize"])
def test_wrong_marks_are_refused_and_named(
    client: TestClient, process: TableProcess, path: str, text: str, reason: str
) -> None:
    asked = {"text": text} if path == "/dev/phonemize" else {"model": "kokoro", "voice": "af_heart", "input": text}
    answer = client.post(path, json=asked)
    assert answer.status_code == 400, answer.text
    assert reason in answer.json()["error"]["message"]
    assert not process.works


@pytest.mark.parametrize(
    ("text", "marked"),
    [
        (
            "See [this](/a page) or [that](https://example.org/).",
            "See [this](/a page) or [that](https://example.org/).",
        ),
        ("A [pause:0.3333s] pause [PAUSE: 2 s].", "A [pause 0.3333] pause [pause 2]."),
        ("[a b](/ə bˈi/)", "[phoneme:ə bˈi]a b[/phoneme]"),
    ],
)
def test_links_stay_and_marks_become_those_of_the_service(text: str, marked: str) -> None:
    assert with_marks(text) == marked


def test_phones_are_answered_as_a_complete_file(client: TestClient, process: TableProcess) -> None:
    """Nothing asks for a stream."""
    asked = {"phonemes": "həlˈO wˈɜɹld.", "voice": "af_heart"}
    assert client.post("/dev/generate_from_phonemes", json=asked).status_code == 200
    (work,) = process.works
    assert (work.format, work.is_complete) == ("wav", True)
