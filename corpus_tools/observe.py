"""A folder of recordings, observed in parallel; what was done stays in a cache, so that a second run goes on."""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from corpus_tools.observation import Observation, observed
from corpus_tools.recordings import Recording, find_recordings
from lexicon.errors import BackendError, DataError, InputError
from tts2face.video.model import find_bundle, user_cache

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Refusal:
    """A recording that cannot serve, and why."""

    name: str
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """What a folder of recordings gave, both by name."""

    kept: tuple[Observation, ...]
    refused: tuple[Refusal, ...]


@dataclass(frozen=True, slots=True)
class Effort:
    """How the work is done, which changes nothing in its result.

    ``cache`` is the folder for finished parts (the user's cache when None), ``jobs`` the number of processes (one per
    core when None), ``model`` the bundle of landmark models (found when None).
    """

    cache: Path | None = None
    jobs: int | None = None
    model: Path | None = None


def observe(recordings: Path, *, effort: Effort | None = None, on_progress: Progress | None = None) -> Observations:
    """Every recording of a folder, or the reason why not.

    Parameters
    ----------
    recordings
        A folder as `corpus_tools.recordings.find_recordings` reads it.
    on_progress
        Called with the number of recordings done and of all.

    Raises
    ------
    InputError
        The folder is missing or holds no video, or `jobs` is below 1.
    BackendError
        A package or the landmark models are missing, the cache cannot be written, or a process died.
    """
    effort = effort or Effort()
    jobs = effort.jobs or os.cpu_count() or 1
    if jobs < 1:
        raise InputError(f"jobs must be 1 or more, not {jobs}")
    found = find_recordings(recordings)
    cache = effort.cache or user_cache() / "recordings"
    try:
        cache.mkdir(parents=True, exist_ok=True)
    except OSError as refused:
        raise BackendError(f"cannot write {cache}: {refused.strerror}; choose another cache folder") from refused
    model = find_bundle(effort.model)
    outcomes: list[Observation | Refusal] = []
    for outcome in _outcomes(found, cache, model, min(jobs, len(found))):
        outcomes.append(outcome)
        if on_progress:
            on_progress(len(outcomes), len(found))
    kept = [outcome for outcome in outcomes if isinstance(outcome, Observation)]
    refused_ones = [outcome for outcome in outcomes if isinstance(outcome, Refusal)]
    return Observations(
        tuple(sorted(kept, key=lambda outcome: outcome.name)), tuple(sorted(refused_ones, key=lambda one: one.name))
    )


def _outcomes(found: tuple[Recording, ...], cache: Path, model: Path, jobs: int) -> Iterator[Observation | Refusal]:
    """Outcomes as they come, in no order."""
    if jobs == 1:
        worker = _Worker(cache, model)
        yield from map(worker.outcome, found)
        return
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_start, initargs=(cache, model))
    try:
        for future in as_completed([pool.submit(_work, together) for together in by_video(found)]):
            yield from future.result()
    except BrokenProcessPool as died:
        raise BackendError(
            "a process that read recordings died; run the command again (it goes on), with fewer jobs"
        ) from died
    finally:
        pool.shutdown(cancel_futures=True)


class _Worker:
    """Reads recordings one after the other; the networks and the acoustic model are loaded once."""

    def __init__(self, cache: Path, model: Path) -> None:
        from tts2face.speech.align import Aligner
        from tts2face.video.track import FaceTracker

        self._cache = cache
        self._tracker = FaceTracker(model)
        self._aligner = Aligner()

    def outcome(self, recording: Recording) -> Observation | Refusal:
        """The observation, or why there is none."""
        try:
            return observed(recording, self._cache, self._tracker, self._aligner)
        except DataError as reason:
            return Refusal(recording.name, str(reason))


_worker: list[_Worker] = []  # of this process; filled once by the pool


def _start(cache: Path, model: Path) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent stops the pool
    _worker.append(_Worker(cache, model))


def _work(recordings: tuple[Recording, ...]) -> list[Observation | Refusal]:
    return [_worker[0].outcome(recording) for recording in recordings]


def by_video(recordings: Sequence[Recording]) -> list[tuple[Recording, ...]]:
    """Recordings of one video together, so that one process tracks it once."""
    together: dict[Path, list[Recording]] = {}
    for recording in recordings:
        together.setdefault(recording.video, []).append(recording)
    return [tuple(group) for group in together.values()]
