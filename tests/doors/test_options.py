"""Unknown options, invalid output names, and the time that --help takes."""

import json
import os
import struct
import zlib
from pathlib import Path

import pytest
from cyclopts import App

from cli.flags import check_options, join_values
from cli.main import app, run
from lexicon.errors import InputError
from tests.world import World
from tts2face.picture.film import check_output
from tts2face.storage.output_paths import check_name


@pytest.mark.parametrize(
    ("words", "option", "near"),
    [
        (["--quite", "--out", "x.mp4"], "--quite", "--quiet"),
        (["--list-voices"], "--list-voices", "--voice"),
        (["Hi.", "--out", "x.mp4", "--bakground=red"], "--bakground", "--background"),
        (["Hi.", "--no-gesture", "--out", "x.mp4"], "--no-gesture", "--no-gestures"),
        (["Hi.", "-O", "x.mp4"], "-O", None),
        (["--help-me"], "--help-me", "--help"),
        (["-- he said", "--out", "x.mp4"], "-- he said", None),
        (["phones", "--formt", "json", "Hi."], "--formt", "--format"),
        (["mimic", "take.mp4", "--quite"], "--quite", "--quiet"),
        (["corpus", "build", "recordings", "--raport", "r.html"], "--raport", "--report"),
        (["voices", "--jsn"], "--jsn", "--json"),
    ],
)
def test_a_mistyped_option_is_not_read_as_text(
    words: list[str], option: str, near: str | None, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(words) == 2
    hint = f"did you mean {near}? " if near else ""
    expected = f"tts2face: there is no option {option}; {hint}Put text that begins with a hyphen after --\n"
    assert capsys.readouterr().err == expected
    assert not list(here.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ["--out", "x.mp4", "--", "--quite"],
        ["-5 degrees", "--out", "x.mp4"],
        ["- well", "--out=x.mp4", "-o", "y.mp4", "--no-gestures", "--transcript", "a.txt"],
        ["Hi.", "--camera", "-30,10", "--text", "b"],
        ["--help", "--quite"],
        ["corpus", "--version"],
    ],
)
def test_known_options_and_text_with_a_dash_pass(words: list[str]) -> None:
    check_options(app, words)


def test_text_after_two_dashes_is_synthesised(tones: World, here: Path) -> None:
    assert run([*tones.flags, "--explain", "why.json", "--quiet", "--", "--bob"]) == 0
    shown = json.loads((here / "why.json").read_text(encoding="utf-8"))
    assert [phone["phone"] for phone in shown if phone["phone"] != "sil"] == ["b", "ɑ", "b"]


@pytest.mark.parametrize(
    ("words", "code", "reason"),
    [
        (["Hi.", "--out", "x" * 300 + ".mp4"], 2, "has 304 bytes; use at most"),
        (["Hi.", "--out", "ä" * 125 + ".mp4"], 2, "has 254 bytes; use at most"),
        (["Hi.", "--out", "y" * 300 + "/x.mp4"], 2, "File name too long; choose another folder"),
        (["Hi.", "--out", ".mp4"], 2, ".mp4 is only a suffix; put a name before it, such as clip.mp4"),
        (["Hi.", "--out", ".webm"], 2, ".webm is only a suffix"),
        (["Hi.", "--out", "x.mp4", "--explain", "no/e.json"], 2, "no folder no to write e.json to"),
        (["Hi.", "--out", "x.mp4", "--explain", ".json"], 2, ".json is only a suffix"),
        (["Hi.", "--out", "x.mp4", "--explain", "e.xml"], 2, "an explanation is written as .json, .txt, not e.xml"),
        (["Hi.", "--explain", "folder.json"], 2, "folder.json is a folder"),
        (["corpus", "build", "folder.json", "--out", "a.talker", "--report", "no/r.html"], 2, "no folder no"),
        (
            ["corpus", "build", "folder.json", "--out", "a.talker", "--report", "r.pdf"],
            2,
            "a report is written as",
        ),
        (["corpus", "build", "folder.json", "--out", "no/a.talker"], 2, "no folder no"),
        (["corpus", "evaluate", "--recordings", "folder.json", "--out", "no/a.html"], 2, "no folder no"),
        (["Hi.", "--talker", "t" * 300, "--out", "x.mp4"], 2, "File name too long; check the path"),
        (["--audio", "t" * 300, "--out", "x.mp4"], 2, "File name too long; check the path"),
        (["Hi.", "--dictionary", "/dev/zero", "--out", "x.mp4"], 3, "/dev/zero is a device, not a file"),
        (["Hi.", "--timeline", "/dev/zero", "--out", "x.mp4"], 3, "/dev/zero is a device, not a file"),
        (["--file", "/dev/zero", "--out", "x.mp4"], 2, "/dev/zero contains more than"),
        (["Hi.", "--timeline", "digits.json", "--out", "x.mp4"], 3, "a number of 5000 characters is too long"),
        (
            ["Hi.", "--background", "bomb.png", "--out", "x.mp4"],
            3,
            "image bomb.png is too large; at most 100 million",
        ),
        (["Hi.", "--background", "huge.png", "--out", "x.mp4"], 3, "huge.png has 11000 x 11000 pixels; at most 100"),
        (["Hi.", "--language", "germn", "--out", "x.mp4"], 2, "there is no language 'germn'; did you mean de (German)"),
        (["<speak xml:lang='xx'>Hi.</speak>", "--out", "x.mp4"], 2, "there is no language 'xx'"),
    ],
)
def test_what_cannot_be_done_is_refused_before_work_begins(
    words: list[str], code: int, reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "folder.json").mkdir()
    (here / "digits.json").write_text('{"gains": {"head": ' + "1" * 5000 + "}}")
    if "bomb.png" in words:
        (here / "bomb.png").write_bytes(black_png(20_000))
    if "huge.png" in words:
        (here / "huge.png").write_bytes(black_png(11_000))
    before = set(here.iterdir())
    assert run(words) == code
    message = capsys.readouterr().err
    assert reason in message
    assert len(message.strip().splitlines()) == 1
    assert set(here.iterdir()) == before


