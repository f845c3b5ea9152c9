#!/usr/bin/env bash
# PyAV 18.1.0 (FFmpeg 8), H.264 with AAC in fragmented MP4: with `empty_moov` the header is written before the
# encoder's delay of AAC (1024 samples) is known, so that no edit list states it. The first picture of 40 ms lasts 61
# ms and all others come 21 ms late. With a fragment per key picture the sound moves by as much; with
# `frag_every_frame` it moves by twice that: a flash and a beep at 1 s are at 1.021 and 1.045 s. With `delay_moov` too,
# and in a plain MP4, both are at 1 s.
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

RATE, SAMPLES = 25, 1920
BEEP = np.r_[20_000 * np.sin(np.arange(960) * 0.2), np.zeros(SAMPLES - 960)]


def film(flags):
    """An MP4 of 2 s with a white picture and a beep at 1 s."""
    content = io.BytesIO()
    with av.open(content, "w", format="mp4", options={"movflags": flags} if flags else {}) as container:
        video = container.add_stream("libx264", rate=RATE, options={"bf": "0"})
        video.width = video.height = 64
        audio = container.add_stream("aac", rate=RATE * SAMPLES, layout="mono")
        for number in range(2 * RATE):
            is_flash = number == RATE
            picture = av.VideoFrame.from_ndarray(np.full((64, 64, 3), 255 * is_flash, np.uint8), format="rgb24")
            picture.pts, picture.time_base = number, Fraction(1, RATE)
            container.mux(video.encode(picture))
            samples = (BEEP * is_flash).astype(np.int16)[None]
            sound = av.AudioFrame.from_ndarray(samples, format="s16", layout="mono")
            sound.sample_rate, sound.pts = RATE * SAMPLES, number * SAMPLES
            sound.time_base = Fraction(1, RATE * SAMPLES)
            container.mux(audio.encode(sound))
        container.mux(video.encode(None))
        container.mux(audio.encode(None))
    content.seek(0)
    return content


def times(content):
    """Times of the second picture, of the flash and of the beep, in s."""
    pictures, flash, beep = [], None, None
    with av.open(content) as container:
        for frame in container.decode():
            if isinstance(frame, av.VideoFrame):
                pictures.append(frame.time)
                if flash is None and frame.to_ndarray(format="gray").mean() > 128:
                    flash = frame.time
            elif beep is None and len(loud := np.flatnonzero(np.abs(frame.to_ndarray()[0]) > 0.05)):
                beep = frame.time + loud[0] / frame.sample_rate
    return round(pictures[1], 3), round(flash, 3), round(beep, 3)


SHIFTED, EXACT = (0.061, 1.021, 1.021), (0.04, 1.0, 1.0)
expected = {
    "": EXACT,
    "frag_keyframe+empty_moov": SHIFTED,
    "frag_every_frame+empty_moov": (0.061, 1.021, 1.045),
    "frag_keyframe+empty_moov+delay_moov": EXACT,
}
print("av", av.__version__)
holds = True
for flags, described in expected.items():
    found = times(film(flags))
    print(f"{flags or 'plain'}: second picture {found[0]} s, flash {found[1]} s, beep {found[2]} s")
    holds &= max(abs(one - other) for one, other in zip(found, described)) < 0.004
if not holds:
    sys.exit("changed")
END
echo "as described"
