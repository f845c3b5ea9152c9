"""Videos made of recordings, for tests."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from tts2face.video.media import read_frames, read_sound


def join_clips(sources: list[Path], out: Path, late_s: float = 0.0) -> list[tuple[float, float]]:
    """Join clips to one MP4 with 44.1 kHz stereo sound; returns the start and end of each in seconds.

    ``late_s`` delays the sound.
    """
    spans, sounds, pictures = [], [], []
    for source in sources:
        here = [picture.pixels for picture in read_frames(source)]
        spans.append((len(pictures) / 25, (len(pictures) + len(here)) / 25))
        pictures += here
        sound = read_sound(source, 16_000).samples
        whole = np.zeros(len(here) * 640, np.float32)
        whole[: len(sound)] = sound[: len(whole)]
        sounds.append(whole)
    together = np.concatenate([np.zeros(round(late_s * 16_000), np.float32), *sounds])[: sum(map(len, sounds))]
    write_video(pictures, together, out)
    return spans


def write_video(
    pictures: Sequence[np.ndarray], samples: np.ndarray, out: Path, fps: int = 25, *, is_lossless: bool = False
) -> None:
    """Pictures (H, W, 3) and samples at 16 kHz as an MP4 with 44.1 kHz stereo sound, AAC or lossless."""
    import soxr

    with av.open(str(out), "w") as container:
        video = container.add_stream("libx264", rate=fps, options={"crf": "15"})
        video.height, video.width = (side // 2 * 2 for side in pictures[0].shape[:2])
        video.pix_fmt = "yuv420p"
        audio = container.add_stream("alac" if is_lossless else "aac", rate=44_100, layout="stereo")
        for number, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, fps)
            container.mux(video.encode(frame))
        samples = soxr.resample(samples.astype(np.float32), 16_000, 44_100)
        frame = av.AudioFrame.from_ndarray(np.stack([samples, samples]), "fltp", "stereo")
        frame.sample_rate = 44_100
        for one in av.AudioResampler(audio.format, "stereo", 44_100).resample(frame) if is_lossless else [frame]:
            container.mux(audio.encode(one))
        container.mux(audio.encode(None))
        container.mux(video.encode(None))


def mirrored_pair(pixels: np.ndarray) -> np.ndarray:
    """A picture next to its mirror image."""
    return np.concatenate([pixels, pixels[:, ::-1]], axis=1)
