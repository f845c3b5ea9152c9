"""CPU seconds of a second of live video: made, drawn and encoded as H.264 and AAC, in any working copy.

``python live_cost.py text|idle|sound SECONDS`` prints them, with the number of frames. A copy without
`Session.face_stream` makes pieces, as a sender of one's own did before there was one: idle time in blocks of .2 s, lips
of sound in blocks of 40 ms over it, x264 at `veryfast`. All frames are drawn, however late.
"""

import sys
import tempfile
import time
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tts2face import Session
from tts2face.picture.options import Picture

FPS, SIZE, RATE = 30, 512, 48_000
TEXTS = (
    "We were away a year ago, but Bob may move five big maps.", "The doctor said it could take weeks.",
    "Nobody knows why the old mill was closed in winter.", "It is not far from here, and the weather was fine.",
)  # fmt: skip
IDLE_S, BLOCK_S = 0.2, 0.04  # of pieces; of sound that is pushed
HAS_STREAM = hasattr(Session, "face_stream")


class Shown(NamedTuple):
    """A frame: picture (H, W, 3), and sound (n,) at 48 kHz."""

    pixels: Any
    sound: Any


def pushed(session: Session) -> Any:
    """Sound of the texts (n,) at 48 kHz, which is pushed."""
    parts = [piece.clip.speech.waveform.resampled(RATE).samples for piece in session.stream(" ".join(TEXTS))]
    return np.concatenate(parts).astype(np.float32)


class Stream:
    """Frames of a `FaceStream`, on its clock; drawn behind it, so that none is left out."""

    def __init__(self, session: Session, what: str, seconds: float) -> None:
        from tts2face.session.live.drawing import PoseDrawer

        self._what, self._n = what, round(seconds * FPS)
        self._sound = pushed(session) if what == "sound" else None
        self._stream = session.face_stream(fps=FPS, draws=False)
        self._drawer = PoseDrawer(session.renderer(Picture(size=f"{SIZE}x{SIZE}")), self._stream.channels, FPS)
        self._drawer.prepare()
        self._stream.read(120)

    def frames(self) -> Iterator[Shown]:
        """Frames of some seconds."""
        made = []
        with self._stream as stream:
            number, n_said, n_given = 0, 0, 0
            for at, frame in enumerate(stream.frames()):
                if at == self._n:
                    break
                made.append(frame)
                if self._what == "text" and (not number or (frame.ends and frame.utterance == number)):
                    number = stream.say(TEXTS[n_said % len(TEXTS)])
                    n_said += 1
                while self._sound is not None and n_given < (at + 1) / FPS * RATE:
                    start = n_given % (len(self._sound) - RATE)
                    n_given += round(BLOCK_S * RATE)
                    stream.push_sound(self._sound[start : start + round(BLOCK_S * RATE)], RATE)
        for frame in made:
            yield Shown(self._drawer.draw(frame.weights, frame.head, frame.number), frame.sound)


class Pieces:
    """Frames of pieces of a clip without an end."""

    def __init__(self, session: Session, what: str, seconds: float) -> None:
        self._session, self._what, self._n = session, what, round(seconds * FPS)
        self._live = session.live(fps=float(FPS))
        self._sound = pushed(session) if what == "sound" else None
        self._renderer = session.renderer(Picture(size=f"{SIZE}x{SIZE}"))
        list(self._renderer.frames(next(iter(self._live.idle(IDLE_S))).clip, threads=1))
        list(self._live.say("Warm up."))

    def clips(self) -> Iterator[Any]:
        """Clips without an end."""
        at = 0
        while True:
            if self._what == "text":
                yield from (piece.clip for piece in self._live.say(TEXTS[at % len(TEXTS)]))
            else:
                yield from (piece.clip for piece in self._live.idle(IDLE_S))
            at += 1

    def frames(self) -> Iterator[Shown]:
        """Frames of some seconds."""
        n, lips = 0, self._session.listen(RATE)
        n_block = round(BLOCK_S * RATE)
        for clip in self.clips():
            if self._sound is not None:  # the weights of lips would be added to the few frames: no work
                for start in range(0, round(IDLE_S * RATE), n_block):
                    lips.add_samples(self._sound[start : start + n_block])
            sound = clip.speech.waveform.resampled(RATE).samples
            for pixels in self._renderer.frames(clip, threads=1):
                first = round(n % len(clip.motion) * RATE / FPS)
                yield Shown(pixels, sound[first : first + RATE // FPS])
                n += 1
                if n == self._n:
                    return


def encoded(frames: Iterator[Shown], path: Path) -> int:
    """Number of frames, which are encoded as the product sends them, or as a sender of one's own did."""
    n = 0
    if HAS_STREAM:
        from dataclasses import replace

        from tts2face.picture.movie import MovieWriter
        from tts2face.targets.movie_sender import live_kind
        from tts2face.targets.tick import LiveFormat

        kind = replace(live_kind("flv", "aac", LiveFormat(Fraction(FPS), SIZE, SIZE)), video_bits=1_500_000)
        writer = MovieWriter(str(path), kind, (SIZE, SIZE, 3), (Fraction(FPS), RATE))
        for n, shown in enumerate(frames, 1):  # noqa: B007 - their number is returned
            writer.picture(shown.pixels)
            writer.sound(shown.sound)
        writer.finish()
        return n
    import av

    with av.open(str(path), "w", format="flv") as container:
        video: Any = container.add_stream("libx264", rate=FPS)
        video.width = video.height = SIZE
        video.pix_fmt, video.bit_rate, video.thread_count = "yuv420p", 1_500_000, 1
        video.options = {"profile": "baseline", "preset": "veryfast", "tune": "zerolatency", "bf": "0", "g": "60"}
        audio: Any = container.add_stream("aac", rate=RATE, layout="stereo")
        for n, shown in enumerate(frames, 1):
            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(shown.pixels), format="rgb24")
            picture.pts = n - 1
            container.mux(video.encode(picture.reformat(format="yuv420p")))
            both = np.repeat(np.asarray(shown.sound, np.float32), 2)[None]
            sound = av.AudioFrame.from_ndarray(both, format="flt", layout="stereo")
            sound.sample_rate, sound.pts, sound.time_base = RATE, (n - 1) * RATE // FPS, Fraction(1, RATE)
            container.mux(audio.encode(sound))
    return n


def main() -> None:
    """Print CPU seconds a second, and the number of frames."""
    what, seconds = sys.argv[1], float(sys.argv[2])
    session = Session(face="ada")
    source = (Stream if HAS_STREAM else Pieces)(session, what, seconds)
    with tempfile.TemporaryDirectory() as folder:
        began = time.process_time()
        n = encoded(source.frames(), Path(folder) / "live.flv")
        print((time.process_time() - began) / n * FPS, n)


if __name__ == "__main__":
    main()
