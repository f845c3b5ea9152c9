"""Check of one recording, without building anything: what would be refused, what is weak, and what to do better."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from corpus_tools.recordings.audio_video_sync import estimate_sync_by_video
from corpus_tools.recordings.corpus_audio import CachedAligner
from corpus_tools.recordings.corpus_video import CachedTracker
from corpus_tools.recordings.folder import Recording, find_recordings
from corpus_tools.recordings.limits import OUT_OF_SYNC, REFUSAL, UNUSABLE, WARNING, Finding, limit_findings
from corpus_tools.recordings.observation import Timing, observe_recording
from corpus_tools.recordings.observe import split_long_recording
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError
from tts2face.video.landmark_models import find_bundle


class RecordingChecker:
    """Checker of recordings; networks are loaded on first use and kept. Results are cached for `corpus build`.

    Raises
    ------
    BackendError
        The landmark models are missing.
    """

    def __init__(self, run_options: RunOptions | None = None) -> None:
        options = run_options or RunOptions()
        cache = options.folder()
        self._tracker, self._aligner = CachedTracker(cache, find_bundle(options.model)), CachedAligner(cache)

    def check(self, recording: Recording) -> tuple[Finding, ...]:
        """Findings about a recording, refusals first, then in the order of the limits; empty if it is good.

        Of a long recording, which is cut into utterances, the worst finding of each kind.
        """
        try:
            utterances = split_long_recording((recording,), self._aligner)
        except DataError as reason:
            return (Finding(REFUSAL, UNUSABLE, str(reason)),)
        return _worst(finding for one in utterances for finding in self._check_utterance(one))

    def _check_utterance(self, recording: Recording) -> tuple[Finding, ...]:
        measured: dict[str, float] = {}

        def judge(measures: Mapping[str, float]) -> None:
            measured.update(measures)

        try:
            seen = observe_recording(recording, self._tracker, self._aligner, Timing(), judge=judge)
        except DataError as reason:
            return (*limit_findings(measured), Finding(REFUSAL, UNUSABLE, str(reason)))
        sync = estimate_sync_by_video([seen])[seen.video]
        found = limit_findings(measured | sync.measures)
        told = {finding.message for finding in found}
        if sync.problem and sync.problem not in told:
            return (*found, Finding(REFUSAL, OUT_OF_SYNC, sync.problem))
        return (*found, *(Finding(WARNING, OUT_OF_SYNC, text) for text in sync.warnings if text not in told))


def check_recording(
    video: Path, transcript: str | Path | None = None, *, run_options: RunOptions | None = None
) -> tuple[Finding, ...]:
    """Findings about one video and what is said in it: a text, a file, or what lies beside the video.

    For several recordings, `RecordingChecker` loads the networks once.

    Raises
    ------
    InputError
        There is no such video.
    BackendError
        A package or the landmark models are missing.
    """
    recordings = recordings_to_check(video, transcript)
    checker = RecordingChecker(run_options)
    return _worst(finding for one in recordings for finding in checker.check(one))


def recordings_to_check(recordings: Path, transcript: str | Path | None = None) -> tuple[Recording, ...]:
    """The recordings of a folder or a video; with a transcript, the whole video as one.

    Raises
    ------
    InputError
        There is no such folder or video.
    """
    found = find_recordings(recordings)
    if transcript is None:
        return found
    return (replace(found[0], name=found[0].video.stem, transcript=transcript, span=None),)


def _worst(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """The first refusal of each code, then the first warning of each other code."""
    found: dict[str, Finding] = {}
    for finding in sorted(findings, key=lambda one: one.severity != REFUSAL):
        found.setdefault(finding.code, finding)
    return tuple(found.values())
