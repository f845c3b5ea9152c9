#!/usr/bin/env bash
# PyAV 18.1.0 (FFmpeg 8): a WebM file of Opus that was encoded from 24 kHz states a start of .006 s (the encoder's 312
# samples), of the stream and of the container, but its first decoded sample has the time 0 and
# is the recording's first one: who subtracts the stated start loses 6 ms. Of Opus encoded from 48 kHz both are 0.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: av==18.1.0 numpy
"$work/environment/bin/python" - <<'END'
import io
import sys
from fractions import Fraction

import av
import numpy as np

print("av", av.__version__)
found = {}
for rate in (24_000, 48_000):
    content = io.BytesIO()
    with av.open(content, "w", format="webm") as container:
        stream = container.add_stream("libopus", rate=rate, layout="mono")
        samples = np.zeros((1, rate), np.int16)
        samples[0, rate // 2] = 20_000  # a click at .5 s
        frame = av.AudioFrame.from_ndarray(samples, format="s16", layout="mono")
        frame.sample_rate, frame.time_base, frame.pts = rate, Fraction(1, rate), 0
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    content.seek(0)
    with av.open(content) as container:
        stream = container.streams.audio[0]
        frames = list(container.decode(stream))
        heard = np.abs(np.concatenate([frame.to_ndarray()[0] for frame in frames]))
        stated = float(stream.start_time * stream.time_base)
        click = int(heard.argmax()) / stream.rate
        print(f"{rate} Hz: stated start {stated} s ({container.start_time / 1e6} s), first frame at {frames[0].time} s, "
              f"click at {click} s after it")
        found[rate] = (round(stated, 3), frames[0].time, round(click, 3))
if found != {24_000: (0.006, 0.0, 0.5), 48_000: (0.0, 0.0, 0.5)}:
    print("changed:", found)
    sys.exit(1)
END
echo "as described"
