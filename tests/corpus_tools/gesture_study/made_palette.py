"""A palette with known gestures: heads that move with the sound, regular blinks, brows of two modes."""

import numpy as np

from tts2face.models.palette import Derivation, FaceRegion, FeatureChange, Palette, Style

N_RECORDINGS, N_FRAMES = 60, 90
BLINK = np.array([0.25, 0.9, 1.0, 0.6, 0.25], np.float32)


def smooth(generator: np.random.Generator, n_channels: int, n_frames: int) -> np.ndarray:
    steps = generator.normal(size=(n_channels, n_frames))
    return np.stack([np.convolve(row, np.hanning(15), "same") for row in steps], axis=1).astype(np.float32)


def made_style(seed: int = 1, n: int = N_RECORDINGS) -> Style:
    """Blinks a second apart; the louder, the faster the head turns."""
    generator = np.random.default_rng(seed)
    total = n * N_FRAMES
    loud = np.clip(-12 + 4 * smooth(generator, 1, total)[:, 0], -35, 10)
    lids = np.zeros((total, 2), np.float32)
    for recording in range(n):
        for at in generator.integers(2, 20) + recording * N_FRAMES + np.array([0, 30, 60]):
            lids[at : at + 5] = BLINK[:, None]
    turning = np.cumsum(np.exp(loud / 8)[:, None] * smooth(generator, 6, total), axis=0)
    head = np.float32([0.01, 0.01, 0.01, 1, 1, 1]) * np.sin(turning)
    motion = {"brows": smooth(generator, 2, total), "blink": lids, "head": head.astype(np.float32)}
    metadata = {"sources": "made", "licence": "none"}
    return Style(np.full(n, N_FRAMES, np.int32), loud.astype(np.float32), np.zeros(total, np.float32), motion, metadata)


def made_palette(n: int = N_RECORDINGS) -> Palette:
    """The style "calm" and "quick", derived from it. Brows: mode 0 lifts two landmarks by 1 mm, mode 1 parts them."""
    modes = np.zeros((2, 2, 3), np.float32)
    modes[0, :, 1] = np.sqrt(0.5)
    modes[1, :, 0] = np.sqrt(0.5), -np.sqrt(0.5)
    regions = dict.fromkeys(("brows", "cheeks"), FaceRegion(np.array([70, 300], np.int32), modes))
    changes = {
        "head": FeatureChange(gain=2.0),
        "blink": FeatureChange(tempo=1.5),
        "brows": FeatureChange(offset={"brows0": 1.0}),
    }
    quick = Derivation("calm", changes, "calm with a larger head and faster blinks")
    return Palette(np.zeros((478, 3), np.float32), regions, {"calm": made_style(n=n)}, {"quick": quick})
