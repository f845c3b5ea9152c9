"""Cache folder of the compiled kernels where the package cannot be written."""

import gc
import logging
import os
from dataclasses import replace
from functools import partial
from pathlib import Path

import numba
import pytest

from cli.process import COMPILATION
from cli.progress import compilation_messages, progress_bar
from lexicon.errors import BackendError
from tests.picture.film.lit_face import lit_tiny_face
from tests.processes.answered import answered
from tts2face.face import deformation, eyeballs
from tts2face.gestures import field_kernels
from tts2face.lips import blending, contacts, token_search, tokens
from tts2face.models import phone_network
from tts2face.models.light import Lamps
from tts2face.numeric import compiler, least_squares
from tts2face.numeric import kernels as compilation
from tts2face.numeric.kernels import CACHE_VARIABLE, Kernel, cache_folder
from tts2face.picture.baked import cut_out, eyes, modes, response, shading, visibility
from tts2face.picture.kernels import fragments, raster, shade, strand_light, strands
from tts2face.request import OWN_FACE
from tts2face.serving.service.logs import LineFormatter
from tts2face.session import warm_up
from tts2face.session.named_models import Models
from tts2face.session.warm_up import kernels_are_compiled
from tts2face.sound import loudness, segments

CLIP = (
    visibility, modes, shading, eyes, response, cut_out, fragments, deformation, eyeballs, blending, contacts,
    token_search, tokens, phone_network, least_squares, field_kernels, segments, loudness,
)  # fmt: skip


@pytest.fixture
def _locked(monkeypatch, tmp_path):
    monkeypatch.delenv(CACHE_VARIABLE, raising=False)
    monkeypatch.setattr(compilation, "_can_write", lambda folder: False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))


@pytest.mark.usefixtures("_locked")
def test_a_private_folder_is_used_where_nothing_else_can_be_written(tmp_path):
    first = cache_folder()
    assert first.parent == tmp_path
    assert first.stat().st_mode & 0o077 == 0
    assert cache_folder() == first  # another process finds the kernels again


@pytest.mark.usefixtures("_locked")
def test_a_folder_that_others_can_write_is_not_trusted(tmp_path):
    taken = tmp_path / f"tts2face-kernels-{os.getuid()}"
    taken.mkdir()
    taken.chmod(0o777)
    assert cache_folder() != taken


