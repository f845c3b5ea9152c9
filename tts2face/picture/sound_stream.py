"""Encoded sound, sent while it is made or written as a complete file."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.picture.write_buffer import WriteBuffer
from tts2face.storage.marks import MARK_OPTIONS, Mark, complete, container_tags
from tts2face.storage.wave_files import WaveFile, pcm_bytes, wave_head
from tts2face.types import Chunk, Waveform

OPUS_RATE = 48_000  # Hz
PCM_RATE = 24_000  # Hz of samples without a header, whatever the voice: what OpenAI's and HeadTTS' clients play
BLOCK_S = 0.5  # of sound that a codec encodes at a time; a sentence takes up to 0.2 s


@dataclass(frozen=True, slots=True)
class SoundKind:
    """Container and codec of a sound format.

    Parameters
    ----------
    bits
        Per second.
    rate
        Sample rate, where the codec or the clients fix it.
    lead
        Samples of silence with which the encoder's delay is whole packets. They are left out of what is sent while it
        is made and cannot name the delay, so that its first sample is that of the sound. None: its header names it.
    names_delay
        So does that of a complete file, which is written at last.
    is_sent_whole
        Without its length in its header the file is damaged for some readers: it is sent when all is made.
    """

    media_type: str
    container: str = ""
    codec: str = ""
    bits: int = 0
    rate: int | None = None
    lead: int | None = None
    names_delay: bool = True
    is_sent_whole: bool = False


SOUND_KINDS = {
    "wav": SoundKind("audio/wav"),
    "pcm": SoundKind("audio/pcm", rate=PCM_RATE),
    # LAME's 576 samples and a decoder's 529 are two packets of 576 at 8 to 24 kHz, or one of 1,152 above.
    "mp3": SoundKind("audio/mpeg", "mp3", "libmp3lame", 64_000, lead=47),
    "opus": SoundKind("audio/ogg", "ogg", "libopus", 48_000, OPUS_RATE),
    "weba": SoundKind("audio/webm", "webm", "libopus", 48_000, OPUS_RATE),  # Opus for MediaSource, which takes no Ogg
    "aac": SoundKind("audio/aac", "adts", "aac", 96_000, lead=0, names_delay=False),  # one packet of 1,024
    "flac": SoundKind("audio/flac", "flac", "flac", is_sent_whole=True),  # libsndfile cannot seek without it (238)
}
_NO_RANDOM_IDS = {"fflags": "+bitexact"}
_CONTAINER_OPTIONS = {"ogg": _NO_RANDOM_IDS, "webm": _NO_RANDOM_IDS}
_STREAM_OPTIONS = {"webm": {"live": "1", "cluster_time_limit": "200"}}


def encode_sound(
    sounds: Iterator[Waveform], format: str, path: Path | None = None, mark: Mark | None = None
) -> Iterator[Chunk]:
    """Encode consecutive mono sounds of one sample rate as a file; yields its chunks in order.

    Parameters
    ----------
    format
        One of `SOUND_KINDS`; ``wav`` and ``pcm`` have 16 bits, ``pcm`` has no header and `PCM_RATE`.
    path
        Where a complete file is written, whose header has its length; chunks are empty then.
    mark
        What the file says of its making; ``pcm`` has no place for it.

    Raises
    ------
    InputError
        The format is unknown, the sounds differ in sample rate, or a complete WAV file would have more than 4 GB.
    """
    if format not in SOUND_KINDS:
        raise InputError(f"there is no sound format {format!r}; the formats are {', '.join(SOUND_KINDS)}")
    kind = SOUND_KINDS[format]
    encoder: _PcmEncoder | _CodecEncoder | None = None
    rate = 0
    try:
        for sound in sounds:
            if encoder is None:
                rate = sound.rate
                encoder = (_CodecEncoder if kind.codec else _PcmEncoder)(kind, rate, path, mark)
            if sound.rate != rate:
                raise InputError(f"sounds of one file must share the sample rate {rate} Hz; one has {sound.rate} Hz")
            for block in _blocks(sound) if kind.codec else [sound]:
                yield Chunk(encoder.add(block), block.duration)
        if encoder is not None:
            yield Chunk(encoder.finish())
            encoder = None
    finally:
        if encoder is not None:
            encoder.finish()


def _blocks(sound: Waveform) -> Iterator[Waveform]:
    size = round(BLOCK_S * sound.rate)
    for start in range(0, len(sound.samples), size):
        yield sound.part(start, start + size)


class _PcmEncoder:
    """Encoder without compression; a kind with a rate of its own has no header."""

    def __init__(self, kind: SoundKind, rate: int, path: Path | None, mark: Mark | None) -> None:
        self._rate, has_header = kind.rate or rate, kind.rate is None
        self._resampler: Any = None
        if self._rate != rate:
            import soxr

            self._resampler = soxr.ResampleStream(rate, self._rate, 1, dtype="float32")
        self._file: WaveFile | BinaryIO | None = None
        if path is not None:
            self._file = WaveFile(path, self._rate, mark) if has_header else path.open("wb")
        self._header = wave_head(self._rate, None, mark) if has_header and path is None else b""

    def add(self, sound: Waveform) -> bytes:
        samples = sound.samples
        return self._written(samples if self._resampler is None else self._resampler.resample_chunk(samples))

    def finish(self) -> bytes:
        rest = b""
        if self._resampler is not None:
            rest = self._written(self._resampler.resample_chunk(np.zeros(0, np.float32), last=True))
        if self._file is not None:
            self._file.close()
        return rest

    def _written(self, samples: NDArray[np.float32]) -> bytes:
        content = pcm_bytes(samples.clip(-1.0, 1.0))
        if self._file is None:
            content, self._header = self._header + content, b""
            return content
        if isinstance(self._file, WaveFile):
            self._file.write_pcm(content)
        else:
            self._file.write(content)
        return b""


class _CodecEncoder:
    """Encoder with a codec of FFmpeg."""

    def __init__(self, kind: SoundKind, rate: int, path: Path | None, mark: Mark | None) -> None:
        import av

        self._buffer, self._rate, self._n_samples = WriteBuffer(), rate, 0
        self._path, self._mark = path, mark
        self._format = kind.container
        target = self._buffer if path is None else str(path)
        options = {**_CONTAINER_OPTIONS.get(kind.container, {}), **MARK_OPTIONS.get(kind.container, {})}
        if path is None:
            options = {"flush_packets": "1"} | options | _STREAM_OPTIONS.get(kind.container, {})
        self._container: Any = av.open(target, "w", format=kind.container, options=options)
        self._container.metadata.update(container_tags(kind.container, mark))
        self._stream: Any = self._container.add_stream(kind.codec, rate=kind.rate or rate, layout="mono")
        if kind.bits:
            self._stream.codec_context.bit_rate = kind.bits
        self._keeps_all = kind.lead is None or (path is not None and kind.names_delay)
        if not self._keeps_all and kind.lead:
            self._n_samples = -kind.lead
            self._encode(np.zeros(kind.lead, np.float32))

    def add(self, sound: Waveform) -> bytes:
        self._encode(sound.samples)
        return self._buffer.take()

    def finish(self) -> bytes:
        self._mux(self._stream.encode(None))
        self._container.close()
        if self._path is not None:
            complete(self._path, self._format, self._mark)
        return self._buffer.take()

    def _encode(self, samples: NDArray[np.float32]) -> None:
        import av

        frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(samples[None, :]), format="fltp", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = self._rate, self._n_samples, Fraction(1, self._rate)
        self._n_samples += len(samples)
        self._mux(self._stream.encode(frame))

    def _mux(self, packets: Iterable[Any]) -> None:
        """Write packets, but for those before the sound, whose number no header would name."""
        self._container.mux([packet for packet in packets if self._keeps_all or packet.pts >= 0])
