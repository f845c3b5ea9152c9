"""``tts2face report similarity``: every kind of file, every option, every refusal."""

import csv
import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cli.main import run
from tests.corpus_tools.similarity.steady_talker import made_talker
from tts2face.models.talker_file import write_talker

pytestmark = pytest.mark.needs("matplotlib", "sklearn")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("talkers")
    write_talker(folder / "made.talker", made_talker())
    write_talker(folder / "other.talker", made_talker(seed=9, gain=20.0))
    write_talker(folder / "poor.talker", made_talker(phones=("p", "a", "u")))
    write_talker(folder / "short.talker", made_talker(n_utterances=3))
    write_talker(folder / "strange.talker", made_talker(phones=("s", "z", "t", "d")))
    return folder


@pytest.fixture(scope="module")
def plain(folder: Path) -> Callable[[str], bytes]:
    """Content of a file without options, which is made once for each name."""

    @cache
    def make(name: str) -> bytes:
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            return report_bytes(name)

    return make


@pytest.fixture
def here(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for file in folder.glob("*.talker"):
        (tmp_path / file.name).symlink_to(file)
    return tmp_path


def report(out: str, *more: str, talker: str = "made.talker") -> int:
    halves = () if "--halves" in more else ("--halves", "3")  # fewer than the usual 20: quicker
    return run(["report", "similarity", talker, "--out", out, *halves, *more])


def report_bytes(out: str, *more: str) -> bytes:
    assert report(out, *more) == 0
    return Path(out).read_bytes()


def test_the_page_is_complete_and_loads_nothing(here: Path) -> None:
    html = report_bytes("r.html", "--compare", "other.talker").decode()
    for heading in (
        "Phone by phone", "Most similar phones", "Viseme classes", "Reliability", "Similarity and articulation",
        "Movements that phones constrain", "Compared with other.talker",
    ):  # fmt: skip
        assert f"<h2>{heading}</h2>" in html
    assert "http" not in html
    assert not re.search(r"<(script|link|img)|url\((?!#)|@import", html)
    assert html.count("<svg") == html.count("</svg>") == 6
    assert not re.search(r"\bnan\b", html)
    assert "p P" in html


def test_the_matrix_is_a_table_of_numbers(plain: Callable[[str], bytes]) -> None:
    rows = list(csv.reader(plain("r.csv").decode().splitlines()))
    assert rows[0][:2] == ["phone", "tokens"]
    assert rows[0][2:] == [row[0] for row in rows[1:]]
    matrix = np.array([row[2:] for row in rows[1:]], float)
    assert (np.diag(matrix) == 1).all()
    assert (matrix == matrix.T).all()
    assert {row[1] for row in rows[1:]} == {"60"}


def test_the_json_equals_the_matrix(plain: Callable[[str], bytes], here: Path) -> None:
    content = json.loads(plain("r.json"))
    rows = list(csv.reader(report_bytes("r.csv", "--labels", "ipa").decode().splitlines()))
    assert [phone["ipa"] for phone in content["phones"]] == rows[0][2:]
    np.testing.assert_array_equal(content["similarity"], np.array([row[2:] for row in rows[1:]], float))
    assert content["classes"]["best"] == 3
    assert content["reliability"]["utterances"]["halves_requested"] == 3
    assert content["comparison"] is None
    assert set(content["movements"]["names"]) >= {"opening", "width", "protrusion"}


def test_the_picture_is_a_png(here: Path) -> None:
    assert report_bytes("r.PNG").startswith(b"\x89PNG")
    with Image.open("r.PNG") as image:
        assert min(image.size) > 400


@pytest.mark.parametrize(
    ("out", "option"),
    [
        ("r.html", ("--classes", "2,5")),
        ("r.json", ("--classes", "2,5")),
        ("r.html", ("--halves", "5")),
        ("r.json", ("--halves", "5")),
        ("r.html", ("--seed", "7")),
        ("r.json", ("--seed", "7")),
        ("r.html", ("--labels", "ipa")),
        ("r.csv", ("--labels", "arpabet")),
        ("r.png", ("--labels", "arpabet")),
        ("r.png", ("--labels", "ipa")),
        ("r.html", ("--compare", "other.talker")),
        ("r.json", ("--compare", "other.talker")),
        ("r.csv", ("--compare", "other.talker")),
        ("r.png", ("--compare", "other.talker")),
    ],
)
def test_each_option_changes_what_is_written(
    out: str, option: tuple[str, str], plain: Callable[[str], bytes], here: Path
) -> None:
    assert report_bytes(out, *option) != plain(out)


@pytest.mark.parametrize("out", ["r.html", "r.json", "r.csv", "r.png"])
def test_the_same_options_write_the_same(out: str, plain: Callable[[str], bytes], here: Path) -> None:
    assert report_bytes(out) == plain(out)


def test_a_comparison_is_the_difference_of_the_matrices(here: Path) -> None:
    def matrix(out: str, talker: str, *more: str) -> np.ndarray:
        assert report(out, *more, talker=talker) == 0
        rows = list(csv.reader(Path(out).read_text().splitlines()))
        return np.array([row[-(len(rows) - 1) :] for row in rows[1:]], float)

    one, two = matrix("1.csv", "made.talker"), matrix("2.csv", "other.talker")
    both = matrix("3.csv", "made.talker", "--compare", "other.talker")
    np.testing.assert_allclose(both, one - two, atol=1.6e-4)  # each is rounded to four digits


@pytest.mark.parametrize(
    ("talker", "out", "more", "reason"),
    [
        ("nobody", "r.html", (), "there is no talker 'nobody'"),
        ("missing.talker", "r.html", (), "no talker file missing.talker"),
        ("poor.talker", "r.html", (), "3 phones and 3 of them 20 times or more"),
        ("short.talker", "r.html", (), "9 phones and 0 of them 20 times or more"),
        ("made.talker", "r.pdf", (), "a report is written as .html, .csv, .json, .png, not r.pdf"),
        ("made.talker", "nowhere/r.html", (), "there is no folder nowhere"),
        ("made.talker", "r.html", ("--classes", "4,10"), "9 phones cannot make 10 classes"),
        ("made.talker", "r.html", ("--classes", "1"), "9 phones cannot make 1 classes; give a number from 2 to 9"),
        ("made.talker", "r.html", ("--classes", "four"), "--classes must be whole numbers separated by commas"),
        ("made.talker", "r.html", ("--halves", "1"), "at least 2 random halves, not 1"),
        ("made.talker", "r.html", ("--classes", "4,2.5"), "--classes must be whole numbers separated by commas"),
        ("made.talker", "r.html", ("--halves", "2.5"), '"2.5" is not a whole number'),
        ("made.talker", "r.html", ("--seed", "0.5"), '"0.5" is not a whole number'),
        ("made.talker", "r.html", ("--seed", "-1"), "a seed is a whole number from 0, not -1"),
        ("made.talker", "r.html", ("--labels", "sampa"), "labelled in ipa, arpabet or both, not 'sampa'"),
        ("made.talker", "r.html", ("--compare", "nobody"), "there is no talker 'nobody'"),
        ("made.talker", "r.html", ("--compare", "strange.talker"), "0 phones in common"),
        ("made.talker", "r.html", ("--compare", "poor.talker"), "the talker poor.talker has"),
    ],
)
def test_errors_are_one_sentence_and_nothing_is_written(
    talker: str, out: str, more: tuple[str, ...], reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["report", "similarity", talker, "--out", out, *more]) == 2
    message = capsys.readouterr().err
    assert re.search(re.escape(reason), message)
    assert message.count("\n") == 1
    assert not Path(out).exists()
