#!/usr/bin/env bash
# soundfile 0.14.0 (libsndfile 1.2.2): a FLAC file whose header does not state its number of samples, as FFmpeg writes it
# into a pipe (0, "unknown" in the format), has 2 ** 63 - 1 frames; `read` wants memory for all of them, and blocks are
# read up to the last one, at which the seek to the end fails. The same file with the number is read.
# Fails (exit code 1) if the packages behave otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: av==18.1.0 soundfile==0.14.0 numpy

cat > "$work/check.py" << 'PYTHON'
import io
import sys

import av
import numpy as np
import soundfile


class Pipe:
    """A file that is written from start to end."""

    def __init__(self):
        self.content = b""

    def write(self, part):
        self.content += part
        return len(part)


def encode(target):
    with av.open(target, "w", format="flac") as container:
        stream = container.add_stream("flac", rate=24_000, layout="mono")
        tone = np.sin(np.arange(24_000) * 0.2, dtype=np.float32)[None] * 0.3
        frame = av.AudioFrame.from_ndarray(np.round(tone * 32767).astype(np.int16), format="s16", layout="mono")
        frame.sample_rate = 24_000
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def attempt(name, action):
    try:
        found = action()
    except (soundfile.SoundFileError, ValueError, MemoryError) as refused:
        found = type(refused).__name__
    print(f"{name}: {found}")
    return found


def blocks(content):
    n_read = 0
    with soundfile.SoundFile(io.BytesIO(content)) as file:
        while n := len(file.read(4096)):
            n_read += n
    return n_read


pipe, whole = Pipe(), io.BytesIO()
encode(pipe)
encode(whole)
print("soundfile", soundfile.__version__, soundfile.__libsndfile_version__, "PyAV", av.__version__)
found = (
    attempt("piped, frames", lambda: soundfile.info(io.BytesIO(pipe.content)).frames),
    isinstance(attempt("piped, read whole", lambda: len(soundfile.read(io.BytesIO(pipe.content))[0])), str),
    attempt("piped, read in blocks", lambda: blocks(pipe.content)),
    attempt("with its length, read whole", lambda: len(soundfile.read(io.BytesIO(whole.getvalue()))[0])),
)
if found != (2**63 - 1, True, "LibsndfileError", 24_000):
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/check.py"
