#!/usr/bin/env bash
# PyAV 18.1.0 (FFmpeg 8): a gap in the times of sound frames is kept only to the length of a coded frame. The encoder
# fills its last frame before the gap with the first samples behind it: of a tone that begins at 1 s after silence up
# to 0.5 s, Opus, AAC, MP3 and FLAC put the first 5 to 76 ms at 0.5 s, where they are heard as a click, and leave them
# out at 1 s. PCM, whose frames have any length, is right. No error, no warning; zeros have to fill the gap.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: av==18.1.0 numpy==2.4.6
"$work/environment/bin/python" - <<'END'
import io
import sys
from fractions import Fraction

import av
import numpy as np

RATE = 48_000
SILENCE = np.zeros(RATE // 2)
TONE = 16_000 * np.sin(np.arange(RATE) * 2 * np.pi * 1000 / RATE)


def encoded(codec, form, parts):
    """A file of sounds by the sample at which each begins."""
    content = io.BytesIO()
    with av.open(content, "w", format=form) as container:
        stream = container.add_stream(codec, rate=RATE, layout="mono")
        for start, samples in parts:
            frame = av.AudioFrame.from_ndarray(samples.astype(np.int16)[None], format="s16", layout="mono")
            frame.sample_rate, frame.pts, frame.time_base = RATE, start, Fraction(1, RATE)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return content


def early(content):
    """Milliseconds of tone before .9 s."""
    n_loud = 0
    content.seek(0)
    with av.open(content) as container:
        for frame in container.decode(audio=0):
            samples = frame.to_ndarray()[0].astype(float)
            samples /= 32768 if frame.format.name.startswith("s16") else 1
            times = frame.time + np.arange(len(samples)) / RATE
            loud = np.flatnonzero((np.abs(samples) > 0.05) & (times < 0.9))
            n_loud += loud[-1] - loud[0] + 1 if len(loud) else 0
    return round(1000 * n_loud / RATE)


print("av", av.__version__)
holds = True
kinds = {"libopus": "webm", "aac": "mp4", "libmp3lame": "matroska", "flac": "matroska", "pcm_s16le": "matroska"}
for codec, form in kinds.items():
    gap = early(encoded(codec, form, ((0, SILENCE), (RATE, TONE))))
    filled = early(encoded(codec, form, ((0, SILENCE), (RATE // 2, SILENCE), (RATE, TONE))))
    print(f"{codec} in {form}: {gap} ms of the tone at .5 s; with zeros in the gap {filled} ms")
    holds &= (gap == 0 if codec == "pcm_s16le" else gap > 2) and filled == 0
if not holds:
    sys.exit("changed")
END
echo "as described"
