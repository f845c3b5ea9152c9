"""The plate: selection and encoding of the part of a talker's video on which pictures are drawn."""

import io
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import CHIN, LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID

MAX_PLATE_FRAMES = 250  # frames; played forwards and backwards its length is not noticeable
NEAR_LOSSLESS = {"crf": "8", "preset": "slow"}


def choose_plate_frames(points: Sequence[NDArray[np.float32]]) -> tuple[int, int, int]:
    """Index of the recording with the least mouth motion and its range of frames, from landmarks (T, N, 2) of each."""

    def motion(places: NDArray[np.float32]) -> float:
        gap = np.linalg.norm(places[:, UPPER_LIP_INNER_MID] - places[:, LOWER_LIP_INNER_MID], axis=1)
        chin = np.linalg.norm(places[:, CHIN] - places[:, UPPER_LIP_INNER_MID], axis=1)
        return float(gap.mean() + chin.std())

    longest = max(len(places) for places in points)
    enough = [number for number, places in enumerate(points) if len(places) >= min(longest, MAX_PLATE_FRAMES) // 2]
    number = min(enough, key=lambda at: motion(points[at][:MAX_PLATE_FRAMES]))
    return number, 0, min(len(points[number]), MAX_PLATE_FRAMES)


def encode_plate_video(pictures: Iterator[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Bytes of an MP4 video of (H, W, 3) pictures; odd sides lose their last row or column."""
    import av

    first = next(pictures)
    height, width = (side - side % 2 for side in first.shape[:2])
    store = io.BytesIO()
    with av.open(store, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(25), options=dict(NEAR_LOSSLESS))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv444p"
        for picture in chain([first], pictures):
            # H.264 halves the colours of both directions: sides are even
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture[:height, :width]), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return np.frombuffer(store.getvalue(), np.uint8)
