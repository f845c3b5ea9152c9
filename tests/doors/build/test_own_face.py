"""From recordings to a talker with a face of its own that speaks any text, on rendered and real recordings."""

import csv
from pathlib import Path

import av
import numpy as np
import pytest

from cli.main import run
from corpus_tools.appearance.transfer import build_appearance_transfer
from tests.rendered_takes import ONLY_RENDERED, manifest_rows
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.models.talker_file import read_talker
from tts2face.video.tracking import FaceTracker

N_RECORDINGS = 10
CONSENT = "agreed: the speakers of GRID, 2006-01-01, to research and publication"
TEXT = "Bob may move. We were away."


@pytest.fixture(scope="module")
def recordings(takes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    source, folder = takes, tmp_path_factory.mktemp("few")
    rows = manifest_rows(source)
    rows = rows[:: max(1, len(rows) // N_RECORDINGS)][:N_RECORDINGS]
    (folder / "clips").mkdir()
    with (folder / "manifest.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for row in rows:
        (folder / "clips" / f"{row['clip']}.mkv").symlink_to(source / "clips" / f"{row['clip']}.mkv")
    return folder


@pytest.fixture(scope="module")
def talker(recordings: Path, face_model: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("talker") / "me.talker"
    words = ["corpus", "build", str(recordings), "--out", str(out), "--appearance", "--consent", CONSENT]
    # The user's cache: what is seen in the takes serves other builds and reports, too.
    assert run([*words, "--jobs", "1", "--model", str(face_model)]) == 0
    return out


@pytest.fixture(scope="module")
def pictures(talker: Path) -> np.ndarray:
    out = talker.with_name("clip.mp4")
    assert run([TEXT, "--talker", str(talker), "--face", "self", "--out", str(out), "--fps", "25", "--quiet"]) == 0
    with av.open(str(out)) as container:
        assert "Synthetic" in container.metadata["comment"]
        return np.stack([frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)])


def test_the_file_contains_the_consent_and_is_small(talker: Path) -> None:
    made = read_talker(talker)
    assert made.metadata["consent"]["statement"] == CONSENT
    assert made.metadata["consent"]["date"]
    assert "pictures of the person's face" in made.metadata["content"]
    assert talker.stat().st_size < 25e6
    assert made.appearance is not None
    assert made.appearance.face.n_modes == 40
    assert all(
        spoken.appearance_parameters is not None and len(spoken.appearance_parameters) == len(spoken.shape)
        for spoken in made.utterances
    )


def test_the_clip_shows_a_face_whose_lips_part_and_close(pictures: np.ndarray, face_model: Path) -> None:
    points = FaceTracker(face_model).track(lambda: iter(pictures), 25.0).points
    assert not np.isnan(points).any()
    gap = np.linalg.norm(points[:, UPPER_LIP_INNER_MID] - points[:, LOWER_LIP_INNER_MID], axis=1)
    eyes = np.linalg.norm(points[:, EYE_OUTER_LEFT] - points[:, EYE_OUTER_RIGHT], axis=1)
    opened = gap / eyes
    assert opened.max() > 0.06
    # last bits of the tracker choose other fragments: .014 to .023 of the eyes' distance over a widest of .11
    assert opened[[0, -1]].max() < opened.max() / 3


def test_a_picture_between_two_others_has_no_jump(pictures: np.ndarray) -> None:
    """Cheeks and chin change slowly: no seam flickers, no recording's light shines through."""
    height, width = pictures.shape[1:3]
    face = pictures[:, height // 2 : height * 8 // 10, width // 3 : width * 2 // 3].astype(float).mean(axis=(1, 2))
    assert np.abs(np.diff(face, axis=0)).max() < 8  # a fast mouth makes 4 to 5; a tinted word made 30


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["Hi.", "--face", "self", "--out", "x.mp4"], "motion only"),
        (["Hi.", "--face", "self", "--identity", "mei", "--out", "x.mp4"], "has no identity presets"),
        (["Hi.", "--face", "self", "--articulation", "loud", "--out", "x.mp4"], "must be natural, clear or a factor"),
        (["Hi.", "--face", "self", "--view"], "--view cannot show the talker's own face"),
    ],
)
def test_what_an_own_face_cannot_do_is_refused(
    words: list[str], reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(words) != 0
    assert reason in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@ONLY_RENDERED
def test_pictures_without_consent_are_refused(
    recordings: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["corpus", "build", str(recordings), "--out", str(tmp_path / "me.talker"), "--appearance"]) != 0
    assert "state the consent" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@ONLY_RENDERED
@pytest.mark.parametrize("source", ["grid_s1", "me"])
def test_speech_of_another_talker_on_an_own_face(source: str, talker: Path, tmp_path: Path) -> None:
    """The clone has the appearance of its target and the consent to show it, whatever the source has."""
    cloned, clip = tmp_path / "cloned.talker", tmp_path / "clip.mp4"
    given = str(talker) if source == "me" else source
    assert run(["corpus", "clone", given, str(talker), "--append-missing", "--out", str(cloned)]) == 0
    assert run(["Bob may.", "--talker", str(cloned), "--face", "self", "--out", str(clip), "--quiet"]) == 0
    clone, target = read_talker(cloned), read_talker(talker)
    assert clone.metadata["consent"] == target.metadata["consent"]
    assert all(utterance.appearance_parameters is not None for utterance in clone.utterances)
    with av.open(str(clip)) as container:
        assert "Synthetic" in container.metadata["comment"]
        pictures = np.stack([frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)])
    assert np.abs(np.diff(pictures.astype(int), axis=0)).mean() > 0.1


@ONLY_RENDERED
def test_an_appearance_cloned_to_its_own_talker_is_unchanged(talker: Path) -> None:
    """The basis is kept in 16-bit floating point, with three digits."""
    appearance = read_talker(talker).appearance
    carry = build_appearance_transfer(appearance, appearance)
    np.testing.assert_allclose(carry.relation, np.eye(len(carry.relation)), atol=0.01)


@ONLY_RENDERED
def test_a_take_moves_lips_as_the_talker_never_did(talker: Path, face_model: Path, tmp_path: Path) -> None:
    take = tmp_path / "surprised.mp4"
    speak = ["Oh no, wow.", "--expression", "surprised=1,happy=0.6", "--fps", "25", "--size", "360x360", "--quiet"]
    assert run([*speak, "--out", str(take)]) == 0
    made = {}
    for flags in ((), ("--append-missing",)):
        out = tmp_path / f"m{len(flags)}.mp4"
        words = ["mimic", str(take), "--talker", str(talker), "--face", "self", "--out", str(out), *flags]
        assert run([*words, "--quiet", "--model", str(face_model)]) == 0
        made[flags] = out.read_bytes()
    assert made[()] != made[("--append-missing",)]
