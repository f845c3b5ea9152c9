"""Read damaged copies of a video one after the other, in a child process whose memory and time the test limits.

Run: python tests/video/damage.py VIDEO FOLDER N_COPIES SEED
"""

import resource
import sys
from pathlib import Path

import numpy as np

from lexicon.errors import DataError
from tts2face.video.media import read_frames, read_media_info, read_sound

MEMORY = 3 << 30  # bytes of addresses: libraries take half of it


def damage(content: bytes, generator: np.random.Generator) -> bytes:
    """A file cut, with bytes flipped, with a part overwritten, removed or repeated, or with several of these."""
    data = np.frombuffer(content, np.uint8).copy()
    for kind in generator.choice(["cut", "flip", "head", "blank", "omit", "double"], generator.integers(1, 4)):
        first, last = sorted(int(at) for at in generator.integers(0, max(len(data), 1), 2))
        if kind == "cut":
            data = data[:last]
        elif kind == "flip":
            places = generator.integers(0, max(len(data), 1), generator.integers(1, 200))
            data[places[places < len(data)]] ^= np.uint8(1 << generator.integers(0, 8))
        elif kind == "head":
            places = generator.integers(0, min(max(len(data), 1), 2000), 20)
            data[places[places < len(data)]] = generator.integers(0, 256)
        elif kind == "blank":
            data[first : first + 4000] = 0
        elif kind == "omit":
            data = np.concatenate([data[:first], data[first + 3000 :]])
        else:
            data = np.concatenate([data[:first], data[first:last], data[first:]])
    return data.tobytes()


def main(film: Path, folder: Path, n_copies: int, seed: int) -> None:
    """Print a line for each copy: how much of it was read, or why none."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    generator = np.random.default_rng(seed)
    for number in range(n_copies):
        path = folder / f"copy{number}{film.suffix}"
        path.write_bytes(damage(film.read_bytes(), generator))
        outcome = []
        for read in (
            lambda here=path: f"{read_media_info(here).fps:.2f} fps",
            lambda here=path: f"{sum(1 for _ in read_frames(here))} pictures",
            lambda here=path: f"{len(read_sound(here, 16_000).samples)} samples",
        ):
            try:
                outcome.append(read())
            except DataError as reason:
                outcome.append(f"refused: {reason}")
        sys.stdout.write(" | ".join(outcome) + "\n")
        sys.stdout.flush()
        path.unlink()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
