"""Sound of a microphone, as it comes."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError

# FFmpeg's devices by system, and the name of the usual microphone there.
DEVICES = {"linux": ("alsa", "default"), "darwin": ("avfoundation", ":0"), "win32": ("dshow", "")}
FULL_SCALE = 32_768


@contextmanager
def open_microphone(device: str = "") -> Iterator[tuple[int, Iterator[NDArray[np.float32]]]]:
    """Sample rate of a microphone and its samples as one channel, in blocks, until the block ends.

    Parameters
    ----------
    device
        Name of a device of the system (ALSA's on Linux, a number such as ``:1`` on macOS, a name on Windows); empty:
        the usual one.

    Raises
    ------
    BackendError
        There is no such device, or the system gives no access to it.
    """
    import av

    format, usual = DEVICES.get(sys.platform, DEVICES["linux"])
    name = device or usual
    if not name:
        raise BackendError("Windows has no usual microphone here; name one: --microphone 'Microphone (USB)'")
    try:
        container: Any = av.open(f"audio={name}" if format == "dshow" else name, format=format)
    except (av.FFmpegError, OSError, ValueError) as refused:
        reason = getattr(refused, "strerror", None) or str(refused)
        raise BackendError(
            f"the microphone {name!r} cannot be opened ({reason}); name another one, or check its rights"
        ) from refused
    with container:
        stream = container.streams.audio[0]
        yield stream.rate, _blocks(container, stream)


def _blocks(container: Any, stream: Any) -> Iterator[NDArray[np.float32]]:
    import av

    resampler = av.AudioResampler(format="s16", layout="mono", rate=stream.rate)
    for frame in container.decode(stream):
        for mono in resampler.resample(frame):
            yield mono.to_ndarray()[0].astype(np.float32) / np.float32(FULL_SCALE)
