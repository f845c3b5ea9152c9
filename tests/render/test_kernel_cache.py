"""Compiled kernels find a place on machines where little can be written."""

import os
from types import SimpleNamespace

import pytest

from tts2face import kernel_cache
from tts2face.kernel_cache import VARIABLE, settle_kernel_cache
from tts2face.render import raster
from tts2face.render.compiled import kernels_are_compiled


@pytest.fixture
def _locked(monkeypatch, tmp_path):
    monkeypatch.setattr(os, "environ", {key: value for key, value in os.environ.items() if key != VARIABLE})
    monkeypatch.setattr(kernel_cache, "_can_write", lambda folder: False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))


@pytest.mark.usefixtures("_locked")
def test_a_private_folder_is_used_where_nothing_else_can_be_written(tmp_path):
    settle_kernel_cache(tmp_path / "package")
    first = os.environ[VARIABLE]
    assert first.startswith(str(tmp_path))
    assert os.stat(first).st_mode & 0o077 == 0
    del os.environ[VARIABLE]
    settle_kernel_cache(tmp_path / "package")
    assert os.environ[VARIABLE] == first  # another process finds the kernels again


@pytest.mark.usefixtures("_locked")
def test_a_folder_that_others_can_write_is_not_trusted(tmp_path):
    taken = tmp_path / f"tts2face-kernels-{os.getuid()}"
    taken.mkdir()
    taken.chmod(0o777)
    settle_kernel_cache(tmp_path / "package")
    assert os.environ[VARIABLE] != str(taken)


def test_a_package_that_can_be_written_keeps_its_kernels(tmp_path, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    settle_kernel_cache(tmp_path)
    assert VARIABLE not in os.environ


def test_a_folder_below_a_file_cannot_be_written(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    assert not kernel_cache._can_write(tmp_path / "file" / "numba")
    assert kernel_cache._can_write(tmp_path / "new" / "numba")


def test_the_users_own_choice_stays(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, "/chosen")
    monkeypatch.setattr(kernel_cache, "_can_write", lambda folder: False)
    settle_kernel_cache(tmp_path)
    assert os.environ[VARIABLE] == "/chosen"


def test_kernels_count_as_compiled_once_they_lie_on_disk(monkeypatch, tmp_path):
    monkeypatch.setattr(raster, "draw_band", SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path))))
    assert not kernels_are_compiled()
    (tmp_path / "raster.draw_band-1.py311.nbi").write_bytes(b"")
    assert kernels_are_compiled()
    os.utime(tmp_path / "raster.draw_band-1.py311.nbi", (0, 0))  # older than the source
    assert not kernels_are_compiled()
