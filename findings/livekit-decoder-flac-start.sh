#!/usr/bin/env bash
# livekit-agents 1.8.9 (with av 18.1.0): AudioStreamDecoder, by which its speech services read what a server sends,
# loses the first block of a FLAC file (2304 samples, 96 ms at 24 kHz) and gives the rest unchanged: the begin of the
# first word. WAV is whole, and so is the same FLAC file by av alone.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 150 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: livekit-agents==1.8.9 av==18.1.0 numpy

cat > "$work/look.py" << 'PYTHON'
import asyncio
import io
import sys

import av
import numpy as np
from livekit.agents.utils.codecs import AudioStreamDecoder

RATE = 24_000
RAMP = np.arange(RATE, dtype=np.int16)  # each sample of one second is its own number


def encoded(container, codec):
    """The ramp as a file."""
    out = io.BytesIO()
    with av.open(out, "w", format=container) as file:
        stream = file.add_stream(codec, RATE, layout="mono")
        block = av.AudioFrame.from_ndarray(RAMP[None], "s16", "mono")
        block.sample_rate, block.pts = RATE, 0
        for frame in (block, None):
            file.mux(stream.encode(frame))
    return out.getvalue()


def by_av(content):
    """Samples that av reads."""
    with av.open(io.BytesIO(content)) as file:
        return np.concatenate([frame.to_ndarray()[0] for frame in file.decode(audio=0)])


async def by_livekit(content, kind):
    """Samples that livekit-agents reads."""
    decoder = AudioStreamDecoder(sample_rate=RATE, num_channels=1, format=kind)
    decoder.push(content)
    decoder.end_input()
    samples = [np.frombuffer(frame.data, np.int16) async for frame in decoder]
    await decoder.aclose()
    return np.concatenate(samples)


async def main():
    wav, flac = encoded("wav", "pcm_s16le"), encoded("flac", "flac")
    with av.open(io.BytesIO(flac)) as file:
        first = next(file.decode(audio=0)).samples
    found = {"wav": await by_livekit(wav, "audio/wav"), "flac": await by_livekit(flac, "audio/flac")}
    for name, samples in found.items():
        print(f"{name}: {len(samples)} of {RATE} samples, from sample {samples[0]} to {samples[-1]}")
    print(f"the first block of the FLAC file has {first} samples")
    ours = np.array_equal(by_av(flac), RAMP)
    cut = np.array_equal(found["flac"], RAMP[first:]) and np.array_equal(found["wav"], RAMP)
    if not (ours and cut and first == 2304):
        sys.exit("changed")
    print("as described")


asyncio.run(main())
PYTHON
"$work/environment/bin/python" "$work/look.py"
