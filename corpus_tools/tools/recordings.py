"""Prompts and checks of takes for a recording page.

``prompts`` with ``minutes``, ``language`` and ``text``, a path or null, gives ``prompts``, objects with ``text``,
``phones`` and ``triphones``, and ``running``, the counts of ``phones`` and ``triphones`` in running text; a triphone is
its three visemes, joined by spaces. ``check`` with ``video``, ``text``, ``cache`` gives ``findings`` with ``severity``,
``code`` and ``message``, and the ``key`` with which the names of the take's files in the cache folder begin. The
networks that it needs stay loaded.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from corpus_tools.prompts.coverage import RunningText, Units
from corpus_tools.prompts.prompts import choose_prompts
from corpus_tools.recordings.limits import OUT_OF_SYNC, WARNING
from corpus_tools.recordings.observe import RecordingChecker, recordings_to_check
from corpus_tools.recordings.video import content_key
from corpus_tools.run_options import RunOptions
from tts2face.processes.child import Call, Handler

IN_FRONT_OF_A_CAMERA = {  # parts of findings, and what a person can do who is just recording
    "correct the words": "read exactly what is shown",
    "check the transcript": "read exactly what is shown",
    "give the original sound or record it again": "keep the mouth in view and read it again",
    "cut the video": "stay in the picture",
    # Other words than the prompt's are aligned with pauses, which then count as speech.
    "record in a quieter room": "record in a quieter room, and read exactly what is shown",
    "the transcript": "the prompt",
}


def _prompts(call: Call) -> dict[str, Any]:
    asked = call.content
    text = None if asked["text"] is None else Path(asked["text"])
    chosen = choose_prompts(float(asked["minutes"]), language=str(asked["language"]), text=text)
    return {"language": asked["language"], **prompts_answer(chosen.texts, chosen.units, chosen.running)}


def _check(call: Call) -> dict[str, Any]:
    video = Path(call.content["video"])
    found = {"findings": _findings(video, call.content["text"], Path(call.content["cache"]))}
    return {**found, "key": content_key(video)}


@lru_cache(maxsize=1)
def _checker(cache: Path) -> RecordingChecker:
    return RecordingChecker(RunOptions(cache, 1))


def prompts_answer(texts: Sequence[str], units: Sequence[Units], running: RunningText) -> dict[str, Any]:
    """The answer about prompts, as above."""
    return {
        "prompts": [
            {
                "text": text,
                "phones": sorted(set(unit.phones)),
                "triphones": sorted({" ".join(triphone) for triphone in unit.triphones}),
            }
            for text, unit in zip(texts, units, strict=True)
        ],
        "running": {
            "phones": dict(running.phones),
            "triphones": {" ".join(triphone): n for triphone, n in running.triphones.items()},
        },
    }


def _findings(video: Path, text: str | None, cache: Path) -> list[dict[str, str]]:
    cache.mkdir(parents=True, exist_ok=True)  # it may have been deleted with a recording
    (recording,) = recordings_to_check(video, text)
    return [
        {"severity": found.severity, "code": found.code, "message": _advice(found.message, video)}
        for found in _checker(cache).check(recording)
        if (found.severity, found.code) != (WARNING, OUT_OF_SYNC)  # a take is too short to tell; the build pools them
    ]


def _advice(message: str, video: Path) -> str:
    """A finding for a person who reads prompts in front of a camera."""
    for written, spoken in IN_FRONT_OF_A_CAMERA.items():
        message = message.replace(written, spoken)
    return message.replace(f"{video.parent}/", "")


HANDLERS: Mapping[str, Handler] = MappingProxyType({"prompts": _prompts, "check": _check})
