"""Speech of every shipped person: lips close, and the lower lip touches the teeth."""

import numpy as np
import pytest

from tests.face.people import DRAWN, PEOPLE, load_plain
from tests.lips.retargeting.test_articulation import Spoken, tooth_distance
from tests.lips.retargeting.test_articulation import sequence as articulated
from tests.lips.retargeting.test_lip_closure import CLOSED_MM, FPS, TEXTS, gaps_of, middles, sequence, speak
from tts2face.face.lip_constraints import build_lip_constraints
from tts2face.lips.exemplar import ExemplarModel
from tts2face.models.talker import Talker


@pytest.mark.parametrize(("name", "person"), PEOPLE)
def test_bilabials_close(name: str, person: str | None, talker: Talker, exemplars: ExemplarModel) -> None:
    """Up to a gap that landmarks have at rest, where it is larger than contacts can close."""
    face = load_plain(name, person)
    mouth = build_lip_constraints(face)
    phones = sequence(TEXTS[0], 0.07)
    gaps = gaps_of(face, speak(face, (talker, exemplars), phones, 1.5, FPS).values)[middles(phones, FPS)]
    at_rest = gaps_of(face, np.zeros((1, mouth.gaps.shape[1]), np.float32))[0]
    assert (gaps <= np.maximum(at_rest - 0.5, CLOSED_MM)).all()


@pytest.mark.parametrize(("name", "person"), [one for one in PEOPLE if one.id not in DRAWN])
def test_the_lower_lip_touches_the_upper_incisors(
    name: str, person: str | None, talker: Talker, exemplars: ExemplarModel
) -> None:
    face = load_plain(name, person)
    spoken = Spoken(face, talker, exemplars, articulated("s f i n v ɑ f u"))
    for at in spoken.middles("f", "v"):
        assert tooth_distance(face, spoken.clear.values[at]) <= 0.5
        assert tooth_distance(face, spoken.recorded.values[at]) <= 0.5
    assert spoken.widths(spoken.clear)[spoken.middles("u")].mean() <= 0.87
