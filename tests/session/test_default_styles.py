"""A talker's own face keeps its own pose and its expression at rest; heads are shown with a friendly one."""

import numpy as np
import pytest

from tests.golden.requests import starter_with_pictures
from tts2face.models.palette import EXPRESSIONS
from tts2face.session.session import Session
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import Clip

TEXT = "Bob may move."


@pytest.fixture(scope="module")
def own(voices: VoicePool) -> Session:
    return Session(starter_with_pictures(), "self", voices=voices)


def expressions(clip: Clip) -> np.ndarray:
    return clip.motion.columns(EXPRESSIONS)


def test_an_own_face_is_not_turned_out_of_its_video(own: Session) -> None:
    for style in (None, "exaggerated"):
        assert not own.clip(TEXT, style=style).head.values.any()


def test_an_own_face_keeps_its_expression_at_rest_unless_a_style_is_requested(own: Session) -> None:
    plain, measured, neutral = (
        expressions(own.clip(TEXT, style=style)) for style in (None, "expression=measured", "neutral")
    )
    np.testing.assert_array_equal(plain, measured)
    happy = EXPRESSIONS.index("happy")
    assert plain[:, happy].max() < 0.03
    assert neutral[:, happy].mean() > 0.1


def test_a_head_is_friendly_at_rest_with_closed_lips(shipped: Session) -> None:
    clips = [shipped.clip("", idle=4.0, style=style) for style in (None, "measured")]
    smiles = [clip.motion.columns(["mouthSmileLeft", "mouthSmileRight"]) for clip in clips]
    assert 0.08 < smiles[0][-1].min() < 0.3
    assert smiles[1].max() < 0.05
    brows = clips[0].motion.columns(["browDownLeft", "browDownRight"])
    assert brows.mean() < 0.02
