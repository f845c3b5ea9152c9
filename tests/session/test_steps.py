"""A clip is a column of steps: what a piece has after the first one stays, and edits change nothing that is kept."""

from dataclasses import replace

import numpy as np
import pytest

from tests.world import World
from tts2face.gestures.elements import ChannelEdit
from tts2face.gestures.timeline import Timeline
from tts2face.request import Request
from tts2face.session.prepared import prepare
from tts2face.session.session import Session

TEXT = Request(text="Bob may [mark here]move. [volume 0.5]Five[/volume] maps.", fps=29.97)


@pytest.fixture(scope="module")
def session(world: World) -> Session:
    return world.session(memory_mb=100)


@pytest.mark.parametrize("request_", [TEXT, Request(text="", idle=12.0, fps=29.97)], ids=["text", "idle"])
def test_speech_alone_is_the_clip_before_its_lips(session: Session, request_: Request) -> None:
    whole, spoken = list(session.stream(request_)), list(session.stream_speech(request_))
    assert len(spoken) == len(whole) > 1
    for cut, piece in zip(spoken, whole, strict=True):
        assert (cut.begin, cut.n_steps, cut.text, cut.marks) == (piece.begin, piece.n_steps, piece.text, piece.marks)
        assert cut.speech.waveform.samples.tobytes() == piece.speech.waveform.samples.tobytes()
        assert cut.speech.phones.edges.tobytes() == piece.speech.phones.edges.tobytes()
        assert cut.clip.motion.values.shape == (len(piece.clip.motion), 0)
        assert not cut.clip.head.values.any()


def test_an_edit_comes_after_what_is_kept(session: Session) -> None:
    """Gestures that were kept for the clip without the edit serve the clip with it."""
    prepared = prepare(TEXT)
    edited = replace(prepared, timeline=Timeline(edits=(ChannelEdit("yaw", ((0.0, 0.1),)),)))
    plain, moved = ([piece.clip.head.values for piece in session.stream(one)] for one in (prepared, edited))
    for before, after in zip(plain, moved, strict=True):
        np.testing.assert_allclose((after - before)[:, 1], 0.1, atol=1e-6)
        assert (after[:, [0, 2, 3, 4, 5]] == before[:, [0, 2, 3, 4, 5]]).all()
