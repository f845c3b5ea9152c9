"""The talker that is shipped: its size, its licence, and that its lips do what speech needs."""

from pathlib import Path

import numpy as np

import tts2face
from corpus_tools.describe_talker import describe
from corpus_tools.training.train_talker import CLOSED_GAP
from tts2face.models.landmarks import lip_opening
from tts2face.models.talker_file import load_talker

PATH = Path(tts2face.__file__).parent / "data" / "grid_s1.talker"


def test_the_starter_talker_is_small_and_has_its_provenance():
    assert PATH.stat().st_size <= 8e6
    metadata = load_talker("grid_s1").metadata
    assert metadata["licence"] == "CC BY 4.0"
    assert "Cooke" in metadata["attribution"]
    assert "3625687" in metadata["sources"]
    assert metadata["command"].startswith("tts2face corpus build")
    assert "no image and no sound" in metadata["content"]


def test_it_holds_the_corpus():
    described = describe(load_talker("grid_s1"))
    assert described.n_utterances == 804
    assert 38 < described.minutes < 42
    assert described.n_triphones > 600
    assert 20 <= described.n_speech <= 30


def test_its_lips_close_at_rest_and_at_most_bilabials():
    talker = load_talker("grid_s1")
    assert lip_opening(talker.model.shapes(talker.model.rest[None]))[0] < CLOSED_GAP
    least = []
    for utterance in talker.utterances[::8]:
        shapes = talker.model.shapes(utterance.shape)
        times, gap = np.arange(len(shapes)) / talker.fps, lip_opening(shapes)
        for phone, start, end in zip(
            utterance.phones.phones, utterance.phones.edges, utterance.phones.edges[1:], strict=False
        ):
            inside = (times >= start - 0.03) & (times <= end + 0.03)
            if phone in ("p", "b", "m") and inside.any():
                least.append(gap[inside].min())
    assert np.mean(np.array(least) < 1.5 * CLOSED_GAP) > 0.9
