"""Parallel observation of a folder of recordings, with a cache from which interrupted runs continue.

Check of one recording, without building anything: what would be refused, what is weak, and what to do better.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from corpus_tools.parallel import map_unordered
from corpus_tools.recordings.folder import Recording, find_recordings, pronounce_recording, recording_notes
from corpus_tools.recordings.limits import OUT_OF_SYNC, REFUSAL, UNUSABLE, WARNING, Finding, limit_findings
from corpus_tools.recordings.observation import Observation, Timing, observe_recording
from corpus_tools.recordings.sound import MAX_UTTERANCE_S, CachedAligner
from corpus_tools.recordings.sync import corrected_timings, estimate_sync_by_video
from corpus_tools.recordings.video import CachedTracker
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError, InputError
from tts2face.types import Progress, ignore_progress
from tts2face.video.networks import find_bundle

STEPS_PER_VIDEO = 100  # of progress for each video
TRACKING_SHARE = 0.8  # of a video's work
MAX_QUOTED_REASONS = 3  # of recordings, where none could be used


@dataclass(frozen=True, slots=True)
class Refusal:
    """A refused recording and the reason; ``at`` is its position in its ``video`` in seconds."""

    name: str
    reason: str
    video: Path
    at: float


@dataclass(frozen=True, slots=True)
class QualityWarning:
    """A weakness of a kept recording."""

    name: str
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Observations and refusals of a folder of recordings, and warnings about kept ones, sorted by name.

    ``notes`` say what was chosen of transcripts, and which files are not read.
    """

    kept: tuple[Observation, ...]
    refused: tuple[Refusal, ...]
    warnings: tuple[QualityWarning, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class VideoTask:
    """The recordings of one video, which are read together so that it is tracked once."""

    recordings: tuple[Recording, ...]
    timing: Timing = Timing()  # noqa: RUF009 - frozen

    @property
    def video(self) -> Path:
        """The video."""
        return self.recordings[0].video


RecordingOutcomes = list[Observation | Refusal]
ShareCallback = Callable[[float], None]  # called with the finished share of a task


def observe(
    recordings: Path,
    *,
    is_strict: bool = False,
    run_options: RunOptions | None = None,
    on_progress: Progress = ignore_progress,
) -> Observations:
    """Observations of a folder at one frame rate with sound and picture synchronised, and reasons for refusals.

    Parameters
    ----------
    recordings
        A folder, or a video, as `corpus_tools.recordings.folder.find_recordings` reads it.
    is_strict
        Whether recordings with warnings are refused.
    on_progress
        Called with steps done and of all, `STEPS_PER_VIDEO` for each video.

    Raises
    ------
    InputError
        The folder is missing or holds no video, or `jobs` is below 1.
    BackendError
        A package or the landmark models are missing, the cache cannot be written, or a process died.
    """
    run_options = run_options or RunOptions()
    processes, cache = run_options.n_processes(), run_options.folder()
    listed = find_recordings(recordings, run_options.tier)
    tasks = group_by_video(listed)
    model = find_bundle(run_options.model)
    found: dict[Path, RecordingOutcomes] = {}
    for task, outcomes in _observe_tasks(tasks, cache, model, min(processes, len(tasks)), on_progress):
        found[task.video] = outcomes
    kept = [outcome for outcomes in found.values() for outcome in outcomes if isinstance(outcome, Observation)]
    agreed = estimate_sync_by_video(kept)
    timing = corrected_timings(kept, agreed)
    again = [replace(task, timing=timing[task.video]) for task in tasks if task.video in timing]
    for task, outcomes in _observe_tasks(again, cache, model, min(processes, len(again)), ignore_progress):
        found[task.video] = outcomes
    for video, agreement in agreed.items():
        if agreement.problem:
            found[video] = [_refuse(outcome, agreement.problem) for outcome in found[video]]
    every = [outcome for outcomes in found.values() for outcome in outcomes]
    warnings = [
        QualityWarning(item.name, message)
        for item in every
        if isinstance(item, Observation)
        for message in (*item.warnings, *agreed[item.video].warnings)
    ]
    if is_strict:
        reasons = {warning.name: warning.message for warning in reversed(warnings)}
        every = [_refuse(outcome, reasons[outcome.name]) if outcome.name in reasons else outcome for outcome in every]
        warnings = []
    return Observations(
        tuple(
            sorted((item for item in every if isinstance(item, Observation)), key=lambda observation: observation.name)
        ),
        # workers end in any order
        tuple(sorted((item for item in every if isinstance(item, Refusal)), key=lambda refusal: refusal.name)),
        tuple(sorted(warnings, key=lambda warning: warning.name)),
        recording_notes(listed),
    )


def check_any_kept(observations: Observations) -> tuple[Observation, ...]:
    """The kept observations.

    Raises
    ------
    InputError
        There are none; the message quotes the first `MAX_QUOTED_REASONS` reasons.
    """
    refused = observations.refused
    if observations.kept:
        return observations.kept
    reasons = "; ".join(f"{refusal.name}: {refusal.reason}" for refusal in refused[:MAX_QUOTED_REASONS])
    more = f"; and {len(refused) - MAX_QUOTED_REASONS} more" if len(refused) > MAX_QUOTED_REASONS else ""
    raise InputError(f"no recording could be used: {reasons}{more}")


def _refusal(recording: Recording, reason: DataError) -> Refusal:
    return Refusal(recording.name, str(reason), recording.video, sum(recording.span or (0.0, 0.0)) / 2)


def _refuse(outcome: Observation | Refusal, fault: str) -> Refusal:
    if isinstance(outcome, Refusal):
        return outcome
    return Refusal(outcome.name, fault, outcome.video, outcome.quality.cut)


def group_by_video(recordings: Sequence[Recording]) -> list[VideoTask]:
    """One task for each video."""
    together: dict[Path, list[Recording]] = {}
    for recording in recordings:
        together.setdefault(recording.video, []).append(recording)
    return [VideoTask(tuple(group)) for group in together.values()]


def _observe_tasks(
    tasks: Sequence[VideoTask], cache: Path, model: Path, jobs: int, on_progress: Progress
) -> Iterator[tuple[VideoTask, RecordingOutcomes]]:
    """Tasks with their outcomes in order of completion."""
    of = STEPS_PER_VIDEO * len(tasks)
    if jobs <= 1:
        worker = _VideoReader(cache, model)
        for number, task in enumerate(tasks):
            yield task, worker(task, _task_share_callback(on_progress, number, of))
        return
    for number, done in enumerate(map_unordered(tasks, _VideoReader, (cache, model), jobs), start=1):
        yield done
        on_progress(STEPS_PER_VIDEO * number, of)


def _task_share_callback(on_progress: Progress, number: int, of: int) -> ShareCallback:
    return lambda share: on_progress(int(STEPS_PER_VIDEO * (number + share)), of)


class _VideoReader:
    """Observer of videos that loads networks and acoustic models once."""

    def __init__(self, cache: Path, model: Path) -> None:
        self._tracker, self._aligner = CachedTracker(cache, model), CachedAligner(cache)

    def __call__(self, task: VideoTask, on_share: ShareCallback = lambda _: None) -> RecordingOutcomes:
        """An observation, or the reason for its refusal, for each utterance of a video."""
        found: RecordingOutcomes = []
        try:
            recordings = split_long_recording(task.recordings, self._aligner)
            self._tracker.track(task.video, lambda share: on_share(TRACKING_SHARE * share))
        except DataError as reason:
            recordings = ()
            found = [_refusal(recording, reason) for recording in task.recordings]
        for number, recording in enumerate(recordings, start=1):
            try:
                found.append(observe_recording(recording, self._tracker, self._aligner, task.timing))
            except DataError as reason:
                found.append(_refusal(recording, reason))
            on_share(TRACKING_SHARE + (1 - TRACKING_SHARE) * number / len(recordings))
        on_share(1.0)
        return found


def split_long_recording(recordings: tuple[Recording, ...], aligner: CachedAligner) -> tuple[Recording, ...]:
    """The recordings of one video; a recording of a whole long one is cut into utterances at pauses."""
    whole = recordings[0]
    if whole.span is not None or aligner.sound(whole.video).duration <= MAX_UTTERANCE_S:
        return recordings
    utterances = aligner.utterances(whole.video, pronounce_recording(whole))
    return tuple(
        replace(whole, name=f"{whole.name}-{number:04d}", span=span, words=words)
        for number, (span, words) in enumerate(utterances, start=1)
    )


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
        return _worst(finding for utterance in utterances for finding in self._check_utterance(utterance))

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
        stated = {finding.message for finding in found}
        if sync.problem and sync.problem not in stated:
            return (*found, Finding(REFUSAL, OUT_OF_SYNC, sync.problem))
        return (*found, *(Finding(WARNING, OUT_OF_SYNC, text) for text in sync.warnings if text not in stated))


def check_recording(
    video: Path, transcript: str | Path | None = None, *, run_options: RunOptions | None = None
) -> tuple[Finding, ...]:
    """Findings about one video and what is said in it: a text, a file, or what lies beside the video.

    For several recordings, `RecordingChecker` loads the networks once.
    """
    recordings = recordings_to_check(video, transcript, (run_options or RunOptions()).tier)
    checker = RecordingChecker(run_options)
    return _worst(finding for recording in recordings for finding in checker.check(recording))


def recordings_to_check(
    recordings: Path, transcript: str | Path | None = None, tier: str | None = None
) -> tuple[Recording, ...]:
    """The recordings of a folder or a video; with a transcript, the whole video as one.

    Raises
    ------
    InputError
        There is no such folder or video.
    """
    found = find_recordings(recordings, tier)
    if transcript is None:
        return found
    return (replace(found[0], name=found[0].video.stem, transcript=transcript, span=None),)


def _worst(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """The first refusal of each code, then the first warning of each other code."""
    found: dict[str, Finding] = {}
    # refusals first: of one code the worse finding stays
    for finding in sorted(findings, key=lambda found: found.severity != REFUSAL):
        found.setdefault(finding.code, finding)
    return tuple(found.values())
