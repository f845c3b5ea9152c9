"""Cost of the check of an uploaded model, with its picture, and of a talker's building: CPU seconds and memory.

Memory is the largest of all children so far.
"""

import asyncio
import resource
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from lexicon.errors import BackendError
from tests.interchange.characters.made import write_character_file
from tts2face import Session
from tts2face.processes.async_parent import call_once
from tts2face.processes.program import Program
from tts2face.serving.work.tools import TALKER_BUILDER, TALKER_LIMITS, TALKER_TOOL
from tts2face.serving.work.uploaded_file import DECODE, program
from tts2face.storage.shipped import find_file
from tts2face.video.networks import find_bundle

TEXT = "We were away a year ago. Bob may move. The boy will buy a pie for you. She saw the ship near the shore."


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "words").write_text("Siobhan  SH IH0 V AO1 N\n" * 1000)
        files = {
            "talker": find_file("grid_s1", "talker"), "face": find_file("head", "face"),
            "palette": find_file("starter", "palette"), "dictionary": folder / "words",
        }  # fmt: skip
        for kind, path in files.items():
            report(kind, check(kind, path, folder / kind), path)
        try:
            find_bundle(None)
        except BackendError as missing:
            print(missing)
            return
        report(
            "face of a character", check("face", write_character_file(folder / "a.glb"), folder / "b"), folder / "a.glb"
        )
        for appearance in (False, True):
            report(f"talker of a recording, appearance {appearance}", *build(folder / str(appearance), appearance))


def check(kind: str, path: Path, out: Path) -> tuple[float, float]:
    out.mkdir()
    return cost(program(kind), DECODE, {"kind": kind, "source": str(path), "target": str(out), "limit": 1e9})


def build(folder: Path, appearance: bool) -> tuple[tuple[float, float], Path]:
    (folder / "recordings").mkdir(parents=True)
    take = folder / "recordings" / "take.mp4"
    Session().write(TEXT, take, size="256x256", fps=25)
    take.with_suffix(".txt").write_text(TEXT)
    order = {
        "folder": str(folder), "name": "anna", "provenance": {}, "consent": "me" if appearance else None,
        "with_appearance": appearance, "max_bytes": 1e9,
    }  # fmt: skip
    return cost(Program(TALKER_BUILDER, replace(TALKER_LIMITS, cpu_s=1200)), TALKER_TOOL, order), take


def cost(program: Program, kind: str, order: Mapping[str, Any]) -> tuple[float, float]:
    """CPU seconds and MB of a child."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    asyncio.run(call_once(program, kind, order))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, after.ru_maxrss / 1024


def report(what: str, measured: tuple[float, float], path: Path) -> None:
    print(f"{what}: {path.stat().st_size / 1e6:.1f} MB, {measured[0]:.1f} s of CPU, {measured[1]:.0f} MB of memory")


if __name__ == "__main__":
    main()
