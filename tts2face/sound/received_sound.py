"""Sound of the bytes of a file that a voice server sends, in whatever format."""

import io
import re

import numpy as np

from lexicon.errors import DataError
from tts2face.types import Waveform

LONGEST_S = 900.0  # of one sentence
RATES_HZ = (8_000, 192_000)
RAW_RATE_HZ = 24_000  # of samples without a header and a stated rate, as OpenAI's "pcm"
_RAW = re.compile(r"audio/(?:x-)?(?:pcm|l16|raw)\b(?:.*\brate=(?P<rate>\d{1,9}))?", re.IGNORECASE)
_HEADERS = (b"RIFF", b"OggS", b"fLaC", b"ID3")


def decode_sound(content: bytes, kind: str = "") -> Waveform:
    """Mono sound of a file in memory: WAV, also with a length that was not known when it was begun, MP3, FLAC, Opus.

    By a media type `kind` such as ``audio/pcm`` or ``audio/L16;rate=16000``, bytes are samples of 16 bits without a
    header. Other bytes are refused (`DataError`), as are sounds without an end, silence and rates that no voice has.
    """
    if not content:
        raise DataError("it is empty")
    raw = None if content.startswith(_HEADERS) else _RAW.match(kind)
    samples, rate = _decoded(content, kind) if raw is None else _raw_samples(content, int(raw["rate"] or RAW_RATE_HZ))
    if not samples.any():
        raise DataError("it is silent" if samples.size else "it is empty")
    return Waveform(np.clip(samples, -1.0, 1.0), rate)


def _check_rate(rate: int) -> None:
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise DataError(f"its rate is {rate} Hz")


def _raw_samples(content: bytes, rate: int) -> tuple[np.ndarray, int]:
    """Samples in the byte order in which the wave is smoother: servers disagree on that of L16."""
    _check_rate(rate)
    whole = content[: len(content) // 2 * 2]
    both = [np.frombuffer(whole, order).astype(np.float32) / 32768.0 for order in ("<i2", ">i2")]
    return min(both, key=lambda samples: float(np.abs(np.diff(samples)).sum())), rate


def _decoded(content: bytes, kind: str) -> tuple[np.ndarray, int]:
    """Samples of a file with a header, and their rate in Hz."""
    import av

    parts: list[np.ndarray] = []
    try:
        with av.open(io.BytesIO(content), "r") as file:
            rate = file.streams.audio[0].rate
            _check_rate(rate)
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
        raise DataError(f"its {len(content)} bytes of {kind or 'an unnamed type'} are no sound") from broken
    return np.nan_to_num(np.concatenate(parts or [np.zeros(0, np.float32)])).astype(np.float32), rate
