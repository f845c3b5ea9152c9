"""Files for Chromium's fake camera and microphone: a clip, then quiet, in a loop."""

import wave
from pathlib import Path

import av
import numpy as np
from PIL import Image

from tts2face.video.media import read_frames, read_sound

RATE, FPS = 48_000, 25
WIDTH, HEIGHT = 320, 240
QUIET_S = 5.0


def write_fake_media(clip: Path, folder: Path) -> list[str]:
    """Write the files; returns the arguments of Chromium that use them.

    In the quiet, the first 0.4 s of the clip, before its speech, go to and fro.
    """
    frames = [_scaled(frame.pixels) for frame in read_frames(clip)]
    rest = [*frames[:10], *frames[8:0:-1]]
    n_quiet = round(QUIET_S * FPS)
    pictures = frames + (rest * (n_quiet // len(rest) + 1))[:n_quiet]
    with av.open(str(folder / "camera.y4m"), "w", format="yuv4mpegpipe") as container:
        stream = container.add_stream("rawvideo", rate=FPS)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode(None))
    speech = read_sound(clip, RATE).samples[: len(frames) * RATE // FPS]
    noise = np.random.default_rng(0).normal(0, 3e-4, len(pictures) * RATE // FPS)
    noise[: len(speech)] += speech
    with wave.open(str(folder / "microphone.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes((np.clip(noise, -1, 1) * 32767).astype("<i2").tobytes())
    return [
        "--use-fake-device-for-media-stream",
        "--use-fake-ui-for-media-stream",
        f"--use-file-for-fake-video-capture={folder / 'camera.y4m'}",
        f"--use-file-for-fake-audio-capture={folder / 'microphone.wav'}",
    ]


def _scaled(pixels: np.ndarray) -> np.ndarray:
    """The picture in the middle of one of `WIDTH` and `HEIGHT`."""
    width = round(pixels.shape[1] * HEIGHT / pixels.shape[0])
    small = np.asarray(Image.fromarray(pixels).resize((min(width, WIDTH), HEIGHT), Image.Resampling.BOX))
    whole = np.full((HEIGHT, WIDTH, 3), 110, np.uint8)
    left = (WIDTH - small.shape[1]) // 2
    whole[:, left : left + small.shape[1]] = small
    return whole
