"""``tts2face corpus evaluate``: every option matters, every kind of file, every refusal."""

import csv
import json
import re
from base64 import b64decode
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import av
import numpy as np
import pytest

from cli.main import run
from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import Observations
from tests.corpus_tools.speaking import OwnVoice, observation, with_words
from tests.packages import needs

PLAIN = ("--recordings", "all", "--hold-out", "4")


@pytest.fixture(scope="module")
def seen() -> list[Observation]:
    return [with_words(observation(number)) for number in range(24)]


@pytest.fixture(scope="module")
def curves(seen: list[Observation], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tracks") / "curves.csv"
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(("utterance", "time", "opening"))
        for one in seen:
            gaps = one.landmarks[:, 13, 1] - one.landmarks[:, 14, 1]
            rows.writerows((one.name, f"{at / one.fps:.3f}", f"{gap:.4f}") for at, gap in enumerate(gaps))
    return path


def give_folders(seen: list[Observation], patch: pytest.MonkeyPatch) -> None:
    """Folders whose recordings need not be watched, and a voice that needs no network."""
    others = [observation(100 + number, 2.0, "other") for number in range(4)]
    parts = {"all": seen, "some": seen[:18], "rest": seen[18:], "other": others}
    found = {name: Observations(tuple(part), ()) for name, part in parts.items()}
    patch.setattr("corpus_tools.recordings.observe.observe", lambda folder, **_: found[folder.name])
    patch.setattr("cli.evaluate._load_default_voice", lambda: OwnVoice(seen, lambda durations: 1.2 * durations))


@pytest.fixture(scope="module")
def plain(seen: list[Observation], tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table without options, which is made once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("plain"))
        give_folders(seen, patch)
        return evaluation_bytes("plain.csv", *PLAIN)


@pytest.fixture
def here(seen: list[Observation], curves: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    give_folders(seen, monkeypatch)
    (tmp_path / "curves.csv").symlink_to(curves)
    return tmp_path


def evaluate(*more: str) -> int:
    return run(["corpus", "evaluate", *more])


def evaluation_bytes(out: str, *more: str) -> bytes:
    assert evaluate(*more, "--out", out) == 0
    return Path(out).read_bytes()


@pytest.mark.parametrize(
    "option",
    [
        ("--hold-out", "5"),
        ("--seed", "3"),
        ("--folds", "2"),
        ("--hold-out-words", "aaum,abum"),
        ("--tracks", "curves.csv"),
        ("--own-durations",),
        ("--cross-talker", "other"),
    ],
)
def test_each_option_changes_the_figures(option: tuple[str, ...], plain: bytes, here: Path) -> None:
    given = PLAIN[:2] if option[0] in PLAIN else PLAIN
    assert evaluation_bytes("option.csv", *given, *option) != plain


def test_the_same_options_give_the_same_figures(plain: bytes, here: Path) -> None:
    assert evaluation_bytes("plain.csv", *PLAIN) == plain


def test_folders_that_are_split_already(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        len(json.loads(evaluation_bytes("split.json", "--train", "some", "--test", "rest"))["scores"][0]["utterances"])
        == 6
    )
    assert "wrote split.json: 6 utterances held out, 18 for training" in capsys.readouterr().err


def test_another_talker_is_reported(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = json.loads(evaluation_bytes("across.json", "--train", "all", "--cross-talker", "other"))
    assert (result["is_across"], result["n_train"], result["n_test"]) == (True, 24, 4)
    assert "4 utterances of another talker, 24 for training" in capsys.readouterr().err


@pytest.mark.needs("matplotlib")
def test_own_durations_are_reported_in_the_terminal_and_in_every_file(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = (*PLAIN, "--own-durations")
    assert b"<h2>With own durations</h2>" in evaluation_bytes("own.html", *own)
    assert len(re.findall(r"\| exemplar \| \d", capsys.readouterr().out)) == 2
    assert b"\nown durations,exemplar," in evaluation_bytes("own.csv", *own)
    assert len(json.loads(evaluation_bytes("own.json", *own))["own"]) == 4


@pytest.mark.needs("matplotlib")
def test_folds_are_reported_in_the_terminal_and_in_every_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folds = ("--recordings", "all", "--folds", "3")
    assert b"<h2>3 folds</h2>" in evaluation_bytes("folds.html", *folds)
    assert "spread over 3 folds" in capsys.readouterr().out
    assert b"\nfold 3,exemplar," in evaluation_bytes("folds.csv", *folds)
    assert len(json.loads(evaluation_bytes("folds.json", *folds))["folds"]) == 3


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((), "use either --recordings, or both --train and --test"),
        (("--train", "some"), "use either --recordings, or both --train and --test"),
        (
            ("--recordings", "all", "--folds", "2", "--hold-out-words", "alpha"),
            "--folds cannot be combined with --hold-out-words",
        ),
        (("--train", "some", "--test", "rest", "--folds", "2"), "cannot be combined with --train and --test"),
        (("--recordings", "all", "--hold-out", "24"), "1 to 23 can be held out, not 24"),
        (("--recordings", "all", "--folds", "1"), "24 utterances make 2 to 24 folds, not 1"),
        (("--recordings", "all", "--hold-out-words", "zebra"), "no utterance contains zebra"),
        (("--recordings", "all", "--tracks", "none.csv"), "there are no tracks none.csv"),
        (("--recordings", "all", "--out", "x.pdf"), "written as .html, .json, .csv, not x.pdf"),
        (("--cross-talker", "other"), "--cross-talker needs one folder of training recordings"),
        (
            ("--cross-talker", "other", "--recordings", "all", "--folds", "2"),
            "cannot be combined with --test, --folds or",
        ),
        (
            ("--cross-talker", "other", "--train", "some", "--test", "rest"),
            "cannot be combined with --test, --folds or",
        ),
        (("--cross-talker", "other", "--recordings", "all", "--own-durations"), "cannot be combined with --tracks"),
        (
            ("--cross-talker", "other", "--recordings", "all", "--tracks", "curves.csv"),
            "cannot be combined with --tracks",
        ),
        (("--cross-talker", "none.csv", "--recordings", "all"), "there is no capture none.csv"),
        (("--cross-talker", "rest", "--recordings", "all"), "u18 is in both the training and the held-out part"),
    ],
)
def test_refusals_are_one_sentence(
    arguments: tuple[str, ...], reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert evaluate(*arguments) == 2
    message = capsys.readouterr().err
    assert re.search(re.escape(reason), message)
    assert message.count("\n") == 1


def test_own_durations_need_words(seen: list[Observation], here: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    mute = [replace(one, words=()) for one in seen]
    monkeypatch.setattr("corpus_tools.recordings.observe.observe", lambda *_, **__: Observations(tuple(mute), ()))
    assert evaluate(*PLAIN, "--own-durations") == 2
    assert "own durations need recordings whose words are known" in capsys.readouterr().err


def test_recordings_are_shown_beside_the_head(
    rendered_takes: Path, face_model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six recordings, one held out, with the real voice: the page contains a video of it, and is small."""
    needs("matplotlib")
    monkeypatch.chdir(tmp_path)
    source, few = rendered_takes, tmp_path / "few"
    (few / "clips").mkdir(parents=True)
    rows = (source / "manifest.csv").read_text().splitlines()[:7]
    (few / "manifest.csv").write_text("\n".join(rows))
    for row in rows[1:]:
        name = f"{row.split(',')[0]}.mkv"
        (few / "clips" / name).symlink_to(source / "clips" / name)
    page = evaluation_bytes(
        "few.html", "--recordings", "few", "--hold-out", "1", "--own-durations", "--jobs", "1"
    ).decode()
    assert len(page) < 1_000_000
    (film,) = re.findall(r'src="data:video/mp4;base64,([^"]*)"', page)
    with av.open(BytesIO(b64decode(film))) as container:
        assert not container.streams.audio
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(pictures) > 25
    assert pictures[0].shape == (240, 480, 3)
    moved = np.abs(np.diff([one.astype(float) for one in pictures], axis=0)).mean(axis=(1, 2, 3))
    assert moved.max() > 0.5
