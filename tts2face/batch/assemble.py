"""Joining of segments into one .mp4 file: pictures are copied, only the sound is encoded again.

All segments have the same picture size, frame rate and encoder settings; each begins on a key frame and has exact
uncompressed sound.
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.batch.output import Sound
from tts2face.batch.track import open_track
from tts2face.clock import exact_rate, first_sample
from tts2face.render.movie import MP4_MOVIE, SOUND_RATE
from tts2face.render.output_path import MP4, make_temporary, move_into_place
from tts2face.storage.files import translate_disk_errors

SAMPLE_BLOCK = 48_000  # samples that are encoded at a time


def join_segments(segments: Sequence[Path], out: Path, fps: float, sounds: Sequence[Sound | None] = ()) -> int:
    """Join segments into a .mp4 file, which appears when it is complete; its number of frames.

    Parameters
    ----------
    sounds
        For each segment, what replaces its sound; empty: nothing.

    Raises
    ------
    DataError
        A segment is damaged or was encoded with other settings.
    BackendError
        The file cannot be written.
    """
    import av

    temporary = make_temporary(out, MP4)
    try:
        with translate_disk_errors(out):
            n_frames = _join(segments, temporary.path, exact_rate(fps), sounds or [None] * len(segments))
        move_into_place(temporary, out)
    except av.FFmpegError as broken:
        raise DataError(
            f"the segments of {out.name} cannot be joined ({broken}); remove them and run again"
        ) from broken
    finally:
        temporary.remove()
    return n_frames


def _join(segments: Sequence[Path], out: Path, fps: Fraction, sounds: Sequence[Sound | None]) -> int:
    import av

    with av.open(str(out), "w", format="mp4", options=dict(MP4_MOVIE.container_options)) as target:
        joined: _Joined | None = None
        for path, sound in zip(segments, sounds, strict=True):
            with av.open(str(path)) as source:
                if joined is None:
                    joined = _Joined(target, source, fps)
                joined.append(source, path, sound)
        if joined is None:
            raise DataError(f"there are no segments to join into {out.name}")
        joined.finish()
        return joined.n_frames


class _Joined:
    """Streams of the joined file."""

    def __init__(self, target: Any, source: Any, fps: Fraction) -> None:
        self._target, self._fps = target, fps
        for name, value in source.metadata.items():
            if name == "comment":
                target.metadata[name] = value
        self._video = target.add_stream_from_template(source.streams.video[0])
        self._audio = target.add_stream(MP4_MOVIE.audio, rate=SOUND_RATE, layout="mono")
        self._audio.codec_context.bit_rate = MP4_MOVIE.audio_bits
        self._extradata = bytes(source.streams.video[0].codec_context.extradata)
        self.n_frames = self._n_samples = 0

    def append(self, source: Any, path: Path, sound: Sound | None) -> None:
        """Copy the pictures of a segment and encode its sound, or what replaces it."""
        video = source.streams.video[0]
        if bytes(video.codec_context.extradata) != self._extradata:
            raise DataError(f"{path.name} was encoded with other settings than the others; remove it and run again")
        offset = Fraction(self.n_frames) / self._fps / video.time_base
        n_frames = 0
        for packet in source.demux(video):
            if packet.dts is None:
                continue
            packet.pts += round(offset)
            packet.dts += round(offset)
            packet.stream = self._video
            self._target.mux(packet)
            n_frames += 1
        source.seek(0)
        begin = first_sample(self.n_frames, SOUND_RATE, self._fps)
        self.n_frames += n_frames
        end = first_sample(self.n_frames, SOUND_RATE, self._fps)
        if sound is not None:
            origin = first_sample(sound.offset, SOUND_RATE, self._fps)
            self._encode(open_track(Path(sound.path)).read(origin + begin, origin + end))
            return
        n_samples = end - begin
        for block in _exactly(_sound(source), n_samples):
            self._encode(block)

    def finish(self) -> None:
        """Flush the encoder of the sound."""
        self._target.mux(self._audio.encode(None))

    def _encode(self, samples: NDArray[np.int16]) -> None:
        import av

        frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(samples[None, :]), format="s16", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = SOUND_RATE, self._n_samples, Fraction(1, SOUND_RATE)
        self._n_samples += len(samples)
        self._target.mux(self._audio.encode(frame))


def _sound(source: Any) -> Iterator[NDArray[np.int16]]:
    for frame in source.decode(source.streams.audio[0]):
        yield frame.to_ndarray().reshape(-1)


def _exactly(blocks: Iterator[NDArray[np.int16]], n_samples: int) -> Iterator[NDArray[np.int16]]:
    """Blocks with `n_samples` samples in total, cut or followed by silence."""
    for block in blocks:
        part = block[:n_samples]
        n_samples -= len(part)
        if len(part):
            yield part
    while n_samples > 0:
        silence = np.zeros(min(n_samples, SAMPLE_BLOCK), np.int16)
        n_samples -= len(silence)
        yield silence
