"""Tasks in threads that take turns, and alignment in another process."""

import threading
import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest

from lexicon.errors import BackendError, DataError, InputError
from tts2face.service.synthesis.messages import Wait
from tts2face.service.synthesis.remote_aligner import RemoteAligner
from tts2face.service.synthesis.scheduler import Step
from tts2face.service.synthesis.turns import InterruptedTaskError, OneAtATime, TurnSteps, wait_elsewhere
from tts2face.speech.forced_alignment import Aligner
from tts2face.types import Chunk
from tts2face.voice.loading import load_voice

WAIT_S = 60.0


class Elsewhere:
    """Work that another process would do: it ends when the test lets it, or when it is abandoned."""

    def __init__(self) -> None:
        self.end, self.woken = threading.Event(), threading.Event()
        self.is_abandoned = False

    def wait(self) -> int:
        assert self.end.wait(WAIT_S)
        if self.is_abandoned:
            raise BackendError("abandoned")
        return 7

    def abandon(self) -> None:
        self.is_abandoned = True
        self.end.set()


@pytest.fixture
def elsewhere() -> Elsewhere:
    return Elsewhere()


def turns(elsewhere: Elsewhere, make: Callable[[], Iterator[Step]]) -> TurnSteps:
    return TurnSteps(make, elsewhere.woken.set)


def waits(elsewhere: Elsewhere, released: list[str]) -> Iterator[Step]:
    try:
        yield Chunk(b"before")
        try:
            number = wait_elsewhere(elsewhere.wait, elsewhere.abandon)
        except InterruptedTaskError:
            yield Chunk(b"interrupted")
        else:
            yield Chunk(b"%d" % number)
    finally:
        released.append("all")


def test_the_steps_are_those_of_the_task(elsewhere: Elsewhere) -> None:
    assert [step.content for step in turns(elsewhere, lambda: iter([Chunk(b"1"), Chunk(b"2")]))] == [b"1", b"2"]  # type: ignore[union-attr]


def test_an_error_of_the_task_is_raised(elsewhere: Elsewhere) -> None:
    def fail() -> Iterator[Step]:
        raise InputError("no such voice")

    with pytest.raises(InputError, match="no such voice"):
        next(turns(elsewhere, fail))


def test_others_have_turns_while_a_task_waits(elsewhere: Elsewhere) -> None:
    steps = turns(elsewhere, lambda: waits(elsewhere, []))
    assert next(steps) == Chunk(b"before")
    assert next(steps) == Wait()
    assert next(steps) == Wait()  # a turn that comes too early does not block
    assert not elsewhere.woken.is_set()
    elsewhere.end.set()
    assert elsewhere.woken.wait(WAIT_S)
    assert next(steps) == Chunk(b"7")
    assert list(steps) == []


@pytest.mark.parametrize("n_steps", [0, 1, 2])
def test_a_cancelled_task_releases_what_it_holds(elsewhere: Elsewhere, n_steps: int) -> None:
    released: list[str] = []
    steps = turns(elsewhere, lambda: waits(elsewhere, released))
    for _ in range(n_steps):
        next(steps)
    steps.close()
    assert released == (["all"] if n_steps else [])
    assert elsewhere.is_abandoned == (n_steps == 2)
    assert list(steps) == []


def test_an_interrupted_task_goes_on(elsewhere: Elsewhere) -> None:
    steps = turns(elsewhere, lambda: waits(elsewhere, []))
    steps.interrupt()  # nothing to interrupt yet
    assert next(steps) == Chunk(b"before")
    assert next(steps) == Wait()
    steps.interrupt()
    assert elsewhere.woken.wait(WAIT_S)
    assert next(steps) == Chunk(b"interrupted")
    assert list(steps) == []


