"""Compiled kernels: they compute what their text says, and code is shared and compiled again as it must be."""

import os
import platform
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import NumbaError

from tts2face.numeric import kernels as compilation
from tts2face.numeric import object_code
from tts2face.numeric.kernels import CACHE_VARIABLE, Kernel, inlined_kernel, kernel
from tts2face.sound.loudness import filter_biquad

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
CALL = "from {room}.caller import twice; print(twice(), twice.n_from_cache)"
ROOT = Path(__file__).parents[2]
COMPILED_ONLY = """
import sys
import numpy as np
from tts2face.sound.loudness import filter_biquad
samples = np.ones(4)
filter_biquad(np.ones(3), np.ones(3), samples)
print(samples.tolist(), filter_biquad.n_from_cache, {"numba", "llvmlite"} & set(sys.modules))
"""
VALUES, TABLE = np.linspace(0.0, 1.0, 6), np.arange(12, dtype=np.float32).reshape(6, 2)
READ_ONLY = VALUES.copy()
READ_ONLY.flags.writeable = False


class Span(NamedTuple):
    """Arguments with names, one in another."""

    first: np.ndarray
    inner: tuple[int, float]
    last: int


@kernel
def read_span(span: Span, shift: int) -> float:
    return span.first[span.last] + span.inner[0] * span.inner[1] + shift


def test_arguments_may_have_names():
    span = Span(np.arange(4.0), (3, 0.5), 2)
    assert read_span(span, 10) == 2 + 1.5 + 10
    assert read_span(span._replace(last=3), 0) == 3 + 1.5


def test_code_is_compiled_again_where_named_arguments_change_their_order(monkeypatch):
    names = dict(read_span.py_func.__globals__)
    path = read_span.py_func.__code__.co_filename
    monkeypatch.setattr(compilation, "_stamps", {})
    before = compilation._stamp(path, names)
    compilation._stamps.clear()
    assert compilation._stamp(path, names) == before
    compilation._stamps.clear()
    names["Span"] = NamedTuple("Span", [("last", int), ("inner", tuple), ("first", np.ndarray)])
    assert compilation._stamp(path, names) != before


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
        """Result of an installation, and how much of its code was in the cache."""
        package = install(*installation)
        for name in ("callee", "caller", ""):
            sys.modules.pop(f"{package.name}.{name}".removesuffix("."), None)
        with monkeypatch.context() as path:
            path.syspath_prepend(package.parent)
            twice = import_module(f"{package.name}.caller").twice
        return twice(), twice.n_from_cache

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


def test_a_compiled_kernel_is_loaded_without_the_compiler():
    ones, samples = np.ones(3), np.ones(4)
    filter_biquad(ones, ones, samples)  # compiles it where the cache is empty
    found = subprocess.run([sys.executable, "-c", COMPILED_ONLY], check=True, capture_output=True, text=True)
    is_elf = sys.platform == "linux" and platform.machine() == "x86_64"
    loaded = set() if is_elf else {"llvmlite"}
    assert found.stdout.split("\n")[0] == f"{samples.tolist()} 1 {loaded}"


@inlined_kernel
def _square(x: float) -> float:
    return x * x


@kernel
def _sum_squares(values, scale):  # type: ignore[no-untyped-def]
    total = 0.0
    for n in range(len(values)):
        total += _square(values[n]) * scale
    return total


@kernel
def _measure(both, step, is_added, out):  # type: ignore[no-untyped-def]
    """Uses all kinds of arguments, a function of the C library, and memory; returns all kinds of results."""
    values, table = both
    space = np.zeros(len(values))
    for n in range(0, len(values), step):
        space[n] = np.exp(values[n]) + table[n, 1]
        out[n] = space[n] if is_added else -space[n]
    return len(values), np.float32(_sum_squares(space, 2.0)), is_added


@kernel
def _first(values):  # type: ignore[no-untyped-def]
    return len(values)


@kernel
def _last(table):  # type: ignore[no-untyped-def]
    return table[table.shape[0] - 1, table.shape[1] - 1]


