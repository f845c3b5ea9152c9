"""Estimates against real runs: processor time of `tts2face batch` with the default voice, measured on two cores."""

from pathlib import Path

import pytest

from cli.batch_plan import _duration
from tests.serving.batch.conftest import Planner
from tts2face.picture.options import Picture
from tts2face.serving.batch.estimate import estimate_batch
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.plan import plan_batch

CUES = "".join(
    f"{n + 1}\n00:{n:02d}:01,000 --> 00:{n:02d}:05,000\nPlease put the books back on shelf {n}.\n\n" for n in range(12)
)


@pytest.mark.parametrize(
    ("size", "supersampling", "measured_s", "measured_mb"),
    [("256x256", 1, 24.4, 9.0), ("512x512", 2, 51.1, 11.6), ("1280x720", 2, 94.0, 16.0)],  # 12 cues of 4.1 s
)
def test_estimates_are_within_half_of_measured_runs(
    size: str, supersampling: int, measured_s: float, measured_mb: float, tmp_path: Path
) -> None:
    (tmp_path / "one.srt").write_text(CUES, encoding="utf-8")
    picture = Picture(size=size, supersampling=supersampling)
    estimate = estimate_batch(plan_batch([tmp_path / "one.srt"], BatchOptions(), picture=picture), tmp_path, None)
    assert estimate.seconds == 49.2
    assert 1 / 1.5 < estimate.core_s / measured_s < 1.5
    assert 1 / 1.5 < estimate.n_bytes / 1e6 / measured_mb < 1.5


def test_exports_without_videos_cost_the_synthesis(plan_of: Planner, tmp_path: Path) -> None:
    movies = estimate_batch(plan_of(), tmp_path, None)
    tracks = estimate_batch(plan_of(format="none", exports=("csv",)), tmp_path, None)
    assert tracks.core_s < movies.core_s
    assert tracks.n_segments == movies.n_segments


@pytest.mark.parametrize(("seconds", "text"), [(4.2, "4 s"), (130.0, "2 minutes"), (40_000.0, "11.1 hours")])
def test_durations_have_the_unit_that_fits_them(seconds: float, text: str) -> None:
    assert _duration(seconds) == text
