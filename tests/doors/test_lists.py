"""The commands that list what there is, the functions that they print, and shell completion."""

import json
import shutil
import subprocess
import sys
from dataclasses import asdict

import pytest

from cli.lists import LISTS
from cli.main import run
from lexicon.errors import InputError
from lexicon.languages import language_code
from tts2face import __version__
from tts2face.models.face_loading import load_face
from tts2face.models.palette_file import load_palette
from tts2face.models.talker_file import load_talker
from tts2face.request import OWN_FACE
from tts2face.session import catalogue
from tts2face.sound.voice_pool import load_voice

LISTED = ["voices", "languages", "faces", "identities", "haircuts", "hair_colors", "styles", "talkers", "formats"]


def test_there_is_a_command_for_each_list() -> None:
    assert [command.__name__ for command in LISTS] == LISTED[1:]  # voices are a group of commands


@pytest.mark.parametrize("name", LISTED)
def test_a_list_is_a_table_or_json(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    entries = getattr(catalogue, name)()
    assert run([name.replace("_", "-"), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown == json.loads(json.dumps([asdict(entry) for entry in entries]))
    assert run([name.replace("_", "-")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + len(entries)
    first = [next(iter(asdict(entry).values())) for entry in entries]
    assert [line.split("  ")[0] for line in lines[1:]] == first


def test_all_listed_entries_exist() -> None:
    for face in catalogue.faces():
        if face.name != OWN_FACE:
            assert load_face(face.name).shape_names
            assert tuple(one.name for one in catalogue.identities(face.name)) == face.identities
    for identity in catalogue.identities():
        assert load_face("head", identity.name, hair="bald").metadata["identity"] == identity.name
    palette = load_palette("starter")
    assert [style.name for style in catalogue.styles()] == list(palette.names)
    assert {style.source for style in catalogue.styles()} == {None, "grid_s1"}
    (talker,) = catalogue.talkers()
    assert talker.n_utterances == len(load_talker(talker.name).utterances)
    assert not talker.has_own_face
    assert all(language_code(language.name) == language.code for language in catalogue.languages())


def test_voices_list_their_languages_and_whether_they_are_installed() -> None:
    *shipped, piper = catalogue.voices()
    by_name = {voice.name: voice for voice in shipped}
    heart, joe, espeak, female = (by_name[name] for name in ("heart", "joe", "espeak", "espeak-female"))
    assert (heart.name, heart.languages, heart.is_installed) == ("heart", ("en-gb", "en-us"), True)
    assert (espeak.name, len(espeak.languages), espeak.is_installed) == ("espeak", len(catalogue.languages()), True)
    assert (piper.engine, piper.languages) == ("piper", ())
    assert (female.name, female.languages) == ("espeak-female", espeak.languages)
    assert (joe.languages, joe.sex, joe.engine) == (heart.languages, "male", "piper")
    for voice in (heart, espeak, female):
        for language in voice.languages[:2]:
            assert load_voice(voice.name, language).sample_rate > 0
    with pytest.raises(InputError, match="speaks English, not de"):
        load_voice(heart.name, "de")


def test_identities_and_styles_of_missing_files_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for words, reason in (
        (["identities", "--face", "nobody"], "no face 'nobody'; give ada, ben, head, mara, noor, tomas, zuri"),
        (["styles", "--palette", "nobody"], "no palette 'nobody'; give starter"),
    ):
        assert run(words) == 2
        assert reason in capsys.readouterr().err


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.strip() == __version__


def test_the_package_is_a_command() -> None:
    completed = subprocess.run(
        [sys.executable, "-m", "tts2face", "--version"], capture_output=True, text=True, check=True
    )
    assert completed.stdout.strip() == __version__


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_a_script_completes_commands(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(word in script for word in ("tts2face", "identities", "mimic"))
    if shell == "bash" and shutil.which("bash"):
        subprocess.run(["bash", "-n"], input=script, text=True, check=True)


def test_an_unknown_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["completion", "cmd"]) == 2
    assert "bash" in capsys.readouterr().err
