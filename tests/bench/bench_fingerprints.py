"""Similarity of the fingerprints of the same recordings, re-encoded, and of different ones.

Run: ``PYTHONPATH=. python tests/bench/bench_fingerprints.py RECORDINGS [--others FOLDER] [--cache FOLDER] [--n N]``.
RECORDINGS is a folder of short recordings of one person, FOLDER one of several. Of ``--n`` recordings the sounds are
damaged; of a third of them pictures are damaged and tracked again. Prints what decision 140 sums up: quantiles 0, 5 and
50 % of the similarity to the same recording, the highest to another one, and how many are found.
"""

import argparse
import io
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import av
import numpy as np

from corpus_tools.measures.fingerprints import (
    Fingerprint,
    face_modes,
    find_same,
    fingerprint_observations,
    motion_changes,
    similarities,
    sound_changes,
)
from corpus_tools.recordings.observation import Observation, head_motion
from corpus_tools.recordings.observe import observe
from corpus_tools.recordings.sound import SOUND_RATE
from corpus_tools.run_options import RunOptions
from tests.bench.bench_recording_limits import (
    Pictures,
    Samples,
    add_noise,
    darken,
    shrink,
    through_codec,
    through_mp3,
)
from tts2face.sound.praat import intensity
from tts2face.types import Waveform
from tts2face.video.media import TimedFrame, read_frames, read_sound
from tts2face.video.networks import find_bundle
from tts2face.video.pose import remove_pose
from tts2face.video.resampling import trim_and_fill
from tts2face.video.streaming import StreamingTracker

PICTURES_OF = 3  # every third recording's pictures are tracked again
TRIMMED_S = 0.21  # of the beginning; no whole number of steps
SOUNDS: dict[str, Callable[[Samples], Samples]] = {
    "MP3, 64 kb/s": through_mp3,
    "AAC, 64 kb/s": lambda sound: through_codec(sound, "adts", "aac"),
    "level -12 dB": lambda sound: sound / 4,
    "noise at -10 dB": lambda sound: add_noise(sound, 10),
    "trimmed by 0.21 s": lambda sound: sound[round(TRIMMED_S * SOUND_RATE) :],
    "noise, MP3, trimmed": lambda sound: through_mp3(add_noise(sound, 10))[round(TRIMMED_S * SOUND_RATE) :],
}


def with_sound(one: Observation, samples: Samples) -> Fingerprint:
    """The fingerprint of a recording with other samples."""
    sound = Waveform(np.clip(samples, -1, 1).astype(np.float32), SOUND_RATE)
    n_frames = min(int(sound.duration * one.fps), len(one.landmarks))
    level = intensity(sound, np.arange(n_frames) / one.fps)
    motion = motion_changes(face_modes(one.landmarks[:n_frames]), one.head[:n_frames], level, one.fps)
    return Fingerprint(one.name, sound_changes(sound), motion, one.phones)


def encoded(pictures: Pictures, crf: int) -> Pictures:
    """Encoded as H.264 and decoded."""
    buffer = io.BytesIO()
    with av.open(buffer, "w", format="matroska") as container:
        stream = container.add_stream("libx264", rate=25, options={"crf": str(crf)})
        stream.height, stream.width = (side // 2 * 2 for side in pictures[0].shape[:2])
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")))
        container.mux(stream.encode(None))
    buffer.seek(0)
    with av.open(buffer, "r") as stored:
        return [frame.to_ndarray(format="rgb24") for frame in stored.decode(video=0)]


PICTURES: dict[str, Callable[[Pictures], Pictures]] = {
    "H.264 at CRF 33": lambda pictures: encoded(pictures, 33),
    "half the size, CRF 28": lambda pictures: encoded(shrink(pictures, 2), 28),
    "a third of the light": lambda pictures: darken(pictures, 0.33),
    "20 of 25 frames/s": lambda pictures: [one for at, one in enumerate(pictures) if at % 5 != 4],
}


def tracked(one: Observation, pictures: Pictures, tracker: StreamingTracker) -> Fingerprint:
    """The fingerprint of other pictures of the same span of time, without sound, as in a talker."""
    fps = one.fps * len(pictures) / len(list(read_frames(one.video)))
    timed = (TimedFrame(at / fps, pixels) for at, pixels in enumerate(pictures))
    filled, _, _ = trim_and_fill(np.array([found.points for found in tracker.track(timed, fps)]), fps)
    posed = remove_pose(filled, fps)
    level = np.interp(np.arange(len(filled)) / fps, np.arange(len(one.intensity)) / one.fps, one.intensity)
    return Fingerprint(
        one.name, None, motion_changes(face_modes(posed.landmarks), head_motion(posed), level, fps), one.phones
    )


def row(name: str, tested: Sequence[Fingerprint], known: Sequence[Fingerprint]) -> str:
    """A row: similarity of sound and of motion to the same recording, and to the most similar other; how many found."""
    is_same = np.array([[other.name == one.name for other in known] for one in tested])
    cells = []
    for part in ("sound", "motion"):
        ones, others = (
            [value for one in some if (value := getattr(one, part)) is not None] for some in (tested, known)
        )
        if len(ones) < len(tested) or len(others) < len(known):
            cells += ["", ""]
            continue
        found = similarities(ones, others)
        same = [float(values[here].max()) for values, here in zip(found, is_same, strict=True) if here.any()]
        cells.append(" ".join(f"{value:.2f}" for value in np.quantile(same, [0, 0.05, 0.5])) if same else "")
        cells.append(f"{found[~is_same].max():.2f}")
    return f"| {name} | {' | '.join(cells)} | {len(find_same(known, tested))} of {len(tested)} |"


def rows(seen: Sequence[Observation], n: int) -> Iterator[str]:
    """Rows of all damages."""
    known = fingerprint_observations(seen)
    chosen = seen[:: max(1, len(seen) // n)][:n]
    for name, change in SOUNDS.items():
        sounds = (read_sound(one.video, SOUND_RATE).samples.copy() for one in chosen)
        yield row(name, [with_sound(one, change(sound)) for one, sound in zip(chosen, sounds, strict=True)], known)
    tracker = StreamingTracker(find_bundle(None))
    for name, damage in PICTURES.items():
        pictures = ([frame.pixels for frame in read_frames(one.video)] for one in chosen[::PICTURES_OF])
        changed = [
            tracked(one, damage(some), tracker) for one, some in zip(chosen[::PICTURES_OF], pictures, strict=True)
        ]
        yield row(name, changed, known)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--others", type=Path)
    parser.add_argument("--cache", type=Path)
    parser.add_argument("--n", type=int, default=21)
    asked = parser.parse_args()
    seen = observe(asked.recordings, run_options=RunOptions(asked.cache, 1)).kept
    for line in rows(seen, asked.n):
        print(line, flush=True)
    known = fingerprint_observations(seen)
    print(row("as recorded", known, known), flush=True)
    half = len(known) // 2
    print(f"of two halves, taken for the same: {len(find_same(known[:half], known[half:]))}", flush=True)
    if asked.others is not None:
        others = observe(asked.others, run_options=RunOptions(asked.cache, 1)).kept
        print(row("other people", fingerprint_observations(others), known), flush=True)


if __name__ == "__main__":
    main()
