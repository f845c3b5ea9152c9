"""The public names of the package: imported lazily, without side effects, and complete for type checkers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import tts2face

HEAVY = ("numpy", "numba", "scipy", "av", "PIL", "onnxruntime", "hibari", "cyclopts")


def run_python(code: str, home: Path) -> str:
    """Output of a fresh process with an empty home folder."""
    environment = {"PATH": os.environ["PATH"], "HOME": str(home), "PYTHONPATH": str(Path(tts2face.__file__).parents[1])}
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True, cwd=home
    )
    return answer.stdout


def test_importing_the_package_has_no_side_effect(tmp_path: Path) -> None:
    code = (
        "import os, sys; before = dict(os.environ)\n"
        "import tts2face\n"
        "assert dict(os.environ) == before\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    assert run_python(code, tmp_path).strip() == "[]"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", tts2face.__all__)
def test_every_public_name_can_be_imported(name: str) -> None:
    value = getattr(tts2face, name)
    assert value.__doc__
    assert name in dir(tts2face)


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'synthesise'"):
        _ = tts2face.synthesise


def test_lazy_names_and_names_for_type_checkers_are_the_same() -> None:
    assert sorted(tts2face._HOMES) == sorted(tts2face.__all__)
