#!/usr/bin/env bash
# Praat's resynthesis by overlap-add (praat-parselmouth 0.4.7) draws random numbers where a sound has no voice: two equal
# calls in one process give other samples there, several tenths of full scale apart, and equal ones within a part with voice. Praat's
# function random_initializeWithSeedUnsafelyButPredictably before each call makes them equal.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 30 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --disable-pip-version-check praat-parselmouth==0.4.7 \
    2> "$work/warnings" || { cat "$work/warnings"; exit 1; }

cat > "$work/look.py" << 'PYTHON'
import sys
from importlib.metadata import version

import numpy as np
import parselmouth
from parselmouth.praat import call, run

RATE = 16_000
seconds = np.arange(2 * RATE) / RATE
pulses = (np.floor(seconds * 120) != np.floor((seconds - 1 / RATE) * 120)).astype(float)
noise = np.random.default_rng(0).normal(0, 0.05, len(seconds))
samples = np.where(seconds < 1, np.convolve(pulses, np.hanning(40), "same") * 0.3, noise)
print(f"praat-parselmouth {version('praat-parselmouth')}; a second with voice at 120 Hz, a second of noise")


def longer(seed):
    if seed is not None:
        run(f"random_initializeWithSeedUnsafelyButPredictably ({seed})")
    return call(parselmouth.Sound(samples, RATE), "Lengthen (overlap-add)", 75, 600, 1.25).values[0]


def compare(name, seed):
    first, second = longer(seed), longer(seed)
    difference = np.abs(first - second)
    bounds = [round(share * 1.25 * RATE) for share in (0.1, 0.9, 1.1, 1.9)]
    parts = [float(difference[first:last].max()) for first, last in (bounds[:2], bounds[2:])]
    print(f"{name}: largest difference with voice {parts[0]:.3g}, without {parts[1]:.3g}")
    return parts


plain, seeded = compare("two equal calls", None), compare("with a seed before each", 1)
if not (plain[0] == 0.0 and plain[1] > 0.05 and seeded == [0.0, 0.0]):
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/look.py"