def black_png(side: int) -> bytes:
    """A black PNG of one bit a pixel, which Pillow would hold in memory eight times as large before it writes it."""
    parts = {
        b"IHDR": struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0),
        b"IDAT": zlib.compress(bytes(side * (side // 8 + 1)), 1),
    }
    chunks = [
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in {**parts, b"IEND": b""}.items()
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def test_the_longest_name_can_be_written(here: Path) -> None:
    longest = os.pathconf(here, "PC_NAME_MAX") - 16
    assert check_output(here / ("x" * (longest - 4) + ".mp4")).suffix == ".mp4"
    with pytest.raises(InputError, match=f"has {longest + 1} bytes; use at most {longest}"):
        check_name(here / ("x" * (longest + 1)))
    assert check_output(here / ".frames_of_mine").name == ".frames_of_mine"


@pytest.mark.parametrize(
    ("text", "language"),
    [
        ("<speak xml:lang='de-DE'><p xml:lang='de'>Hallo.</p></speak>", "German"),
        ("<speak xml:lang='zh-CN'>你好</speak>", "Chinese"),
        ("<speak xml:lang='en-GB'>Hello.</speak>", "EN"),
        ("Hallo.", "de_DE.UTF-8"),
    ],
)
def test_languages_are_accepted_in_any_spelling(text: str, language: str, world: World, here: Path) -> None:
    words = [text, "--language", language, "--voice", "espeak", *world.models, "--explain", "why.txt", "--quiet"]
    assert run(words) == 0
    assert (here / "why.txt").stat().st_size > 0


def test_every_option_of_every_command_takes_a_value_that_begins_with_a_hyphen() -> None:
    commands: list[tuple[list[str], App]] = [([], app)]
    n_options = 0
    for words, command in commands:
        commands += [([*words, name], command[name]) for name in command if not name.startswith("-")]
        if command.default_command is None:
            continue
        arguments = command.assemble_argument_collection()
        options = [a.name for a in arguments if a.token_count()[0] and a.name.startswith("--")]
        values = ["-1", "-60,20,400", "-.5"] * len(options)
        given = [*words, *(word for pair in zip(options, values, strict=False) for word in pair)]
        check_options(app, given)
        expected = [f"{option}={value}" for option, value in zip(options, values, strict=False)]
        assert join_values(app, given) == [*words, *expected]
        n_options += len(options)
    assert n_options > 300


@pytest.mark.parametrize(
    "words",
    [
        ["Hi.", "--quiet", "-5,4"],  # a switch has no value
        ["--out", "x.mp4", "--", "--camera", "-60,20"],
        ["Hi.", "--camera", "--out", "x.mp4"],
        ["Hi.", "--camera", "-o", "x.mp4"],
        ["--file", "-"],
        ["-60,20 degrees"],
        ["corpus"],
    ],
)
def test_only_values_are_joined_to_options(words: list[str]) -> None:
    assert join_values(app, words) == words


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--camera", "-60,20,40"], "camera '-60,20,40' is out of range; yaw is"),
        (["--seed", "-1"], "seed must be 0 or more, not -1"),
        (["--size", "-64x64"], "size must be width x height such as 640x480, not '-64x64'"),
        (["--rate", "-1,2"], 'unable to convert "-1,2" into float'),
        (["--camrea", "-60,20"], "there is no option --camrea; did you mean --camera?"),
        (["--camera", "--quiet"], "--camera requires an argument"),
    ],
)
def test_a_value_with_a_hyphen_is_refused_as_a_value(
    words: list[str], reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["Hi.", *words, "--out", "x.mp4"]) == 2
    assert reason in capsys.readouterr().err
    assert not list(here.iterdir())
