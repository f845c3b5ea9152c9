"""Movies that are made more slowly than they are seen lower the quality of their pictures; the sound stays whole."""

import io

import av
import numpy as np
import pytest

from tests.picture.film.lit_face import lit_tiny_face
from tests.picture.test_encode import clip_of
from tests.picture.tiny_face import tiny_face
from tts2face.picture.options import Picture
from tts2face.picture.pace import CHECK_S, HIGH_LEAD_S, LOW_LEAD_S, QUALITIES, Pace
from tts2face.picture.renderer import mesh_renderer
from tts2face.picture.streamed_movie import encode_movie

pytestmark = pytest.mark.usefixtures("few_directions")
FPS = 30.0
N_FRAMES = round(CHECK_S * FPS) + 1  # of a check


def qualities(leads: list[float]) -> list[int]:
    """Number of the quality after each check, at which the movie is ahead by the leads."""
    lead = [0.0]
    pace = Pace(lambda: lead[0])
    pace.begin()
    found = []
    for after in leads:
        for _ in range(N_FRAMES):
            pace.advance(FPS)
            lead[0] = after  # while the first frame is drawn
        found.append(QUALITIES.index(pace.quality))
    return found


def test_the_quality_falls_step_by_step_while_a_movie_falls_behind() -> None:
    assert qualities([-0.2, -0.5, -0.7, -0.9, -1.0]) == [1, 2, 3, 3, 3]


def test_the_quality_stays_while_the_lead_grows_or_is_long_enough() -> None:
    assert qualities([0.2, 0.4, 0.6, 0.8]) == [0, 0, 0, 0]
    assert qualities([LOW_LEAD_S, LOW_LEAD_S - 0.1 + 0.2, LOW_LEAD_S]) == [0, 0, 0]


def test_the_quality_rises_again_once_the_movie_is_well_ahead() -> None:
    assert qualities([-0.2, -0.3, HIGH_LEAD_S + 0.1, HIGH_LEAD_S + 0.2]) == [1, 2, 1, 0]


def encoded(format: str, pace: Pace | None) -> tuple[list[int], float]:
    """Presentation times of the pictures of a movie of 75 frames, and the seconds of its sound."""
    renderer = mesh_renderer(tiny_face(), Picture(size="64x48", supersampling=2))
    clips = [clip_of(1.0, fps=FPS), clip_of(1.5, fps=FPS)]
    chunks = list(encode_movie(clips, renderer, format, threads=2, pace=pace))
    assert sum(chunk.seconds for chunk in chunks) == pytest.approx(2.5)
    content = b"".join(chunk.content for chunk in chunks)
    with av.open(io.BytesIO(content)) as movie:
        times = [frame.pts for frame in movie.decode(video=0)]
    with av.open(io.BytesIO(content)) as movie:
        return times, sum(frame.samples / frame.sample_rate for frame in movie.decode(audio=0))


@pytest.mark.parametrize("format", ["mp4", "webm"])
def test_frames_that_are_not_drawn_leave_the_others_at_their_times(format: str) -> None:
    every, whole_s = encoded(format, None)
    assert len(every) == 75
    times, seconds = encoded(format, Pace(lambda: -1.0))
    assert seconds == whole_s
    numbers = [every.index(time) for time in times]
    assert set(np.diff(numbers).tolist()) == {1, 2, 3}
    assert {0, 29, 30, 74} <= set(numbers)  # the first and last frames of both clips
    assert 75 / 3 < len(numbers) < 75 * 0.7


def test_pictures_with_fewest_samples_show_the_same_view() -> None:
    clip = clip_of(0.2, fps=FPS)
    fine = mesh_renderer(tiny_face(), Picture(size="128x96", supersampling=3))
    coarse = fine.with_fewest_samples()
    assert coarse.picture.samples_per_side == 1
    pictures = [next(iter(renderer.frames(clip, [3]))).astype(float) for renderer in (fine, coarse)]
    assert 0.0 < np.abs(pictures[0] - pictures[1]).mean() < 3.0  # of 255: edges alone differ
    assert coarse.with_fewest_samples() is coarse


def test_a_movie_is_the_same_with_any_number_of_threads() -> None:
    renderer = mesh_renderer(lit_tiny_face(), Picture(size="64x48"))
    single, double, fourfold = (
        b"".join(chunk.content for chunk in encode_movie([clip_of(0.5, fps=FPS)], renderer, "mp4", threads=threads))
        for threads in (1, 2, 4)
    )
    assert single == double == fourfold
