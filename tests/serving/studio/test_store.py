"""Projects on disk."""

import io
import json
import os
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from lexicon.errors import BackendError, DataError, InputError
from tts2face.request import Request
from tts2face.serving.studio.history import History
from tts2face.serving.studio.project_archive import archive
from tts2face.serving.studio.project_store import ASSETS, HISTORY, PROJECT, ProjectStore
from tts2face.session.project import Project
from tts2face.session.project_file import load_project
from tts2face.storage.temporary import Temporary

PROJECT_ONE = Project(name="One", request=Request(text="Hello."))


@pytest.fixture
def store(tmp_path: Path) -> ProjectStore:
    return ProjectStore(tmp_path / "studio")


def test_a_project_and_its_history_come_back(store: ProjectStore) -> None:
    number = store.create("ann", PROJECT_ONE)
    history = History(PROJECT_ONE).add(replace(PROJECT_ONE, name="Two"), "name")
    history = history.add(replace(PROJECT_ONE, name="Three")).undo()
    store.write(number, history)
    back = store.read(number, "ann")
    assert back.present == history.present
    assert [(one.project, one.topic) for one in back.past] == [(one.project, one.topic) for one in history.past]
    assert [one.project.name for one in back.future] == ["Three"]


def test_an_archive_has_the_same_bytes_at_any_time(tmp_path: Path) -> None:
    words = tmp_path / "words.txt"
    archives = []
    for seconds in (1_000_000_000, 1_500_000_000):
        words.write_text("Nguyen W IH1 N\n", encoding="utf-8")
        os.utime(words, (seconds, seconds))
        archives.append(archive(replace(PROJECT_ONE, request=Request(text="Hello.", dictionary=words))))
    assert archives[0] == archives[1]
    with zipfile.ZipFile(io.BytesIO(archives[0])) as packed:
        assert packed.read("words.txt") == words.read_bytes()
        assert {member.date_time[0] for member in packed.infolist()} == {1980}


def test_the_file_is_the_one_of_the_command_line(store: ProjectStore, tmp_path: Path) -> None:
    number = store.create("ann", PROJECT_ONE)
    sound = tmp_path / "given"
    sound.write_bytes(b"RIFF")
    asset = store.add_asset(number, "recording.wav", sound)
    project = Project(request=Request(text="Hello.", audio=asset))
    store.write(number, History(project))
    file = store.folder(number, "ann") / PROJECT
    assert json.loads(file.read_text())["request"]["audio"] == f"{ASSETS}/recording.wav"
    assert load_project(file) == project


def test_owners_see_their_own_projects_only(store: ProjectStore) -> None:
    mine, other = store.create("ann", PROJECT_ONE), store.create("bob", PROJECT_ONE)
    assert [one.id for one in store.entries("ann")] == [mine]
    with pytest.raises(InputError, match="there is no project"):
        store.read(other, "ann")
    with pytest.raises(InputError, match="there is no project"):
        store.remove(other, "ann")


@pytest.mark.parametrize("number", ["", "..", "../../x", "0" * 16, "A" * 16])
def test_other_ids_reach_no_file(store: ProjectStore, number: str) -> None:
    store.create("ann", PROJECT_ONE)
    with pytest.raises(InputError, match="there is no project"):
        store.folder(number, "ann")


def test_entries_name_the_project_its_size_and_the_last_changed_first(store: ProjectStore) -> None:
    first, second = store.create("ann", PROJECT_ONE), store.create("ann", replace(PROJECT_ONE, name="Two"))
    folder = store.folder(first, "ann")
    (folder / ASSETS / "recording.wav").write_bytes(bytes(5000))
    os.utime(store.folder(second, "ann") / PROJECT, (1, 1))
    entries = store.entries("ann")
    assert [(one.id, one.name) for one in entries] == [(first, "One"), (second, "Two")]
    assert entries[0].n_bytes > 5000 > entries[1].n_bytes


def test_a_removed_project_leaves_nothing(store: ProjectStore, tmp_path: Path) -> None:
    number = store.create("ann", PROJECT_ONE)
    store.remove(number, "ann")
    assert list((tmp_path / "studio" / "projects").iterdir()) == []


def test_a_damaged_history_costs_the_history_only(store: ProjectStore) -> None:
    number = store.create("ann", PROJECT_ONE)
    (store.folder(number, "ann") / HISTORY).write_text('{"past": [{"project"')
    assert store.read(number, "ann").present == PROJECT_ONE
    (store.folder(number, "ann") / PROJECT).write_text("{}")
    with pytest.raises(DataError, match="is not a project"):
        store.read(number, "ann")


def test_a_write_that_fails_leaves_the_last_state(store: ProjectStore, monkeypatch: pytest.MonkeyPatch) -> None:
    number = store.create("ann", PROJECT_ONE)
    monkeypatch.setattr(Temporary, "replace", _refuse)
    with pytest.raises(BackendError, match="cannot write"):
        store.write(number, History(replace(PROJECT_ONE, name="Two")))
    monkeypatch.undo()
    assert store.read(number, "ann").present == PROJECT_ONE
    assert {path.name for path in store.folder(number, "ann").iterdir()} == {PROJECT, HISTORY, "owner", ASSETS}


def _refuse(self: Temporary, target: Path) -> None:
    raise OSError(28, "No space left on device", str(target))


@pytest.mark.parametrize("name", ["../x.wav", "x", "a/b.wav", ".wav", "X.WAV"])
def test_assets_have_plain_names(store: ProjectStore, tmp_path: Path, name: str) -> None:
    number = store.create("ann", PROJECT_ONE)
    with pytest.raises(InputError, match="an asset cannot be called"):
        store.add_asset(number, name, tmp_path)


def test_words_are_kept_by_owner_and_dropped(store: ProjectStore) -> None:
    store.keep_word("ann", "tomato", "T AH0 M EY1 T OW2")
    store.keep_word("ann", "Tomato", "/təmɑtoʊ/")
    assert (store.words("ann"), store.words("bob")) == ({"Tomato": "/təmɑtoʊ/"}, {})
    with pytest.raises(DataError, match="QQ"):
        store.keep_word("ann", "other", "QQ")
    store.keep_word("ann", "tomato", "")
    assert store.words("ann") == {}
