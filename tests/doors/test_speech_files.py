"""Sound, captions and phones are written without talker, face and palette, with the bytes of a session's files."""

from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from tests.world import World
from tts2face.interchange.exports.table import FORMATS
from tts2face.session.named_models import Models
from tts2face.session.outputs import is_speech_only, plan_outputs, write_speech
from tts2face.session.prepared import prepare_request
from tts2face.session.session import Session
from tts2face.sound.voice_pool import VoicePool

TEXT = "Hello [mark here] there, Bob. Good bye."
NAMES = [f"a{one.suffixes[0]}" for one in FORMATS if not one.has_motion]
SPEECH: dict[str, tuple[str, dict[str, Any], list[str]]] = {
    "all formats": (TEXT, {"fps": 24, "seed": 2}, NAMES),
    "sound alone": ("Hello there. [pause 0.3] Good bye!", {"volume": 0.8}, ["a.wav"]),
    "silence": ("", {"idle": 1.3}, ["a.wav", "a.vtt"]),
    "another voice": ("Guten Morgen.", {"language": "de"}, ["a.wav", "a.TextGrid"]),
}


@pytest.fixture(scope="module")
def session(world: World, voices: VoicePool) -> Session:
    """The voices are those that are shipped, as where nothing else is loaded."""
    return world.session(voices=voices)


@pytest.mark.parametrize("name", SPEECH)
def test_the_files_are_those_of_a_session(name: str, session: Session, voices: VoicePool, tmp_path: Path) -> None:
    text, options, names = SPEECH[name]
    prepared, steps = prepare_request(text, options).with_seed(session._models.seed), []
    found = {}
    for folder in ("speech", "session"):
        (tmp_path / folder).mkdir()
        paths = [tmp_path / folder / name for name in names]
        if folder == "session":
            written = session.export(prepared, paths)
        else:
            outputs = plan_outputs(None, paths, {})
            assert is_speech_only(prepared, outputs)
            written = write_speech(prepared, outputs, voices, lambda *step: steps.append(step))
        files = {path.name: path.read_bytes() for path in paths}
        found[folder] = (files, written.seconds, written.n_frames, written.marks)
    assert found["speech"] == found["session"]
    assert steps[-1] == (prepared.n_steps, prepared.n_steps)


def test_no_model_is_loaded_unless_it_is_needed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = []
    monkeypatch.setattr(Models, "open_session", lambda *_: opened.append("session") or pytest.skip("opened"))
    plain = ["Hello.", "--voice", "espeak", "--quiet", "--out"]
    assert run([*plain, str(tmp_path / "a.wav"), "--export", str(tmp_path / "a.vtt")]) == 0
    assert not opened
    unlike = [
        [*plain, str(tmp_path / "a.csv")],
        [*plain, str(tmp_path / "b.wav"), "--style", "delighted"],  # the palette has to have it
        [*plain, str(tmp_path / "b.wav"), "--face", "head"],
        [*plain, str(tmp_path / "b.wav"), "--explain", str(tmp_path / "b.txt")],
        [*plain, str(tmp_path / "b.wav"), "--talker", "nobody.talker"],
        ["[style:annoyed]Hello.[/style]", *plain[1:], str(tmp_path / "b.wav")],
    ]
    for number, arguments in enumerate(unlike, start=1):
        with pytest.raises(pytest.skip.Exception, match="opened"):
            run(arguments)
        assert len(opened) == number, arguments
    assert not (tmp_path / "b.wav").exists()
