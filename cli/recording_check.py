"""``tts2face corpus check``: what is wrong or weak about recordings, before anything is built."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cli.flags import Cache, Model
from cli.landmark_model import Yes
from lexicon.errors import InputError


def check(
    recordings: Annotated[Path, Parameter(help="Folder of videos, or one video, with transcripts beside them.")],
    /,
    *,
    text: Annotated[str | None, Parameter(help="What is said in one video, in place of a transcript.")] = None,
    cache: Cache = None,
    model: Model = None,
    yes: Yes = False,
) -> None:
    """Check recordings for `corpus build`, one by one: light, sharpness, sound, words, and what to do better."""
    del yes  # read where the model is missing
    if text is not None and recordings.is_dir():
        raise InputError("--text belongs to one video, not to a folder; write transcripts beside the videos")
    from corpus_tools.recordings.check_recording import RecordingChecker, recordings_to_check
    from corpus_tools.run_options import RunOptions

    found = recordings_to_check(recordings, text)
    checker = RecordingChecker(RunOptions(cache, None, model))
    for recording in found:
        findings = checker.check(recording)
        for finding in findings:
            print(f"{recording.name}: {finding.severity}: {finding.message}")  # noqa: T201 - the result
        if not findings:
            print(f"{recording.name}: good")  # noqa: T201 - the result
