"""Models that sessions of a process share: read once, read again when a file changes, freed when nobody holds them."""

import gc
import os
import shutil
import threading
import weakref
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face import Session, load_face, load_palette, load_talker
from tts2face.models import talker_file
from tts2face.processes.shared import N_KEPT, Shared, free_unused, shared
from tts2face.session.named_models import Models
from tts2face.session.session_cache import SessionCache
from tts2face.storage.shipped import find_file


@pytest.fixture
def own_talker(tmp_path: Path) -> Path:
    return Path(shutil.copy(find_file("grid_s1", "talker"), tmp_path / "own.talker"))


class Value:
    """Anything that can be held weakly."""


def test_two_sessions_share_all_that_follows_from_their_files():
    one, other = Session(face="head"), Session(face="head")
    assert one.talker is other.talker
    assert one.palette is other.palette
    assert one.animated_face(has_gestures=False) is other.animated_face(has_gestures=False)
    assert one.mesh is other.mesh
    assert one._models._exemplars is other._models._exemplars


def test_sessions_of_other_faces_share_the_rest():
    one, other = Session(face="head"), Session(face="head", identity="ravi")
    assert one.talker is other.talker
    assert one.palette is other.palette
    assert one.mesh is not other.mesh


@pytest.mark.parametrize("options", [{"identity": "ravi"}, {"hair": "bob01"}, {"hair_color": "#203040"}])
def test_a_face_with_other_options_is_another_one(options: dict[str, str]):
    assert load_face("head", **options) is load_face("head", **options)
    assert load_face("head", **options) is not load_face("head")


def test_models_are_read_only():
    talker, palette = load_talker("grid_s1"), load_palette("starter")
    utterance, style = talker.utterances[0], next(iter(palette.styles.values()))
    for array in (utterance.shape, utterance.head, utterance.intensity, style.pitch, *style.motion.values()):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_a_file_is_one_by_all_its_names(own_talker: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "link.talker").symlink_to(own_talker)
    monkeypatch.chdir(tmp_path)
    found = load_talker(str(own_talker))
    assert load_talker("own.talker") is found
    assert load_talker("link.talker") is found


def test_a_changed_file_is_read_again(own_talker: Path):
    before = load_talker(str(own_talker))
    os.utime(own_talker, ns=(1, 1))
    after = load_talker(str(own_talker))
    assert after is not before
    assert np.array_equal(after.model.mean, before.model.mean)
    own_talker.write_bytes(own_talker.read_bytes()[:1000])
    with pytest.raises(DataError, match="damaged"):
        load_talker(str(own_talker))


def test_a_changed_haircut_is_worn_again(tmp_path: Path):
    hair = Path(shutil.copy(find_file("bob01", "hair"), tmp_path / "own.hair"))
    before = load_face("head", hair=str(hair))
    shutil.copy(find_file("cropped", "hair"), hair)
    assert len(load_face("head", hair=str(hair)).triangles) != len(before.triangles)


def test_memory_is_freed_when_no_session_holds_it(own_talker: Path):
    session = Session(str(own_talker), face="head")
    session.clip("Hi.")
    held = [weakref.ref(one) for one in (session.talker, session.face, session._models._exemplars)]
    free_unused()
    assert all(one() is not None for one in held)
    del session
    free_unused()
    gc.collect()
    assert [one() for one in held] == [None, None, None]


def test_a_released_session_frees_its_models(own_talker: Path):
    sessions = SessionCache(1)
    held = weakref.ref(sessions.get(Models(str(own_talker), face="head")).talker)
    sessions.get(Models(face="head"))
    gc.collect()
    assert held() is None


def test_two_threads_load_a_file_once(own_talker: Path, monkeypatch: pytest.MonkeyPatch):
    n_reads, read = [], talker_file.read_talker
    monkeypatch.setattr(talker_file, "read_talker", lambda path: n_reads.append(path) or read(path))
    found = []
    threads = [threading.Thread(target=lambda: found.append(load_talker(str(own_talker)))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(n_reads) == 1
    assert all(one is found[0] for one in found)


def test_the_last_values_stay_and_no_more():
    values: Shared[Value] = Shared()
    made = [weakref.ref(values.get(number, Value)) for number in range(N_KEPT + 2)]
    gc.collect()
    assert [one() is not None for one in made] == [False, False, *[True] * N_KEPT]


def test_a_value_that_somebody_holds_stays():
    values: Shared[Value] = Shared()
    first = values.get("first", Value)
    for number in range(N_KEPT):
        values.get(number, Value)
    assert values.get("first", Value) is first


def test_what_could_not_be_made_is_tried_again():
    values: Shared[Value] = Shared()
    with pytest.raises(ZeroDivisionError):
        values.get("key", lambda: 1 // 0)
    assert isinstance(values.get("key", Value), Value)


def test_a_result_belongs_to_the_same_objects_and_options():
    @shared
    def make(one: Value, option: str = "") -> Value:
        del one, option
        return Value()

    first, second = Value(), Value()
    assert make(first) is make(first)
    assert make(first) is not make(second)
    assert make(first, option="x") is make(first, option="x")
    assert make(first, option="x") is not make(first)
