"""A small palette with a known answer: two styles of smooth random motion, and a derived one."""

import numpy as np
import pytest

from tts2face.models.palette import (
    FIXED_CHANNELS,
    REGION_FEATURES,
    Derivation,
    FaceRegion,
    FeatureChange,
    Palette,
    Style,
)

LENGTHS = np.full(20, 90, np.int32)
N_MODES = 2


def _smooth(generator: np.random.Generator, n_channels: int) -> np.ndarray:
    steps = generator.normal(size=(n_channels, int(LENGTHS.sum())))
    return np.stack([np.convolve(row, np.hanning(15), "same") for row in steps], axis=1).astype(np.float32)


def made_style(seed: int, size: float = 1.0) -> Style:
    """Smooth random motion in every feature, with sound of its own."""
    generator = np.random.default_rng(seed)
    channels = {name: len(names) for name, names in FIXED_CHANNELS.items()} | dict.fromkeys(REGION_FEATURES, N_MODES)
    motion = {name: size * _smooth(generator, n) for name, n in channels.items()}
    motion["head"] *= np.float32([0.01, 0.01, 0.01, 1, 1, 1])
    prosody = _smooth(generator, 2)
    return Style(LENGTHS, 3 * prosody[:, 0] - 15, prosody[:, 1], motion, {"sources": "made", "licence": "none"})


@pytest.fixture(scope="session")
def palette() -> Palette:
    """Styles "calm" and "wild", and "double", which is calm with a head that moves twice as far, and happier."""
    generator = np.random.default_rng(0)
    regions = {}
    for at, name in enumerate(REGION_FEATURES):
        modes, _ = np.linalg.qr(generator.normal(size=(12, N_MODES)))
        landmarks = np.arange(4, dtype=np.int32) + 10 * at
        regions[name] = FaceRegion(landmarks, modes.T.reshape(N_MODES, 4, 3).astype(np.float32))
    changes = {
        "head": FeatureChange(gain=2.0),
        "expression": FeatureChange(offset={"happy": 0.5}),
        "brows": FeatureChange(tempo=2.0),
    }
    return Palette(
        neutral=generator.normal(size=(478, 3)).astype(np.float32),
        regions=regions,
        styles={"calm": made_style(1), "wild": made_style(2, 3.0)},
        derivations={"double": Derivation("calm", changes, "calm, made larger")},
    )
