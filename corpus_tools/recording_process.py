"""Prompts and checks of takes for a recording page, in a process with limits that keeps its networks loaded.

``python -m corpus_tools.recording_process``, started by `tts2face.studio.recording.take_checks`: standard input holds
one order a line, a JSON object, and ends with the parent process; each is answered by one line of JSON on standard
output.

``{"kind": "prompts", "minutes", "language", "text"}``, where the text is a path or null, gives ``prompts``, objects
with ``text``, ``phones`` and ``triphones``, and ``running``, the counts of ``phones`` and ``triphones`` in running
text; a triphone is its three visemes, joined by spaces. ``{"kind": "check", "video", "text", "cache"}`` gives
``findings`` with ``severity``, ``code`` and ``message``, and the ``key`` with which the names of the take's files in
the cache folder begin. Whatever cannot be answered gives ``error`` and ``message``.
"""

import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from corpus_tools.prompts.coverage import RunningText, Units
from corpus_tools.prompts.prompts import choose_prompts
from corpus_tools.recordings.check_recording import RecordingChecker, recordings_to_check
from corpus_tools.recordings.corpus_video import content_key
from corpus_tools.recordings.limits import OUT_OF_SYNC, WARNING
from corpus_tools.run_options import RunOptions
from lexicon.errors import Tts2faceError
from tts2face.child_process import claim_standard_output, received_requests
from tts2face.limited_process import ProcessLimits, limit_process

IN_FRONT_OF_A_CAMERA = {  # parts of findings, and what a person can do who is just recording
    "correct the words": "read exactly what is shown",
    "check the transcript": "read exactly what is shown",
    "give the original sound or record it again": "keep the mouth in view and read it again",
    "cut the video": "stay in the picture",
    # Other words than the prompt's are aligned with pauses, which then count as speech.
    "record in a quieter room": "record in a quieter room, and read exactly what is shown",
    "the transcript": "the prompt",
}
LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=100_000, file_bytes=1 << 30, n_files=256)


def answer(order: Mapping[str, Any], checkers: dict[Path, RecordingChecker]) -> dict[str, Any]:
    """Answer of an order; `checkers` keeps the checker of the last cache folder."""
    try:
        if order["kind"] == "prompts":
            return _prompts(float(order["minutes"]), str(order["language"]), order["text"])
        video = Path(order["video"])
        found = {"findings": _findings(video, order["text"], Path(order["cache"]), checkers)}
        return {**found, "key": content_key(video)}
    except Tts2faceError as error:
        return {"error": type(error).__name__, "message": " ".join(str(error).split())}


def _prompts(minutes: float, language: str, text: str | None) -> dict[str, Any]:
    chosen = choose_prompts(minutes, language=language, text=None if text is None else Path(text))
    return {"language": language, **prompts_answer(chosen.texts, chosen.units, chosen.running)}


def prompts_answer(texts: Sequence[str], units: Sequence[Units], running: RunningText) -> dict[str, Any]:
    """The answer about prompts, as above."""
    return {
        "prompts": [{"text": text, **_units(one)} for text, one in zip(texts, units, strict=True)],
        "running": {
            "phones": dict(running.phones),
            "triphones": {" ".join(triphone): n for triphone, n in running.triphones.items()},
        },
    }


def _units(units: Units) -> dict[str, list[str]]:
    return {"phones": sorted(set(units.phones)), "triphones": sorted({" ".join(one) for one in units.triphones})}


def _findings(
    video: Path, text: str | None, cache: Path, checkers: dict[Path, RecordingChecker]
) -> list[dict[str, str]]:
    if cache not in checkers:
        checkers.clear()
        checkers[cache] = RecordingChecker(RunOptions(cache, 1))
    cache.mkdir(parents=True, exist_ok=True)  # it may have been deleted with a recording
    (recording,) = recordings_to_check(video, text)
    return [
        {"severity": found.severity, "code": found.code, "message": _advice(found.message, video)}
        for found in checkers[cache].check(recording)
        if (found.severity, found.code) != (WARNING, OUT_OF_SYNC)  # a take is too short to tell; the build pools them
    ]


def _advice(message: str, video: Path) -> str:
    """A finding for a person who reads prompts in front of a camera."""
    for written, spoken in IN_FRONT_OF_A_CAMERA.items():
        message = message.replace(written, spoken)
    return message.replace(f"{video.parent}/", "")


def main() -> None:
    """Answer orders until standard input ends."""
    out = claim_standard_output()
    orders = received_requests()
    limit_process(LIMITS)
    checkers: dict[Path, RecordingChecker] = {}
    while True:
        order, _ = orders.get()
        out.write(json.dumps(answer(order, checkers), ensure_ascii=False).encode() + b"\n")
        out.flush()


if __name__ == "__main__":
    try:
        main()
    except BrokenPipeError:
        sys.stderr.close()
        os._exit(0)
