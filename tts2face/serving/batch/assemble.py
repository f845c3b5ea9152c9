"""Joining of segments into one video: pictures are copied, only the sound is encoded again.

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
from tts2face.picture.film import MOV, MP4, WEBM, make_temporary, move_signed
from tts2face.picture.movie import MOV_MOVIE, MP4_MOVIE, WEBM_MOVIE, MovieKind, mux_pictures
from tts2face.serving.batch.audio_track import open_track
from tts2face.serving.batch.output import Sound
from tts2face.session.inspection import joined_mark
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.marks import complete, container_tags
from tts2face.storage.signing import Signer
from tts2face.types import SOUND_RATE, exact_rate, first_sample

KINDS = {MP4: MP4_MOVIE, MOV: MOV_MOVIE, WEBM: WEBM_MOVIE}
# Frames by which x264 decodes before it shows. A segment of one or two frames is not reordered: its last times of
# decoding would lie after the first ones of the next segment.
DECODE_DELAY = 2
SAMPLE_BLOCK = 48_000  # samples that are encoded at a time


def join_segments(
    segments: Sequence[Path],
    out: Path,
    fps: float,
    sounds: Sequence[Sound | None] = (),
    signer: Signer | None = None,
) -> int:
    """Join segments into a video, which appears when it is complete; its number of frames.

    The suffix of `out` is .mp4 or .mov for segments of H.264, and .webm for those of VP9.

    Parameters
    ----------
    sounds
        For each segment, what replaces its sound; empty: nothing.
    signer
        Who signs the video; None: nobody.
    """
    import av

    temporary, kind = make_temporary(out, MP4), KINDS[out.suffix]
    try:
        with (
            translate_disk_errors(out),
            av.open(str(temporary.path), "w", format=kind.container, options=dict(kind.container_options)) as target,
        ):
            mark = joined_mark(segments, signer, is_recorded=any(sound is not None for sound in sounds))
            target.metadata.update(container_tags(kind.container, mark))
            joined = _Joined(target, kind, exact_rate(fps))
            for path, sound in zip(segments, sounds or [None] * len(segments), strict=True):
                with av.open(str(path)) as source:
                    joined.append(source, path, sound)
            joined.finish()
        complete(temporary.path, kind.container, mark)
        move_signed(temporary, out, mark)
    except av.FFmpegError as broken:
        raise DataError(
            f"the segments of {out.name} cannot be joined ({broken}); remove them and run again"
        ) from broken
    finally:
        temporary.remove()
    return joined.n_frames


class _Joined:
    """Streams of the joined file."""

    def __init__(self, target: Any, kind: MovieKind, fps: Fraction) -> None:
        self._target, self._kind = target, kind
        self._fps = fps
        self._video: Any = None
        self._audio: Any = None
        self._settings: tuple[Any, ...] = ()
        self.n_frames = self._n_samples = 0
        self._sounding = np.zeros(0, np.int16)  # of the segment before, after its last frame

    def _open(self, source: Any) -> None:
        """Streams like those of the first segment."""
        first = source.streams.video[0]
        self._video = self._target.add_stream_from_template(first)
        # WebM states in its metadata that its pictures have transparency
        if "alpha_mode" in (name.lower() for name in first.metadata):
            self._video.metadata["alpha_mode"] = "1"
        self._audio = self._target.add_stream(self._kind.audio, rate=SOUND_RATE, layout="mono")
        self._audio.codec_context.bit_rate = self._kind.audio_bits
        self._settings = _settings(first)

    def append(self, source: Any, path: Path, sound: Sound | None) -> None:
        """Copy the pictures of a segment and encode its sound, or what replaces it."""
        video = source.streams.video[0]
        if self._video is None:
            self._open(source)
        if _settings(video) != self._settings:
            raise DataError(f"{path.name} was encoded with other settings than the others; remove it and run again")
        offset = Fraction(self.n_frames) / self._fps / video.time_base
        n_frames, earlier = 0, 0
        for packet in source.demux(video):
            # the last packet of a demuxer flushes, and has no picture
            if packet.dts is None:
                continue
            # with B frames the first picture is decoded before time 0
            if n_frames == 0 and video.codec_context.has_b_frames:
                earlier = min(0, -round(DECODE_DELAY / self._fps / video.time_base) - packet.dts)
            packet.pts += round(offset)
            packet.dts += round(offset) + earlier
            packet.stream = self._video
            mux_pictures(self._target, [packet], self._audio)
            n_frames += 1
        source.seek(0)
        begin = first_sample(self.n_frames, SOUND_RATE, self._fps)
        self.n_frames += n_frames
        end = first_sample(self.n_frames, SOUND_RATE, self._fps)
        if sound is not None:
            origin = first_sample(sound.offset, SOUND_RATE, self._fps)
            self._encode(open_track(Path(sound.path)).read(origin + begin, origin + end))
            return
        samples = np.concatenate([*_sound(source), self._sounding[:0]])
        self._sounding, own = sound_on(self._sounding, samples, end - begin)
        for at in range(0, len(own), SAMPLE_BLOCK):
            self._encode(own[at : at + SAMPLE_BLOCK])

    def finish(self) -> None:
        """Flush the encoder of the sound."""
        if self._audio is None:
            raise DataError("there are no segments to join; run again")
        self._target.mux(self._audio.encode(None))

    def _encode(self, samples: NDArray[np.int16]) -> None:
        import av

        frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(samples[None, :]), format="s16", layout="mono")
        frame.sample_rate, frame.time_base = SOUND_RATE, Fraction(1, SOUND_RATE)
        frame.pts = self._n_samples
        self._n_samples += len(samples)
        self._target.mux(self._audio.encode(frame))


def _settings(video: Any) -> tuple[Any, ...]:
    context = video.codec_context
    return context.name, context.width, context.height, bytes(context.extradata or b"")


def _sound(source: Any) -> Iterator[NDArray[np.int16]]:
    for frame in source.decode(source.streams.audio[0]):
        yield frame.to_ndarray().reshape(-1)


def sound_on(
    before: NDArray[np.int16], samples: NDArray[np.int16], n_samples: int
) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Sound of a segment after its `n_samples` samples, and these with what still sounds of the segment before it."""
    mixed = np.zeros(max(n_samples, len(samples), len(before)), np.int32)
    mixed[: len(samples)] += samples
    mixed[: len(before)] += before
    limits = np.iinfo(np.int16)
    # two sounds together may exceed 16 bits
    joined = np.clip(mixed, limits.min, limits.max).astype(np.int16)
    return joined[n_samples:], joined[:n_samples]
