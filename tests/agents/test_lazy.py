"""Agents are loaded when they are used, and a missing package says how it is installed."""

import subprocess
import sys

import pytest

from lexicon.errors import BackendError
from tts2face import agents


def test_no_framework_is_imported_with_the_package() -> None:
    code = "import sys, tts2face.agents; print([name for name in ('livekit', 'pipecat') if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


@pytest.mark.parametrize(
    ("name", "package", "extra"),
    [("LiveKitAvatar", "livekit", "livekit"), ("PipecatFace", "pipecat", "pipecat")],
)
def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch, name: str, package: str, extra: str) -> None:
    for module in [one for one in sys.modules if one.partition(".")[0] == package or "agents." in one]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(
        BackendError, match=rf"{name} needs the package {package}-\w+; run: pip install 'tts2face\[{extra}\]'"
    ):
        getattr(agents, name)


def test_other_names_are_none() -> None:
    with pytest.raises(AttributeError, match="has no attribute Nobody"):
        agents.Nobody  # noqa: B018
