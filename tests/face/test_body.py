"""Hair, shoulders and pupils of takes, which go on over the pieces of their clips."""

import numpy as np

from tts2face.face.body import Body
from tts2face.face.breathing import BREATH_SHAPE
from tts2face.face.pupils import PUPIL_SHAPE
from tts2face.models.lit_hair import SWING_SHAPES
from tts2face.session import performance, recording
from tts2face.session.animated_face import FaceMotion
from tts2face.types import HEAD_CHANNELS, Trajectory, Waveform

CHANNELS = ("jawOpen", BREATH_SHAPE, *SWING_SHAPES, PUPIL_SHAPE)
FPS = 25.0


def test_takes_move_the_body_whatever_the_pieces(monkeypatch) -> None:
    n = 150
    head = np.zeros((n, 6), np.float32)
    head[:, 1] = 0.3 * np.sin(np.arange(n) / 6)
    motion = FaceMotion(
        Trajectory(CHANNELS, np.zeros((n, len(CHANNELS)), np.float32), FPS), Trajectory(HEAD_CHANNELS, head, FPS)
    )
    found = []
    for most in (n, 40):
        monkeypatch.setattr(recording, "MAX_CLIP_FRAMES", most)
        clips = list(performance.take_clips(motion, Waveform(np.zeros(0, np.float32), 16_000)))
        found.append(np.concatenate([clip.motion.values for clip in clips]))
    np.testing.assert_allclose(found[0], found[1], atol=1e-5)
    moved = np.ptp(found[0], axis=0)
    assert moved[0] == 0
    assert moved[CHANNELS.index(BREATH_SHAPE)] > 0.3
    assert moved[CHANNELS.index("hairYaw")] > 0.02
    assert moved[CHANNELS.index(PUPIL_SHAPE)] > 0.1


def test_an_empty_piece_stays_empty() -> None:
    nothing = Trajectory(CHANNELS, np.zeros((0, len(CHANNELS)), np.float32), FPS)
    assert len(Body(CHANNELS, 0).move(nothing, nothing, None)) == 0  # type: ignore[arg-type]
