"""Recordings made unfit in one way each are refused for that; the others go on, at one frame rate."""

from pathlib import Path

import numpy as np
import pytest

from corpus_tools.recordings.observe import Observations, observe
from corpus_tools.run_options import RunOptions
from tests.corpus_tools.films import mirrored_pair, write_video
from tests.rendered_takes import manifest_rows
from tts2face.video.media import read_frames, read_sound

REASONS = {
    "crowd": "show more than one face",
    "frozen": "the picture is frozen for",
    "noisy": "dB above the noise, limit 6 dB",
    "away": "no face is visible",
    "wrong": "does not match the transcript",
    "dark": "no frame shows a face",
}


@pytest.fixture(scope="module")
def found(rendered_takes: Path, face_model: Path, tmp_path_factory: pytest.TempPathFactory) -> Observations:
    rows = manifest_rows(rendered_takes)[:2]
    clip = rendered_takes / "clips" / f"{rows[0]['clip']}.mkv"
    pictures = [picture.pixels for picture in read_frames(clip)]
    sound = read_sound(clip, 16_000).samples
    grey = np.full_like(pictures[0], 90)
    loud = np.abs(sound).max()
    noise = np.random.default_rng(0).normal(0, sound.std(), len(sound))
    folder = tmp_path_factory.mktemp("unfit")
    write_video([mirrored_pair(pixels) for pixels in pictures], sound, folder / "crowd.mp4")
    write_video([*pictures[:30], *[pictures[30]] * 12, *pictures[42:]], sound, folder / "frozen.mp4")
    # AAC rounds off what was clipped: how much of it is left depends on the release of the encoder.
    write_video(pictures, np.clip(5 * sound / loud, -1, 1), folder / "clipped.mp4", is_lossless=True)
    write_video(pictures, sound + 1.5 * noise, folder / "noisy.mp4")
    write_video(pictures, sound + noise / 3, folder / "hiss.mp4")
    write_video([*pictures[:35], *[grey] * 8, *pictures[43:]], sound, folder / "away.mp4")
    write_video([grey] * len(pictures), sound, folder / "dark.mp4")
    write_video(pictures, sound, folder / "good.mp4")
    write_video(pictures, sound, folder / "wrong.mp4")
    faster = [pictures[min(round(number * 25 / 30), len(pictures) - 1)] for number in range(len(pictures) * 30 // 25)]
    write_video(faster, sound, folder / "faster.mp4", fps=30)
    for path in folder.glob("*.mp4"):
        path.with_suffix(".txt").write_text(rows[0]["transcript"])
    (folder / "wrong.txt").write_text("yesterday seventeen elephants remembered nothing")
    write_video(pictures, sound, folder / "second.mp4")
    (folder / "second.txt").write_text(rows[0]["transcript"])
    return observe(folder, run_options=RunOptions(folder / "cache", 2, face_model))


def test_every_refusal_names_its_reason(found: Observations) -> None:
    reasons = {refusal.name: refusal.reason for refusal in found.refused}
    assert set(reasons) == set(REASONS)
    assert [name for name, reason in REASONS.items() if reason not in reasons[name]] == []


def test_weaknesses_that_do_not_hurt_are_warnings(found: Observations) -> None:
    messages = {warning.name: warning.message for warning in found.warnings}
    assert "of the speech is clipped, limit 0.5%" in messages["clipped"]
    assert "dB above the noise, limit 20 dB" in messages["hiss"]
    assert "good" not in messages


def test_the_other_recordings_use_the_most_frequent_frame_rate(found: Observations) -> None:
    assert [seen.name for seen in found.kept] == ["clipped", "faster", "good", "hiss", "second"]
    assert {seen.fps for seen in found.kept} == {25.0}
    _, faster, good, _, _ = found.kept
    n_frames = min(len(faster.landmarks), len(good.landmarks))
    gaps = [
        np.linalg.norm(one.landmarks[:n_frames, 13] - one.landmarks[:n_frames, 14], axis=1) for one in (faster, good)
    ]
    assert np.corrcoef(gaps[0], gaps[1])[0, 1] > 0.98
    np.testing.assert_allclose(faster.phones.edges[1:-1], good.phones.edges[1:-1], atol=0.02)
