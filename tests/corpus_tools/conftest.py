"""A made corpus with a known answer, and a small folder of takes."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.recordings.observation import Observation, Quality
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tests.rendered_takes import copy_takes
from tts2face.models.landmarks import MOUTH_REGION, N_LANDMARKS

CLIPS = ("bbaf2n", "bbaf3s", "bbaf5a")
FPS = 25.0


@pytest.fixture
def few_takes(tmp_path: Path, takes: Path) -> Path:
    """Three takes in the layout of GRID."""
    return copy_takes(takes, CLIPS, tmp_path / "recordings")


def made_observation(name: str, seed: int, n_frames: int = 60) -> Observation:
    """Faces that move along two known directions of the mouth and one of the rest, and lips that start closed."""
    generator = np.random.default_rng(seed)
    mean = np.random.default_rng(99).normal(0, 40, (N_LANDMARKS, 3))
    mean[33], mean[263] = (-44.5, 0, 0), (44.5, 0, 0)
    mean[14] = mean[13]
    directions = known_directions()
    amounts = generator.normal(0, (9.0, 4.0, 3.0), (n_frames, 3))
    amounts[:20] = 0
    landmarks = mean + np.einsum("tk,klc->tlc", amounts, directions)
    head = generator.normal((0.3, -0.2, 0.1, 0, 0, 0), (0.05, 0.05, 0.02, 1, 1, 1), (n_frames, 6))
    phones = PhoneSequence([SILENCE, "b", "ɪ", "n", SILENCE], [0.0, 1.0, 1.1, 1.3, 1.5, n_frames / FPS])
    return Observation(
        name,
        FPS,
        landmarks.astype(np.float32),
        head.astype(np.float32),
        phones,
        (WordSpan("bin", 1, 4),),
        generator.uniform(30, 80, n_frames).astype(np.float32),
        Quality(-3000.0, 1.0, 0, 0.0),
        Path(f"{name}.mkv"),
    )


def known_directions() -> np.ndarray:
    """(3, 478, 3) orthonormal: two of the mouth, one of the rest; the first two part the lips."""
    mouth = np.isin(np.arange(N_LANDMARKS), MOUTH_REGION)
    raw = np.random.default_rng(5).normal(size=(3, N_LANDMARKS, 3))
    raw[:2, ~mouth] = 0
    raw[2, mouth] = 0
    raw[2, [33, 263]] = 0
    vectors, _ = np.linalg.qr(raw.reshape(3, -1).T)
    return vectors.T.reshape(3, N_LANDMARKS, 3)


@pytest.fixture
def make_observation() -> Callable[..., Observation]:
    return made_observation
