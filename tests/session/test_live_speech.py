"""Live speech that is interrupted between its steps, and the length of the steps."""

import time
from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest

import tts2face
from tests.tones import RATE_HZ, WorldVoices
from tests.world import World
from tts2face.session.live.speech import LiveSpeech
from tts2face.session.speech_stream import Piece
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import SOUND_RATE, concatenate_clips

LONG = "the garden behind the old house near the river had been green for years and nobody knew it " * 3
MAX_SHARE = 0.3  # of the time after the voice in one step; 0.48 before gestures gave way between features


class InterruptedSpeechError(Exception):
    """Raised where live speech yields."""


class Turns:
    """Runs models and ends of steps as a service does; notes the seconds of computing before each.

    ``interrupt_at`` is the number of the run that raises; None: none.
    """

    def __init__(self) -> None:
        self.seconds: list[float] = []
        self.interrupt_at: int | None = None
        self._began = time.thread_time()

    def run(self, compute: Callable[[], Any], _: Callable[[], None]) -> Any:
        self.seconds.append(time.thread_time() - self._began)
        found = compute()
        self._began = time.thread_time()
        if self.interrupt_at == len(self.seconds) - 1:
            raise InterruptedSpeechError
        return found

    def give(self) -> None:
        """The end of a step."""
        self.run(lambda: None, lambda: None)

    def restart(self, interrupt_at: int | None = None) -> None:
        self.seconds, self.interrupt_at = [], interrupt_at


@pytest.fixture(scope="module")
def turns() -> Turns:
    return Turns()


@pytest.fixture(scope="module")
def session(world: World, turns: Turns) -> tts2face.Session:
    return world.session(voices=WorldVoices(run=turns.run, yield_turn=turns.give))


def continue_idly(live: LiveSpeech) -> Piece:
    (piece,) = live.idle(1.0)
    return piece


@pytest.mark.parametrize("gestures", ["fields", "noise"])
def test_an_interrupted_sentence_does_not_change_what_follows(
    session: tts2face.Session, turns: Turns, gestures: str
) -> None:
    """Wherever it is interrupted: the gestures continue from the last piece that was made."""
    list(session.live(gestures=gestures).say("Hi."))  # makes the fields, for which the first one waits
    turns.restart()
    live = session.live(gestures=gestures)
    list(live.say("Hi."))
    n_runs = len(turns.seconds)
    expected = continue_idly(live)
    for number in count():
        turns.restart()
        live = session.live(gestures=gestures)
        list(live.say("Hi."))
        turns.restart(number)
        try:
            list(live.say("Hi."))
        except InterruptedSpeechError:
            turns.restart()
        else:
            break
        found = continue_idly(live)
        assert found.begin == expected.begin
        np.testing.assert_array_equal(found.clip.motion.values, expected.clip.motion.values)
        np.testing.assert_array_equal(found.clip.head.values, expected.clip.head.values)
    turns.restart()
    assert number > n_runs // 2  # gestures, drawn in a thread, are waited for in more steps or fewer


def test_the_steps_of_a_long_sentence_are_short(turns: Turns) -> None:
    """A service reads `cancel` between them. The alignment, which it runs elsewhere, is not counted."""
    live = tts2face.Session(face="head", voices=VoicePool(run=turns.run, yield_turn=turns.give)).live()
    list(live.say(LONG))  # compiles and loads
    shares = []
    for _ in range(3):  # other processes make single steps longer
        turns.restart()
        begin = time.thread_time()
        pieces = list(live.say(LONG))
        assert time.thread_time() - begin > 0.1
        after_voice = turns.seconds[-(len(turns.seconds) // len(pieces)) + 3 :]
        shares.append(max(after_voice) / sum(after_voice))
    assert min(shares) < MAX_SHARE, shares


def test_options_of_speech_hold_in_live_speech_and_not_in_its_silence(session: tts2face.Session, turns: Turns) -> None:
    turns.restart()
    live = session.live(articulation="natural", rate=1.5, volume=0.5)
    (spoken,) = live.say("We may.")
    assert continue_idly(live).begin == pytest.approx(spoken.clip.motion.duration)
    (plain,) = session.live(rate=1.5, volume=0.5).say("We may.")
    assert len(spoken.clip.motion) == len(plain.clip.motion)
    assert not np.array_equal(spoken.clip.motion.values, plain.clip.motion.values)


def test_pieces_have_one_sound_rate_and_idle_time_may_be_one_frame(session: tts2face.Session, turns: Turns) -> None:
    """So they are one clip; without a rate of their own, speech has that of its voice."""
    turns.restart()
    live = session.live()
    pieces = [*live.idle(1 / 30), *live.say("We may."), *live.idle(1 / 30)]
    assert [len(piece.clip.motion) for piece in pieces[::2]] == [1, 1]
    whole = concatenate_clips([piece.clip for piece in pieces])
    assert whole.speech.waveform.rate == SOUND_RATE
    (plain,) = session.live(sound_rate=None).say("We may.")
    assert plain.clip.speech.waveform.rate == RATE_HZ
    assert len(plain.clip.motion) == len(pieces[1].clip.motion)
