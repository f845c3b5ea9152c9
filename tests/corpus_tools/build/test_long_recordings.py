"""One long video of speech: cut at pauses, phones recognised or words placed, a lag taken out."""

from itertools import cycle, islice
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.build_talker import build_talker
from corpus_tools.recordings.observe import Observations, observe
from corpus_tools.recordings.sound import MAX_UTTERANCE_S
from corpus_tools.run_options import RunOptions
from corpus_tools.studies.recordings_page import recordings_page
from lexicon.sequence import SILENCE
from tests.corpus_tools.films import join_clips
from tests.rendered_takes import manifest_rows
from tts2face.models.talker_file import read_talker

N_CLIPS = 17
LATE_S = 0.2


@pytest.fixture(scope="module")
def rows(shared_recordings: Path) -> list[dict[str, str]]:
    return list(islice(cycle(manifest_rows(shared_recordings / "grid_s1")), N_CLIPS))


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def folder(shared_recordings: Path, rows: list[dict[str, str]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A take of 51 s whose sound is late."""
    made = tmp_path_factory.mktemp("long")
    clips = shared_recordings / "grid_s1" / "clips"
    join_clips([clips / f"{row['clip']}.mkv" for row in rows], made / "take.mp4", late_s=LATE_S)
    return made


@pytest.fixture(scope="module")
def read(folder: Path, rows: list[dict[str, str]], cache: Path, face_model: Path) -> Observations:
    """The take with its transcript in the same folder."""
    (folder / "take.txt").write_text(". ".join(row["transcript"].replace(" a ", " ay ") for row in rows))
    found = observe(folder / "take.mp4", run_options=RunOptions(cache, 1, face_model))
    (folder / "take.txt").unlink()
    return found


def test_a_long_take_is_cut_at_pauses_and_every_word_is_aligned(read: Observations, rows: list[dict[str, str]]) -> None:
    assert not read.refused
    assert [seen.name for seen in read.kept] == [f"take-{number:04d}" for number in range(1, len(read.kept) + 1)]
    assert max(len(seen.landmarks) / seen.fps for seen in read.kept) <= MAX_UTTERANCE_S
    onsets = [seen.quality.cut + seen.phones.edges[word.first] for seen in read.kept for word in seen.words]
    assert len(onsets) == sum(len(row["transcript"].split()) for row in rows)
    first_words = np.array(onsets[:: len(rows[0]["transcript"].split())])
    true = np.array([3.0 * number + float(row["speech_start_s"]) for number, row in enumerate(rows)])
    assert np.abs(first_words - true).max() < 0.25
    assert np.median(np.abs(first_words - true)) < 0.06  # the lag is out: with it every onset would be 0.2 s late


def test_the_lag_of_the_sound_is_found_and_kept(read: Observations) -> None:
    """40 ms: three standard deviations of the estimate from 48 s of this talker."""
    (lag,) = {seen.quality.lag for seen in read.kept}
    assert lag == pytest.approx(LATE_S, abs=0.04)


def test_without_a_transcript_phones_are_recognised_and_marked(
    folder: Path, read: Observations, cache: Path, tmp_path: Path, face_model: Path
) -> None:
    report = tmp_path / "report.html"
    out = tmp_path / "take.talker"
    run_options = RunOptions(cache, 1, face_model)
    built = build_talker(folder, out, run_options=run_options, created="2000-01-01", report=report, base="none")
    assert built.n_kept == len(read.kept)
    talker = read_talker(out)
    assert talker.metadata["phones_recognised"] == [seen.name for seen in read.kept]
    assert talker.metadata["sound_late_s"]["take.mp4"] == pytest.approx(LATE_S, abs=0.04)
    written = sum(label != SILENCE for seen in read.kept for label in seen.phones.phones)
    heard = sum(label != SILENCE for spoken in talker.utterances for label in spoken.phones.phones)
    assert 0.8 < heard / written < 1.2
    assert "their phones were recognised" in report.read_text()


def test_the_report_shows_every_recording_and_loads_nothing(read: Observations) -> None:
    html = recordings_page("a & b", read)
    assert "<title>Recordings of a &amp; b</title>" in html
    assert html.count('<section class="item">') == len(read.kept)
    assert html.count("data:image/jpeg") == len(read.kept)
    assert html.count('aria-label="lips and sound of ') == len(read.kept)
    for colour in ("first", "second"):
        assert html.count(f"fill: none; stroke: var(--{colour})") == len(read.kept)
    assert "http" not in html
    assert "Audio delays corrected: +2" in html
