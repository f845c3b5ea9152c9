"""Files of videos for tests."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

MakeVideo = Callable[..., Path]


@pytest.fixture
def make_video(tmp_path: Path) -> MakeVideo:
    """Writes a video of grey frames, frame i of level 20 + 4 i, with a tone of 440 Hz or without sound."""

    def made(name: str, n_frames: int = 10, fps: int = 25, tone_s: float = 0.0) -> Path:
        import av

        path = tmp_path / name
        with av.open(str(path), "w") as container:
            video = container.add_stream("libx264", rate=fps) if n_frames else None
            audio = container.add_stream("flac", rate=16000, layout="mono") if tone_s else None
            if video:
                video.width, video.height, video.pix_fmt = 64, 48, "yuv420p"
                for i in range(n_frames):
                    frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 20 + 4 * i, np.uint8), format="rgb24")
                    container.mux(video.encode(frame))
                container.mux(video.encode())
            if audio:
                tone = 0.5 * np.sin(2 * np.pi * 440 * np.arange(round(16000 * tone_s)) / 16000)
                for at in range(0, len(tone), 1024):
                    block = (tone[at : at + 1024] * 32767).astype(np.int16)[None]
                    sound = av.AudioFrame.from_ndarray(block, format="s16", layout="mono")
                    sound.sample_rate, sound.pts = 16000, at
                    container.mux(audio.encode(sound))
                container.mux(audio.encode())
        return path

    return made
