"""Cache folder of the compiled kernels where the package cannot be written."""

import gc
import logging
import os
import subprocess
import sys
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from cli.process import COMPILATION, compilation_messages, progress_bar
from lexicon.errors import BackendError
from tests.picture.film.lit_face import lit_tiny_face
from tests.processes.answered import answered
from tts2face.gestures import field_kernels
from tts2face.lips import contacts
from tts2face.numeric import kernels as compilation
from tts2face.numeric.kernels import CACHE_VARIABLE, cache_folder
from tts2face.picture.baked import surface
from tts2face.picture.kernels import raster, shade, strands
from tts2face.picture.kernels import strands as strand_light
from tts2face.request import OWN_FACE
from tts2face.serving.service.logs import LineFormatter
from tts2face.session import warm_up
from tts2face.session.named_models import Models
from tts2face.session.warm_up import kernels_are_compiled
from tts2face.sound.level import filter_biquad


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
    """Index files of a kernel of motion and of one of each kind of drawing, which do not exist."""
    stats = SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path)))
    monkeypatch.setattr(raster, "draw_band", stats)
    monkeypatch.setattr(surface, "find_nearest", stats)
    monkeypatch.setattr(contacts, "_closest_rows", stats)
    monkeypatch.setattr(field_kernels, "generate_frames", stats)
    names = {
        "motion": "contacts._closest_rows",
        "gestures": "field_kernels.generate_frames",
        "lamps": "raster.draw_band",
        "baked": "surface.find_nearest",
    }
    return {what: tmp_path / f"{name}-1.py311.nbi" for what, name in names.items()}


def test_kernels_count_as_compiled_once_they_lie_on_disk(indexes):
    lit = lit_tiny_face()
    assert not kernels_are_compiled(None)
    indexes["motion"].write_bytes(b"")
    assert kernels_are_compiled(None)
    for kind, face in (("lamps", replace(lit, light=())), ("baked", lit)):
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


def test_a_command_and_its_children_share_the_works(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []

    class Fake:
        def __init__(self, _: object) -> None:
            made.append("child")

        def call(self, work: str, _: object, *, timeout_s: float) -> None:
            made.append(work)
            raise BackendError(f"{work} took {timeout_s} s")

        def close(self) -> None:
            made.append("closed")

    works = ["compile_motion", "compile_gestures", "compile_sound"]
    monkeypatch.setattr(warm_up, "Child", Fake)
    monkeypatch.setattr(warm_up, "WORKS", {name: partial(made.append, name) for name in works})
    monkeypatch.setattr(warm_up, "compile_pictures", lambda _: made.append("compile_pictures"))
    for cores in (1, 2, 8):
        made.clear()
        monkeypatch.setattr(warm_up, "available_cores", lambda cores=cores: cores)
        warm_up.compile_kernels(lit_tiny_face())
        assert sorted(made) == sorted(
            [*["child", "closed"] * min(cores - 1, 3), "compile_pictures", *works]
        )  # each once, though a child failed


def test_garbage_is_collected_again_after_a_compilation() -> None:
    assert gc.isenabled()
    compilation.COMPILATIONS.on_start(None)
    compilation.COMPILATIONS.on_start(None)
    compilation.COMPILATIONS.on_end(None)
    assert not gc.isenabled()
    compilation.COMPILATIONS.on_end(None)
    assert gc.isenabled()


CALLER = """
from {room}.callee import SCALE, value
from tts2face.numeric.kernels import kernel

@kernel
def twice():
    return 2 * SCALE * value()
"""
CALLEE = """
from tts2face.numeric.kernels import {kind}
SCALE = {scale}

@{kind}
def value():
    return {value}
"""
CALL = "from {room}.caller import twice; print(twice(), sum(twice.stats.cache_hits.values()))"
ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("kind", ["kernel", "inlined_kernel"])
def test_installations_share_code_that_is_compiled_of_the_same(tmp_path, monkeypatch, kind):
    """A kernel is compiled again where one that it calls, or a constant, is another; old versions are removed."""
    monkeypatch.setattr(compilation, "FOLDER", tmp_path / "kernels")
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def install(where: str, scale: int, value: int, room: str = "tests_made") -> Path:
        package = tmp_path / where / room
        package.mkdir(parents=True)
        (package / "caller.py").write_text(CALLER.format(room=room))
        (package / "callee.py").write_text(CALLEE.format(kind=kind, scale=scale, value=value))
        return package

    def call(*installation: object) -> tuple[int, int]:
        """What an installation computes, and how much of its code was in the cache."""
        package = install(*installation)
        for name in ("callee", "caller", ""):
            sys.modules.pop(f"{package.name}.{name}".removesuffix("."), None)
        with monkeypatch.context() as path:
            path.syspath_prepend(package.parent)
            twice = import_module(f"{package.name}.caller").twice
        return twice(), sum(twice.stats.cache_hits.values())

    assert call("one", 1, 2) == (4, 0)
    assert call("two", 1, 2) == (4, 1)
    paths = os.pathsep.join((str(tmp_path / "two"), str(ROOT)))
    environment = os.environ | {CACHE_VARIABLE: str(tmp_path / "kernels"), "PYTHONPATH": paths}
    in_another_process = subprocess.run(
        [sys.executable, "-B", "-c", CALL.format(room="tests_made")], env=environment, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert in_another_process.stdout.strip() == "4 1"
    assert call("three", 1, 5) == (10, 0)
    assert call("four", 3, 5) == (30, 0)
    assert call("five", 3, 5, "tests_moved") == (30, 0)
    assert [call(f"version {value}", 1, value) for value in (6, 7)] == [(12, 0), (14, 0)]
    assert len(list((tmp_path / "kernels").glob("caller-*"))) == compilation.N_VERSIONS


@pytest.mark.parametrize("module", [raster, shade, strand_light, strands], ids=lambda module: module.__name__)
def test_kernels_that_may_reorder_sums_call_inlined_ones_only(module):
    for found in vars(module).values():
        if isinstance(found, Dispatcher) and found.targetoptions.get("fastmath"):
            called = [found.py_func.__globals__.get(name) for name in found.py_func.__code__.co_names]
            kernels = [kernel for kernel in called if isinstance(kernel, Dispatcher)]
            assert all(kernel.targetoptions.get("inline") == "always" for kernel in kernels)


def test_some_kernels_may_reorder_sums():
    assert shade.shade_fragments.targetoptions["fastmath"]


COMPILED_ONLY = """
import sys
import numpy as np
from tts2face.sound.level import filter_biquad
filtered = filter_biquad(np.ones(3), np.ones(3), np.ones(4))
print(filtered.tolist(), sum(filter_biquad.stats.cache_hits.values()), "numba.np.linalg" in sys.modules)
"""


def test_a_compiled_kernel_is_loaded_without_the_compiler():
    ones = np.ones(3)
    wanted = filter_biquad(ones, ones, np.ones(4)).tolist()  # compiles it where the cache is empty
    found = subprocess.run([sys.executable, "-c", COMPILED_ONLY], check=True, capture_output=True, text=True)
    assert found.stdout.split("\n")[0] == f"{wanted} 1 False"


def test_compilation_is_announced_with_its_progress_unless_quiet(monkeypatch, capsys):
    """By whatever command compiles, also within its progress bar, and once."""
    monkeypatch.setattr(compilation, "REPORT_S", 0.0)
    monkeypatch.setattr(compilation.COMPILATIONS, "_next_s", 0.0)
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
