#!/usr/bin/env bash
# PyAV 18.1.0 (FFmpeg 8): in a live output (FLV, MPEG-TS, MP4 in fragments) with a sound stream that gets no packets
# yet, `mux` of pictures writes nothing: the muxer waits for sound to put between them and holds the last 10 s of
# pictures back, for as long as there is no sound. Flushing each packet (`flush_packets`) changes nothing; with
# `max_interleave_delta` of 100000 (microseconds) 0.1 to 0.2 s are held. A speaker that is silent has to send silence.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: av==18.1.0 numpy==2.4.6
"$work/environment/bin/python" - <<'END'
import sys
from fractions import Fraction

import av
import numpy as np

RATE = 25
N_PICTURES = 12 * RATE
FRAGMENTS = {"movflags": "frag_every_frame+empty_moov+default_base_moof"}
NOISE = np.random.default_rng(0)


class Pipe:
    """A file that counts its bytes."""

    n_bytes = 0

    def write(self, part):
        self.n_bytes += len(part)
        return len(part)


def held(form, options):
    """Seconds of pictures that are given to `mux` before the first of them reaches the file."""
    pipe = Pipe()
    container = av.open(pipe, "w", format=form, options={**options, "flush_packets": "1"}, buffer_size=1024)
    video = container.add_stream("libx264", rate=RATE, options={"preset": "ultrafast", "tune": "zerolatency"})
    video.width = video.height = 64
    container.add_stream("aac", rate=48_000, layout="mono")
    container.start_encoding()
    head, first = pipe.n_bytes, None
    for number in range(N_PICTURES):
        pixels = NOISE.integers(0, 255, (64, 64, 3), np.uint8)  # so that a picture is larger than any buffer
        frame = av.VideoFrame.from_ndarray(pixels, format="rgb24")
        frame.pts, frame.time_base = number, Fraction(1, RATE)
        container.mux(video.encode(frame))
        if first is None and pipe.n_bytes > head + 3000:
            first = (number + 1) / RATE
    container.close()
    return first


print("av", av.__version__)
holds = True
for form, options in (("flv", {}), ("mpegts", {}), ("mp4", FRAGMENTS)):
    waits = held(form, options), held(form, {**options, "max_interleave_delta": "100000"})
    print(f"{form}: first picture written after {waits[0]} s, with max_interleave_delta after {waits[1]} s")
    holds &= None not in waits and 9.9 < waits[0] < 10.3 and waits[1] < 0.5
if not holds:
    sys.exit("changed")
END
echo "as described"
