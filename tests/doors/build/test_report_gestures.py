"""``tts2face report gestures``: every kind of file, every option, every refusal."""

import csv
import json
import re
from itertools import product
from pathlib import Path

import pytest
from PIL import Image

from cli.main import run
from corpus_tools.studies.gestures.gaze import TRAITS
from corpus_tools.studies.plots import SERIES
from tests.corpus_tools.gesture_study.made_gaze import write_people
from tests.corpus_tools.gesture_study.made_palette import made_palette
from tts2face.models.gaze import STATES
from tts2face.models.palette_file import write_palette

pytestmark = pytest.mark.needs("matplotlib")
N_RECORDINGS = 20  # three seconds each


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("palettes") / "made.palette"
    write_palette(file, made_palette(N_RECORDINGS))
    return file


@pytest.fixture(scope="module")
def plain(made: Path) -> bytes:
    out = made.with_name("g.csv")
    assert run(["report", "gestures", str(made), "--out", str(out)]) == 0
    return out.read_bytes()


@pytest.fixture
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "made.palette").symlink_to(made)
    return tmp_path


def report_bytes(out: str, *more: str) -> bytes:
    assert run(["report", "gestures", "made.palette", "--out", out, *more]) == 0
    return Path(out).read_bytes()


def test_the_page_is_complete_and_loads_nothing(here: Path) -> None:
    html = report_bytes("g.html").decode()
    for heading in ("calm", "quick"):
        assert f"<h2>{heading}</h2>" in html
    for heading, n in (("Distributions", 2), ("Spectra, sound, seeds", 2), ("Clips of 10 minutes", 1)):
        assert html.count(f"<h3>{heading}</h3>") == n
    assert "Calm with a larger head and faster blinks." in html
    assert f"{N_RECORDINGS * 4 // 5} training recordings, {N_RECORDINGS // 5} held out." in html
    assert not re.search(r"http|<(script|link|img)|url\((?!#)|@import|\bnan\b", html)
    # of each style 10 distributions and 2 spectra; of the measured one 3 of repetition
    assert html.count("<svg") == html.count("</svg>") == 2 * (10 + 2) + 3
    assert html.count(">ju2008</text>") == 10 + 2  # of the measured style alone
    assert html.count("<th class=n>W ju2008</th>") == 2
    assert html.count("<td>met</td>") + html.count("<td>missed</td>") == 4


def test_the_table_has_a_line_a_trait(plain: bytes) -> None:
    rows = list(csv.DictReader(plain.decode().splitlines()))
    assert len(rows) == 20
    assert {row["style"]: row["source"] for row in rows} == {"calm": "", "quick": "calm"}
    assert all(float(row[name]) >= 0 for row in rows for name in ("w_halves", "w_field", "w_noise"))
    assert all((row["w_ju2008"] == "") == (row["style"] == "quick") for row in rows)
    assert {row["trait"] for row in rows if row["target"]} == {"head speed", "brow height", "blink interval"}


def test_the_json_equals_the_table(plain: bytes, here: Path) -> None:
    content = json.loads(report_bytes("g.json", "--people", str(write_people(here))))
    assert [(one["state"], one["trait"]) for one in content["gaze"]] == [*product(STATES, TRAITS)]
    assert all(0 <= one["made"] <= 1 for one in content["gaze"])
    rows = list(csv.DictReader(plain.decode().splitlines()))
    weights = [
        (style["name"], trait["name"], trait["field"]) for style in content["styles"] for trait in style["traits"]
    ]
    assert weights == [(row["style"], row["trait"], float(row["w_field"])) for row in rows]
    calm = content["styles"][0]
    assert [trait["ju2008"] for trait in calm["traits"]] == [float(row["w_ju2008"]) for row in rows[:10]]
    assert set(calm["features"][0]["power"]) == set(calm["blinks_per_minute"]) == {"real", "field", "noise", "ju2008"}
    assert calm["blinks_per_minute"]["real"] == pytest.approx(60)
    assert set(calm["repetition"]) == {"brows", "blink", "head"}
    assert set(calm["visited"]["head"]) == {"1 min", "3 min", "10 min"}
    assert {len(feature["power"]["field"]) for feature in calm["features"]} == {33}


def test_the_picture_shows_the_main_plots(here: Path) -> None:
    assert report_bytes("g.PNG").startswith(b"\x89PNG")
    with Image.open("g.PNG") as image:
        assert image.size == (2 * 3 * 380, 2 * (2 * 250 + 26))
        colours = {colour for _, colour in image.convert("RGB").getcolors(1 << 20)}
    assert {tuple(bytes.fromhex(colour[1:])) for colour, _ in SERIES[:4]} <= colours


@pytest.mark.parametrize("option", [("--held-out", "4"), ("--halves", "9"), ("--clips", "2"), ("--seed", "7")])
def test_each_option_changes_what_is_written(option: tuple[str, str], plain: bytes, here: Path) -> None:
    assert report_bytes("g.csv", *option) != plain


def test_the_same_options_write_the_same(plain: bytes, here: Path) -> None:
    assert report_bytes("g.csv", "--held-out", "5", "--halves", "50", "--clips", "3", "--seed", "0") == plain


@pytest.mark.parametrize(
    ("palette", "out", "more", "reason"),
    [
        ("nobody", "g.html", (), "there is no palette 'nobody'"),
        ("missing.palette", "g.html", (), "missing.palette"),
        ("made.palette", "g.pdf", (), "a report is written as .html, .csv, .json, .png, not g.pdf"),
        ("made.palette", "nowhere/g.html", (), "there is no folder nowhere"),
        ("made.palette", "g.html", ("--held-out", "1"), "one in 1 recordings cannot be held out"),
        ("made.palette", "g.html", ("--held-out", "50"), f"of {N_RECORDINGS} recordings one in 50 cannot be held out"),
        ("made.palette", "g.html", ("--held-out", "2.5"), '"2.5" is not a whole number'),
        ("made.palette", "g.html", ("--people", "."), "there are no recordings of gaze in .; give the folder"),
        ("made.palette", "g.html", ("--halves", "0"), "at least 1 halving, not 0"),
        ("made.palette", "g.html", ("--halves", "0.5"), '"0.5" is not a whole number'),
        ("made.palette", "g.html", ("--clips", "1"), "at least 2 clips, not 1"),
        ("made.palette", "g.html", ("--clips", "x"), '"x" is not a whole number'),
        ("made.palette", "g.html", ("--seed", "-1"), "a seed is a whole number from 0, not -1"),
        ("made.palette", "g.html", ("--seed", "0.5"), '"0.5" is not a whole number'),
    ],
)
def test_errors_are_one_sentence_and_nothing_is_written(
    palette: str, out: str, more: tuple[str, ...], reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["report", "gestures", palette, "--out", out, *more]) == 2
    message = capsys.readouterr().err
    assert re.search(re.escape(reason), message)
    assert message.count("\n") == 1
    assert not Path(out).exists()
