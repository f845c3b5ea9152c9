"""Sound of the bytes of a file that a voice server sends, in whatever format."""

import io

import numpy as np

from lexicon.errors import DataError
from tts2face.types import Waveform

LONGEST_S = 900.0  # of one sentence
RATES_HZ = (8_000, 192_000)


def decode_sound(content: bytes) -> Waveform:
    """Mono sound of a file in memory: WAV, also with a length that was not known when it was begun, MP3, FLAC, Opus.

    Other bytes are refused (`DataError`), as are sounds without an end and rates that no voice has.
    """
    import av

    parts: list[np.ndarray] = []
    try:
        with av.open(io.BytesIO(content), "r") as file:
            rate = file.streams.audio[0].rate
            if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
                raise DataError(f"its rate is {rate} Hz")
            mono = av.AudioResampler(format="flt", layout="mono", rate=rate)
            n_samples = 0
            for frame in file.decode(audio=0):
                parts += [part.to_ndarray()[0] for part in mono.resample(frame)]
                n_samples += parts[-1].size if parts else 0
                if n_samples > LONGEST_S * rate:
                    raise DataError(f"it lasts longer than {LONGEST_S:.0f} s")
    except (av.FFmpegError, IndexError, ValueError) as broken:
        if isinstance(broken, DataError):
            raise
        raise DataError(f"its {len(content)} bytes are no sound ({type(broken).__name__})") from broken
    if not sum(part.size for part in parts):
        raise DataError("it is empty")
    return Waveform(np.clip(np.nan_to_num(np.concatenate(parts)), -1.0, 1.0).astype(np.float32), rate)