def test_kernels_lie_in_the_cache_of_the_user(tmp_path, monkeypatch):
    monkeypatch.delenv(CACHE_VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "tts2face" / "kernels"


def test_a_folder_below_a_file_cannot_be_written(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    assert not compilation._can_write(tmp_path / "file" / "numba")
    assert compilation._can_write(tmp_path / "new" / "numba")


def test_a_folder_that_the_user_sets_is_kept(monkeypatch):
    monkeypatch.setenv(CACHE_VARIABLE, "/chosen")
    monkeypatch.setattr(compilation, "_can_write", lambda folder: False)
    assert cache_folder() == Path("/chosen")


@pytest.fixture
def indexes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, Path]:
    """Files of a kernel of motion and of one of each kind of drawing, which do not exist."""
    monkeypatch.setattr(compilation, "FOLDER", tmp_path)
    kernels = {
        "motion": contacts._closest_rows,
        "gestures": field_kernels.generate_frames,
        "lamps": raster.draw_band,
        "baked": visibility.find_nearest,
    }
    files = {what: found._folder() / f"{found._stem()}-0{compilation.SUFFIX}" for what, found in kernels.items()}
    for file in files.values():
        file.parent.mkdir(exist_ok=True)
    return files


def test_kernels_count_as_compiled_once_they_lie_on_disk(indexes):
    lit = lit_tiny_face()
    assert not kernels_are_compiled(None)
    indexes["motion"].write_bytes(b"")
    assert kernels_are_compiled(None)
    for kind, face in (("lamps", replace(lit, light=Lamps())), ("baked", lit)):
        assert not kernels_are_compiled(face)
        indexes[kind].write_bytes(b"")
        assert kernels_are_compiled(face)


def test_kernels_on_disk_are_not_compiled_again(indexes, monkeypatch):
    """Neither by a command's child nor by a process of a server; those of one part do not stand for another's."""
    made = []
    monkeypatch.setattr(Models, "shown_face", lambda _: lit_tiny_face())
    monkeypatch.setattr(warm_up, "compile_pictures", made.append)
    for part in ("compile_motion", "compile_gestures"):
        monkeypatch.setattr(warm_up, part, lambda part=part: made.append(part))
    parts = {"motion": "compile_motion", "gestures": "compile_gestures", "baked": "compile_pictures"}
    for index, part in parts.items():
        answered(warm_up.HANDLERS[part], {})
        assert len(made) == 1
        indexes[index].write_bytes(b"")
        answered(warm_up.HANDLERS[part], {})
        assert len(made) == 1
        made.clear()


def test_a_face_without_mesh_has_no_pictures_to_compile(monkeypatch):
    monkeypatch.setattr(warm_up, "compile_pictures", pytest.fail)
    answered(warm_up.HANDLERS["compile_pictures"], {"face": OWN_FACE})


def test_a_command_and_its_children_share_the_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []

    class Fake:
        def __init__(self, _: object) -> None:
            made.append("child")

        def call(self, work: str, _: object, *, timeout_s: float) -> None:
            made.append(work)
            raise BackendError(f"{work} took {timeout_s} s")

        def close(self) -> None:
            made.append("closed")

    tasks = ["compile_motion", "compile_gestures", "compile_sound"]
    monkeypatch.setattr(warm_up, "Child", Fake)
    monkeypatch.setattr(warm_up, "TASKS", {name: partial(made.append, name) for name in tasks})
    monkeypatch.setattr(warm_up, "compile_pictures", lambda _: made.append("compile_pictures"))
    for cores in (1, 2, 8):
        made.clear()
        monkeypatch.setattr(warm_up, "available_cores", lambda cores=cores: cores)
        warm_up.compile_kernels(lit_tiny_face())
        assert sorted(made) == sorted(
            [*["child", "closed"] * min(cores - 1, 3), "compile_pictures", *tasks]
        )  # each once, though a child failed


def test_garbage_is_collected_again_after_a_compilation() -> None:
    assert gc.isenabled()
    compiler.COMPILATIONS.on_start(None)
    compiler.COMPILATIONS.on_start(None)
    compiler.COMPILATIONS.on_end(None)
    assert not gc.isenabled()
    compiler.COMPILATIONS.on_end(None)
    assert gc.isenabled()


@pytest.mark.parametrize("module", [raster, shade, strand_light, strands], ids=lambda module: module.__name__)
def test_kernels_that_may_reorder_sums_call_inlined_ones_only(module):
    for found in vars(module).values():
        if isinstance(found, Kernel) and found.reorders_sums:
            called = [found.py_func.__globals__.get(name) for name in found.py_func.__code__.co_names]
            assert all(inner.is_inlined for inner in called if isinstance(inner, Kernel))


def test_some_kernels_may_reorder_sums():
    assert shade.shade_fragments.reorders_sums


@pytest.mark.parametrize("module", CLIP, ids=lambda module: module.__name__)
def test_kernels_of_a_clip_need_nothing_of_numba(module):
    """Kernels that allocate or reshape call numba's run time, which takes 200 ms and 60 MB of each command."""
    kernels = [found for found in vars(module).values() if isinstance(found, Kernel)]
    assert kernels
    assert not [found.__name__ for found in kernels if compiler._allocates(found)]
    assert not [found.__name__ for found in kernels if "reshape" in found.py_func.__code__.co_names]


def test_kernels_that_allocate_are_known():
    assert compiler._allocates(raster.draw_band)
    assert not compiler._allocates(raster.tile_depths)


def test_compilation_is_announced_with_its_progress_unless_quiet(monkeypatch, capsys):
    """By whatever command compiles, also within its progress bar, and once."""
    monkeypatch.setattr(compiler, "REPORT_S", 0.0)
    monkeypatch.setattr(compiler.COMPILATIONS, "_next_s", 0.0)
    with compilation_messages(), progress_bar("rendering"):
        numba.njit(lambda x: x + 1)(1)
        numba.njit(lambda x: x + 2)(1)
    first, second = capsys.readouterr().err.splitlines()[-2:]
    for line in (first, second):
        assert line.startswith("compiling kernels, once on this machine")
    assert second.endswith("functions so far")
    with compilation_messages(quiet=True), progress_bar("rendering", quiet=True):
        numba.njit(lambda x: x + 3)(1)
    assert capsys.readouterr().err == ""


def test_compilation_is_an_event_of_the_service(caplog):
    with caplog.at_level(logging.INFO, COMPILATION):
        compilation.LOG.info("compiling kernels", extra={"fields": {"functions": 3}})
    line = LineFormatter("text").format(caplog.records[-1])
    assert line.endswith('INFO "compiling kernels" functions=3')
