"""Outlines of recorded lips."""

import numpy as np
import pytest

from lexicon.errors import InputError
from tts2face.lips.exemplar import build_exemplar_model, select_tokens
from tts2face.lips.explanation import UsedToken, explain_selection
from tts2face.lips.outlines import token_outlines
from tts2face.models.landmarks import lip_opening
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker


@pytest.fixture(scope="module")
def talker() -> Talker:
    return load_talker("grid_s1")


def outlines_of(talker: Talker, label: str) -> list[np.ndarray]:
    """Gap of the lips (mm) in the middle of a dozen recorded tokens."""
    found = []
    for utterance in talker.utterances[:60]:
        for at, phone in enumerate(utterance.phones.phones):
            if phone == label:
                start, end = utterance.phones.edges[at : at + 2]
                token = UsedToken(utterance.name, float(start), float(end), (), (), 0.0, 1.0)
                found.append(token_outlines(talker, token, 3)[1])
    return [one.inner[15, 1] - one.inner[5, 1] for one in found[:12]]


def test_open_vowels_are_higher_than_closures(talker: Talker) -> None:
    assert np.median(outlines_of(talker, "b")) < 2.0
    assert np.median(outlines_of(talker, "aɪ")) > 4.0


def test_outlines_are_those_of_the_landmarks(talker: Talker) -> None:
    utterance = talker.utterances[0]
    token = UsedToken(utterance.name, 20 / talker.fps, 20 / talker.fps, (), (), 0.0, 1.0)
    (one,) = token_outlines(talker, token, 1)
    assert one.outer.shape == one.inner.shape == (20, 2)
    face = talker.model.shapes(utterance.shape[20:21])
    eyes = np.linalg.norm(face[0, 263] - face[0, 33])
    gap = one.inner[15] - one.inner[5]  # the middles of the lower and of the upper lip
    assert np.linalg.norm(gap) == pytest.approx(float(lip_opening(face)[0] * eyes), rel=0.1)
    assert gap[1] > 0  # down is positive
    width = one.outer[10] - one.outer[0]
    np.testing.assert_allclose(width, (face[0, 291] - face[0, 61])[:2] * [1, -1], rtol=1e-4, atol=1e-4)


def test_an_explained_phone_can_be_drawn(talker: Talker) -> None:
    exemplars = build_exemplar_model(talker)
    shown = explain_selection(select_tokens(talker.utterances[3].phones, exemplars), exemplars)
    outlines = token_outlines(talker, shown[2].tokens[0])
    assert len(outlines) == 5
    assert all(np.isfinite(one.outer).all() for one in outlines)


def test_another_talker_s_recording_is_refused(talker: Talker) -> None:
    with pytest.raises(InputError, match="no recording 'nobody'"):
        token_outlines(talker, UsedToken("nobody", 0.0, 0.1, (), (), 0.0, 1.0))
