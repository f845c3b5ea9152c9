"""What a stream of sentences holds does not grow with their number."""

import gc

from tts2face.models.face_loading import load_face
from tts2face.models.talker_file import load_talker
from tts2face.request import Request
from tts2face.session.session import Session
from tts2face.types import Clip, Speech, Trajectory, Waveform


def n_alive() -> int:
    gc.collect()
    return sum(isinstance(thing, Clip | Speech | Trajectory | Waveform) for thing in gc.get_objects())


def test_clips_that_were_taken_are_forgotten() -> None:
    ready = Session(load_talker("grid_s1"), load_face("head"))
    before, counts = n_alive(), []
    for _ in ready.stream(Request(text="Bob may. " * 8, voice="espeak")):
        counts.append(n_alive() - before)
    assert len(counts) == 8
    assert counts[-1] <= counts[-2] == counts[1]  # between two pieces there is what is left of the first
    assert n_alive() <= before + 6  # the last piece's, which the loop's variable holds
