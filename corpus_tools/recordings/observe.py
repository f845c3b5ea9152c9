"""A folder of recordings, observed in parallel; what was done stays in a cache, so that a second run goes on."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from corpus_tools.process_pool import each_done
from corpus_tools.recordings.audio_video_sync import agreements, timings
from corpus_tools.recordings.corpus_audio import LONGEST_UTTERANCE_S, Ears
from corpus_tools.recordings.corpus_video import Eyes
from corpus_tools.recordings.folder import Recording, find_recordings, spoken_words
from corpus_tools.recordings.observation import Observation, Timing, observed
from corpus_tools.run_options import Effort, Progress
from lexicon.errors import DataError, InputError
from tts2face.video.landmark_models import find_bundle

STEPS = 100  # of progress for each video
WATCHING = 0.8  # of a video's work
REASONS_SHOWN = 3  # of recordings, where none could be used


@dataclass(frozen=True, slots=True)
class Refusal:
    """A recording that cannot serve, and why; ``at`` are seconds of its ``video`` in which it lies."""

    name: str
    reason: str
    video: Path
    at: float


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """What a folder of recordings gave, both by name."""

    kept: tuple[Observation, ...]
    refused: tuple[Refusal, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """The recordings of one video, read together so that it is watched once."""

    recordings: tuple[Recording, ...]
    timing: Timing = Timing()  # noqa: RUF009 - frozen

    @property
    def video(self) -> Path:
        """The video."""
        return self.recordings[0].video


Outcomes = list[Observation | Refusal]
Tell = Callable[[float], None]  # told the share of a task that is done


def observe(recordings: Path, *, effort: Effort | None = None, on_progress: Progress | None = None) -> Observations:
    """Every recording of a folder, or the reason why not; all at one frame rate, sound and picture together.

    Parameters
    ----------
    recordings
        A folder, or a video, as `corpus_tools.recordings.folder.find_recordings` reads it.
    on_progress
        Called with steps done and of all, `STEPS` for each video.

    Raises
    ------
    InputError
        The folder is missing or holds no video, or `jobs` is below 1.
    BackendError
        A package or the landmark models are missing, the cache cannot be written, or a process died.
    """
    effort = effort or Effort()
    processes, cache = effort.processes(), effort.folder()
    tasks = by_video(find_recordings(recordings))
    model = find_bundle(effort.model)
    found: dict[Path, Outcomes] = {}
    for task, outcomes in _done(tasks, cache, model, min(processes, len(tasks)), on_progress):
        found[task.video] = outcomes
    kept = _kept(found)
    agreed = agreements(kept)
    timing = timings(kept, agreed)
    again = [replace(task, timing=timing[task.video]) for task in tasks if task.video in timing]
    for task, outcomes in _done(again, cache, model, min(processes, len(again)), None):
        found[task.video] = outcomes
    for video, agreement in agreed.items():
        if agreement.fault:
            found[video] = [_out_of_step(outcome, agreement.fault) for outcome in found[video]]
    every = [outcome for outcomes in found.values() for outcome in outcomes]
    return Observations(
        tuple(sorted((one for one in every if isinstance(one, Observation)), key=lambda one: one.name)),
        tuple(sorted((one for one in every if isinstance(one, Refusal)), key=lambda one: one.name)),
    )


def require_kept(observations: Observations) -> tuple[Observation, ...]:
    """The recordings that were kept.

    Raises
    ------
    InputError
        None was; the message says why the first `REASONS_SHOWN` were refused.
    """
    refused = observations.refused
    if observations.kept:
        return observations.kept
    reasons = "; ".join(f"{refusal.name}: {refusal.reason}" for refusal in refused[:REASONS_SHOWN])
    more = f"; and {len(refused) - REASONS_SHOWN} more" if len(refused) > REASONS_SHOWN else ""
    raise InputError(f"no recording could be used: {reasons}{more}")


def _kept(found: Mapping[Path, Outcomes]) -> list[Observation]:
    return [one for outcomes in found.values() for one in outcomes if isinstance(one, Observation)]


def _refusal(recording: Recording, reason: DataError) -> Refusal:
    return Refusal(recording.name, str(reason), recording.video, sum(recording.span or (0.0, 0.0)) / 2)


def _out_of_step(outcome: Observation | Refusal, fault: str) -> Refusal:
    if isinstance(outcome, Refusal):
        return outcome
    return Refusal(outcome.name, fault, outcome.video, outcome.quality.cut)


def by_video(recordings: Sequence[Recording]) -> list[Task]:
    """Recordings of one video together."""
    together: dict[Path, list[Recording]] = {}
    for recording in recordings:
        together.setdefault(recording.video, []).append(recording)
    return [Task(tuple(group)) for group in together.values()]


def _done(
    tasks: Sequence[Task], cache: Path, model: Path, jobs: int, on_progress: Progress | None
) -> Iterator[tuple[Task, Outcomes]]:
    """Tasks with their outcomes as they come, in no order."""
    tell = on_progress or (lambda done, of: None)
    of = STEPS * len(tasks)
    if jobs <= 1:
        worker = _Worker(cache, model)
        for number, task in enumerate(tasks):
            yield task, worker.outcomes(task, _share_of(tell, number, of))
        return
    for number, done in enumerate(each_done(tasks, _work, _start, (cache, model), jobs), start=1):
        yield done
        tell(STEPS * number, of)


def _share_of(tell: Progress, number: int, of: int) -> Tell:
    return lambda share: tell(int(STEPS * (number + share)), of)


class _Worker:
    """Reads videos one after the other; the networks and the acoustic models are loaded once."""

    def __init__(self, cache: Path, model: Path) -> None:
        self._eyes, self._ears = Eyes(cache, model), Ears(cache)

    def outcomes(self, task: Task, tell: Tell) -> Outcomes:
        """An observation, or why there is none, for each utterance of a video."""
        found: Outcomes = []
        try:
            recordings = self._utterances(task.recordings)
            self._eyes.watched(task.video, lambda share: tell(WATCHING * share))
        except DataError as reason:
            recordings = ()
            found = [_refusal(recording, reason) for recording in task.recordings]
        for number, recording in enumerate(recordings, start=1):
            try:
                found.append(observed(recording, self._eyes, self._ears, task.timing))
            except DataError as reason:
                found.append(_refusal(recording, reason))
            tell(WATCHING + (1 - WATCHING) * number / len(recordings))
        tell(1.0)
        return found

    def _utterances(self, recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
        """The recordings; where one takes the whole of a long video, its utterances, cut at pauses."""
        whole = recordings[0]
        if whole.span is not None or self._ears.sound(whole.video).duration <= LONGEST_UTTERANCE_S:
            return recordings
        said = self._ears.utterances(whole.video, spoken_words(whole))
        return tuple(
            replace(whole, name=f"{whole.name}-{number:04d}", span=span, words=words)
            for number, (span, words) in enumerate(said, start=1)
        )


_worker: list[_Worker] = []  # of this process; filled once by the pool


def _start(cache: Path, model: Path) -> None:
    _worker.append(_Worker(cache, model))


def _work(task: Task) -> Outcomes:
    return _worker[0].outcomes(task, lambda share: None)
