"""Voices of hibari-tts are downloaded or copied, checked, spoken and removed; here another model stands for them."""

import hashlib
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.main import run
from lexicon.errors import BackendError, DataError, InputError
from tts2face.models.person import FEMALE, Person
from tts2face.sound import hibari_voices
from tts2face.sound.fitting import fitting_voice
from tts2face.sound.heart_letters import BRITISH_LETTERS, voice_phones, word_letters
from tts2face.sound.hibari_voices import PART, add_voice, has_model, hibari_voice, read_model
from tts2face.sound.voice_pool import default_voice, load_voice

MODEL = np.random.default_rng(0).bytes(600_000)


@pytest.fixture
def listed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, Any]:
    """The package's list, with a small model for fenrir and that of heart for emma, and an empty cache."""
    registry = hibari_voices._registry()
    heart = Path(registry.ASSETS, registry.VOICES["heart"]["file"]).read_bytes()
    voices = {name: dict(about) for name, about in registry.VOICES.items()}
    for name, content in (("fenrir", MODEL), ("emma", heart)):
        voices[name] |= {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    monkeypatch.setattr(registry, "VOICES", voices)
    monkeypatch.setenv("HIBARI_HOME", str(tmp_path / "cache"))
    fitting_voice.cache_clear()
    yield voices
    fitting_voice.cache_clear()


@contextmanager
def served(
    monkeypatch: pytest.MonkeyPatch, content: bytes, *, has_parts: bool = True, most: int = 1 << 30
) -> Iterator[list[str]]:
    """A server of a file, the ranges that it is asked for; it breaks off after `most` bytes."""
    ranges: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            wanted = self.headers.get("Range", "")
            ranges.append(wanted)
            first = int(wanted.removeprefix("bytes=").removesuffix("-")) if wanted and has_parts else 0
            self.send_response(206 if first else 200)
            self.send_header("Content-Length", str(len(content) - first))
            self.end_headers()
            self.wfile.write(content[first : first + most])

        def log_message(self, *_: Any) -> None:
            """Nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
    monkeypatch.setattr(hibari_voices._registry(), "BASE_URL", f"http://127.0.0.1:{server.server_address[1]}/")
    try:
        yield ranges
    finally:
        server.shutdown()
        server.server_close()


@pytest.mark.usefixtures("listed")
def test_a_voice_is_downloaded_with_progress_and_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[tuple[int, int]] = []
    with served(monkeypatch, MODEL) as ranges:
        path = add_voice("fenrir", on_progress=lambda *step: steps.append(step))
        assert add_voice("fenrir") == path
    assert (path.read_bytes(), ranges) == (MODEL, [""])
    assert steps[-1] == (len(MODEL), len(MODEL))
    assert has_model("fenrir")


@pytest.mark.usefixtures("listed")
@pytest.mark.parametrize("has_parts", [True, False])
def test_a_download_continues_where_it_broke_off(has_parts: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    with served(monkeypatch, MODEL, most=400_000), pytest.raises(BackendError, match="the same command continues"):
        add_voice("fenrir")
    assert not has_model("fenrir")
    with served(monkeypatch, MODEL, has_parts=has_parts) as ranges:
        assert add_voice("fenrir").read_bytes() == MODEL
    assert ranges[0].startswith("bytes=")


@pytest.mark.usefixtures("listed")
def test_another_content_is_not_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    wrong = bytes(len(MODEL))
    with served(monkeypatch, wrong), pytest.raises(DataError, match="not the model of the voice fenrir"):
        add_voice("fenrir")
    (tmp_path / "wrong.onnx").write_bytes(wrong)
    with pytest.raises(DataError, match=r"wrong\.onnx is not the model"):
        add_voice("fenrir", tmp_path / "wrong.onnx")
    (tmp_path / "short.onnx").write_bytes(b"no")
    with pytest.raises(InputError, match=r"is a folder; give the file am_fenrir"):
        add_voice("fenrir", tmp_path)
    with pytest.raises(DataError, match="has 2 bytes"):
        add_voice("fenrir", tmp_path / "short.onnx")
    assert list((tmp_path / "cache").iterdir()) == []


@pytest.mark.usefixtures("listed")
def test_a_file_serves_without_a_network(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "model.onnx").write_bytes(MODEL)
    assert run(["voices", "add", "fenrir", "--from", str(tmp_path / "model.onnx")]) == 0
    assert has_model("fenrir")
    assert run(["voices", "remove", "fenrir"]) == 0
    assert not has_model("fenrir")
    assert run(["voices", "remove", "fenrir"]) == 2
    assert "not installed" in capsys.readouterr().err


@pytest.mark.usefixtures("listed")
def test_a_damaged_model_is_said_and_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = hibari_voice("fenrir").path
    path.parent.mkdir()
    path.write_bytes(bytes(len(MODEL)))
    with pytest.raises(DataError, match="damaged; run: tts2face voices add fenrir"):
        read_model("fenrir")
    path.with_name(path.name + PART).write_bytes(MODEL[:100])
    with served(monkeypatch, MODEL) as ranges:
        add_voice("fenrir")
    assert ranges == ["bytes=100-"]
    assert read_model("fenrir") == MODEL


@pytest.mark.usefixtures("listed")
@pytest.mark.parametrize(
    ("name", "said"), [("heart", "part of the package"), ("nobody", "choose emma, fenrir, fable, kore")]
)
def test_other_names_are_refused(name: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        add_voice(name)


def test_a_server_that_is_not_there_is_said(listed: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hibari_voices._registry(), "BASE_URL", "http://127.0.0.1:1/")
    with pytest.raises(BackendError, match="--from FILE"):
        add_voice("kore")


@pytest.mark.usefixtures("listed")
def test_a_network_of_another_form_is_refused(tmp_path: Path) -> None:
    (tmp_path / "model.onnx").write_bytes(MODEL)
    add_voice("fenrir", tmp_path / "model.onnx")
    with pytest.raises(DataError, match="another form"):
        load_voice("fenrir", "en-us")


@pytest.mark.usefixtures("listed")
def test_an_added_voice_speaks_and_is_chosen(tmp_path: Path) -> None:
    assert default_voice("en-gb") == "heart"
    with pytest.raises(BackendError, match="voices add emma"):
        load_voice("emma", "en-gb")
    registry = hibari_voices._registry()
    add_voice("emma", Path(registry.ASSETS, registry.VOICES["heart"]["file"]))
    fitting_voice.cache_clear()
    assert default_voice("en-gb") == "emma"
    assert fitting_voice(Person(FEMALE, 25), "en-gb").name == "emma"
    speech = load_voice("emma", "en-gb").speak("The other shore is near.")
    assert [word.text for word in speech.words] == ["The", "other", "shore", "is", "near"]
    assert speech.waveform.duration > 0.8


def test_british_letters_are_those_of_the_list() -> None:
    assert word_letters(["h", "a", "p", "i"], [0, 1, 0, 0], BRITISH_LETTERS)[0] == "hˈapi"
    assert word_letters(["ɡ", "əʊ"], [0, 1], BRITISH_LETTERS)[0] == "ɡˈQ"
    assert word_letters(["n", "ɪə"], [0, 1], BRITISH_LETTERS)[0] == "nˈɪə"
    assert word_letters(["b", "ɝ", "d"], [0, 1, 0], BRITISH_LETTERS)[0] == "bˈɜːd"
    assert voice_phones(["oʊ", "æ"], BRITISH_LETTERS) == ["əʊ", "a"]
    assert word_letters(["s", "ɪ", "t", "i"], [0, 1, 0, 0], BRITISH_LETTERS)[0] == "sˈɪti"