def test_a_task_is_interrupted_before_its_turn_after_a_wait(elsewhere: Elsewhere) -> None:
    """As between two steps of a piece, where the wait is over at once."""
    steps = turns(elsewhere, lambda: waits(elsewhere, []))
    assert next(steps) == Chunk(b"before")
    assert next(steps) == Wait()
    elsewhere.end.set()
    assert elsewhere.woken.wait(WAIT_S)
    steps.interrupt()
    assert next(steps) == Chunk(b"interrupted")
    assert not elsewhere.is_abandoned


def test_without_turns_a_wait_is_a_wait(elsewhere: Elsewhere) -> None:
    elsewhere.end.set()
    assert wait_elsewhere(elsewhere.wait, elsewhere.abandon) == 7


@pytest.fixture
def aligner() -> Iterator[RemoteAligner]:
    made = RemoteAligner()
    yield made
    made.close()


WORDS = [("Bob", [("b", "ɑ", "b")]), ("may", [("m", "eɪ")]), ("read.", [("ɹ", "i", "d")])]


def test_another_process_aligns_as_this_one(aligner: RemoteAligner) -> None:
    sound = load_voice("heart", "en-us").speak("Bob may read.").waveform
    found, expected = aligner.align(sound, WORDS), Aligner().align(sound, WORDS)
    assert found.phones.phones == expected.phones.phones
    np.testing.assert_array_equal(found.phones.edges, expected.phones.edges)
    np.testing.assert_array_equal(found.scores, expected.scores)
    assert (found.words, found.confidence) == (expected.words, expected.confidence)
    with pytest.raises(DataError, match="there is no word to align"):
        aligner.align(sound, [])


def test_a_cancelled_alignment_leaves_the_next_one_alone(aligner: RemoteAligner) -> None:
    sound = load_voice("heart", "en-us").speak("Bob may read.").waveform
    expected = aligner.align(sound, WORDS).phones.edges
    woken = threading.Event()
    for _ in range(3):

        def align() -> Iterator[Step]:
            yield Chunk(str(aligner.align(sound, WORDS)).encode())

        steps = TurnSteps(align, woken.set)
        assert next(steps) == Wait()
        steps.close()
    np.testing.assert_array_equal(aligner.align(sound, WORDS).phones.edges, expected)


def test_alignments_may_be_cancelled_at_any_time(aligner: RemoteAligner) -> None:
    """Before the process has read the sentence, in the middle, and when it is done."""
    sound = load_voice("heart", "en-us").speak("Bob may read.").waveform
    expected = aligner.align(sound, WORDS).phones.edges
    begin = time.monotonic()
    aligner.align(sound, WORDS)
    takes_s = time.monotonic() - begin
    for share in np.linspace(0.0, 1.3, 14):
        steps = TurnSteps(lambda: iter([Chunk(str(aligner.align(sound, WORDS)).encode())]), lambda: None)
        assert next(steps) == Wait()
        time.sleep(share * takes_s)
        steps.close()
        np.testing.assert_array_equal(aligner.align(sound, WORDS).phones.edges, expected)


def test_tasks_run_models_one_after_another(elsewhere: Elsewhere) -> None:
    run = OneAtATime()
    order: list[int] = []

    def task(number: int) -> Iterator[Step]:
        run(lambda: (order.append(number), elsewhere.end.wait(WAIT_S)), lambda: None)
        yield Chunk(b"%d" % number)

    first, second = (TurnSteps(partial(task, number), elsewhere.woken.set) for number in (1, 2))
    assert next(first) == Wait()
    assert next(second) == Wait()
    second.close()  # while it waits for the first one
    assert order == [1]
    elsewhere.end.set()
    assert elsewhere.woken.wait(WAIT_S)
    while (step := next(first)) == Wait():
        pass
    assert step == Chunk(b"1")


def test_a_process_that_ended_is_started_again(aligner: RemoteAligner) -> None:
    sound = load_voice("heart", "en-us").speak("Bob may read.").waveform
    expected = aligner.align(sound, WORDS).phones.edges
    assert aligner._child is not None
    aligner._child.kill()
    aligner._child.wait()
    np.testing.assert_array_equal(aligner.align(sound, WORDS).phones.edges, expected)