@pytest.mark.parametrize("is_loaded_by_llvm", [False, True])
@pytest.mark.parametrize(
    "arguments",
    [
        ((VALUES, TABLE), 1, True),
        ((VALUES[::-1], np.asfortranarray(TABLE)), 2, False),
        ((READ_ONLY[:4:2], TABLE[::2]), np.int64(1), np.bool_(True)),
        ((VALUES.astype(np.float32), TABLE), np.uint8(3), False),
    ],
)
def test_a_kernel_computes_what_its_text_says(monkeypatch, tmp_path, arguments, is_loaded_by_llvm):
    """Compiled, and again from the cache; by both loaders of object code."""
    if is_loaded_by_llvm:
        monkeypatch.setattr(object_code, "machine", lambda: "another")
    monkeypatch.setattr(compilation, "FOLDER", tmp_path)
    n = len(arguments[0][0])
    wanted, shown = np.zeros(n), np.zeros(n)
    results = _measure.py_func(*arguments, wanted)
    for n_from_cache in (0, 1):
        measure = Kernel(_measure.py_func)
        found = measure(*arguments, shown)
        assert found == results
        assert [type(number) for number in found] == [int, float, bool]
        np.testing.assert_allclose(shown, wanted, rtol=1e-12)
        assert measure.n_from_cache == n_from_cache


@kernel
def _add_whole(values, out):  # type: ignore[no-untyped-def]
    out[:] = values + out


@kernel
def _call_add_whole(values, out):  # type: ignore[no-untyped-def]
    _add_whole(values, out)


@pytest.mark.parametrize("add", [_add_whole, _call_add_whole])
def test_kernels_may_use_whole_arrays(add):
    out = np.ones(6)
    add(VALUES, out)
    np.testing.assert_array_equal(out, VALUES + 1.0)


def test_a_kernel_says_that_memory_is_short(monkeypatch):
    measure = Kernel(_measure.py_func)
    out = np.zeros(6)
    measure((VALUES, TABLE), 1, True, out)
    ((key, (_, *rest)),) = measure._calls.items()
    monkeypatch.setitem(measure._calls, key, (lambda *_: 1, *rest))
    with pytest.raises(MemoryError, match="_measure lacks memory"):
        measure((VALUES, TABLE), 1, True, out)


def test_damaged_code_is_compiled_again(monkeypatch, tmp_path):
    monkeypatch.setattr(compilation, "FOLDER", tmp_path)
    assert Kernel(_sum_squares.py_func)(VALUES, 2.0) == _sum_squares(VALUES, 2.0)
    (file,) = tmp_path.glob("*/*")
    for content in (b"", b"OO", file.read_bytes()[:-100]):
        file.write_bytes(content)
        again = Kernel(_sum_squares.py_func)
        assert again(VALUES, 2.0) == _sum_squares(VALUES, 2.0)
        assert again.n_from_cache == 0


@pytest.mark.parametrize(
    ("argument", "name"), [("text", "str"), (np.zeros(2, complex), "complex"), (np.zeros(2, "i4,f4"), "Record")]
)
def test_an_argument_of_another_kind_is_refused(argument, name):
    with pytest.raises(TypeError, match=f"a kernel takes arrays, numbers and tuples of them, not .*{name}"):
        _first(argument)


def test_arrays_of_another_order_or_byte_order_have_code_of_their_own():
    table = np.arange(6.0).reshape(2, 3)
    for shown in (table, table.T, np.asfortranarray(table), table[:, ::-1], table[::-1, ::2], table[:1], table[:, :1]):
        assert _last(shown) == shown[-1, -1]
    with pytest.raises(NumbaError):
        _last(table.astype(table.dtype.newbyteorder()))


def test_threads_load_a_kernel_once(monkeypatch):
    fresh, loaded = Kernel(_sum_squares.py_func), []
    load = compilation.load_object
    monkeypatch.setattr(compilation, "load_object", lambda *given: loaded.append(1) or load(*given))
    with ThreadPoolExecutor(4) as pool:
        found = set(pool.map(lambda _: fresh(VALUES, 2.0), range(8)))
    assert found == {_sum_squares(VALUES, 2.0)}
    assert len(loaded) == 1
