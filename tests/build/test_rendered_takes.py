"""The takes of the folder ``takes`` are what their script makes."""

import csv
from pathlib import Path

import av
import numpy as np
import pytest

from tests.rendered_takes import CAPTURE_NAME, NAMES, TAKES, make_takes, manifest_rows
from tts2face.video.media import read_sound

RATE = 48_000
TIMES_S = 0.01  # another processor moves some edges by a step of the aligner
LEVEL = 0.01  # of samples: a codec's, and the last bits of a voice's model
WEIGHT = 0.01  # of shapes in [0, 1]
PICTURE = 2 / 255  # mean difference


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("takes")
    make_takes(folder)
    return folder


def test_the_same_files_of_the_same_words(made: Path) -> None:
    for folder in (TAKES, made):
        assert sorted(path.stem for path in (folder / "clips").iterdir()) == sorted(NAMES)
        assert sorted(path.stem for path in (folder / "align").iterdir()) == sorted(NAMES)
    kept, again = (
        [[row["clip"], row["transcript"], float(row["speech_start_s"]), float(row["speech_end_s"])] for row in rows]
        for rows in map(manifest_rows, (TAKES, made))
    )
    for one, other in zip(kept, again, strict=True):
        assert one[:2] == other[:2]
        assert one[2:] == pytest.approx(other[2:], abs=TIMES_S)


@pytest.mark.parametrize("name", NAMES)
def test_a_take_looks_and_sounds_the_same(name: str, made: Path) -> None:
    kept, again = (
        [line.split() for line in (folder / "align" / f"{name}.align").read_text().splitlines()]
        for folder in (TAKES, made)
    )
    assert [word for *_, word in kept] == [word for *_, word in again]
    times = [np.array([row[:2] for row in rows], float) / 25_000 for rows in (kept, again)]
    np.testing.assert_allclose(*times, atol=TIMES_S)
    films = [folder / "clips" / f"{name}.mkv" for folder in (TAKES, made)]
    assert_same_sound(*films)
    pictures = [np.stack([frame.to_ndarray(format="rgb24") for frame in decoded(film)]) for film in films]
    assert pictures[0].shape == pictures[1].shape
    assert np.abs(pictures[0].astype(float) - pictures[1]).mean(axis=(1, 2, 3)).max() <= 255 * PICTURE


def test_the_capture_moves_and_sounds_the_same(made: Path) -> None:
    tables = []
    for folder in (TAKES, made):
        with (folder / f"{CAPTURE_NAME}.csv").open(encoding="utf-8", newline="") as file:
            tables.append(list(csv.reader(file)))
    kept, again = tables
    assert kept[0] == again[0]
    assert [row[:2] for row in kept] == [row[:2] for row in again]
    np.testing.assert_allclose(*(np.array([row[2:] for row in rows[1:]], float) for rows in tables), atol=WEIGHT)
    assert_same_sound(*(folder / f"{CAPTURE_NAME}.flac" for folder in (TAKES, made)))


def decoded(film: Path) -> list[av.VideoFrame]:
    with av.open(str(film)) as container:
        return list(container.decode(video=0))


def assert_same_sound(one: Path, other: Path) -> None:
    kept, again = (read_sound(path, RATE).samples for path in (one, other))
    np.testing.assert_allclose(kept, again, atol=LEVEL)
