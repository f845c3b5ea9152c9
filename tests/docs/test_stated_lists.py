"""Pages state what the lists of the code hold: numbers of the README, formats of docs/exports.md."""

import re

from lexicon.gesture_names import GESTURES
from tests.docs.blocks import DOCS, README
from tts2face.interchange.exports.table import FORMATS
from tts2face.request import OWN_FACE
from tts2face.session import catalogue

NUMBERS = (
    "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve", "thirteen",
    "fourteen", "fifteen", "sixteen", "seventeen", "eighteen",
)  # fmt: skip


def test_the_readme_counts_what_is_shipped() -> None:
    faces = [one for one in catalogue.faces() if one.name != OWN_FACE]
    drawn = [one.name for one in faces if "drawn as for an animated film" in one.summary]
    filmed = [one.name for one in faces if "in film light" in one.summary]
    haircuts = [one.face for one in catalogue.haircuts() if one.name != "bald"]
    moods = [one.name for one in catalogue.styles() if one.source is not None and one.name != "measured"]
    (talker,) = catalogue.talkers()
    (each,) = {haircuts.count(name) for name in drawn}
    stated = [
        f"{NUMBERS[len(faces)]} faces. {NUMBERS[len(drawn) + len(filmed)]} are in light",
        f"{NUMBERS[len(drawn)]} drawn as for an animated film",
        f"with {NUMBERS[each]} haircuts each",
        f"{NUMBERS[len(filmed)]} people",
        f"{NUMBERS[len(catalogue.identities())]} identity presets",
        f"{NUMBERS[haircuts.count('head')]} haircuts in any colour",
        f"`{talker.name}`: lip motion of {talker.n_utterances} recorded sentences",
        f"{NUMBERS[len(moods)]} moods derived from it",
        f"some {len(catalogue.languages()) // 10 * 10} languages",
        f"{NUMBERS[len(GESTURES)]} [gestures with names]",
    ]
    stated += [f"`{one.name}`" for one in faces]
    text = " ".join(README.read_text(encoding="utf-8").partition("## What is shipped")[2].split()).lower()
    missing = [one for one in stated if one.lower() not in text]
    assert not missing, f"README.md, What is shipped: write {', '.join(missing)}"


def test_the_page_of_gestures_has_a_row_for_each_name() -> None:
    page = (DOCS / "gestures.md").read_text(encoding="utf-8").partition("## Named gestures")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)` \| (.+?) \| ([\d.]+) \| ?(.*?) ?\|$", page, re.MULTILINE)
    directions = {"none": "", "side": "left, right", "any": "any"}
    assert rows == [
        (name, gesture.shown, f"{gesture.seconds:g}", directions[gesture.directions])
        for name, gesture in GESTURES.items()
    ]


def test_the_page_of_exports_has_a_row_for_each_format() -> None:
    table = re.findall(r"^\| (\S.*?) \| (`\..*?) \|", (DOCS / "exports.md").read_text(encoding="utf-8"), re.MULTILINE)
    rows = {tuple(names.split(", ")): set(re.findall(r"`(.+?)`", endings.lower())) for names, endings in table}
    written = [name for names in rows for name in names]
    missing, left = ({one.name for one in FORMATS} - {*written}, {*written} - {one.name for one in FORMATS})
    assert not missing, f"docs/exports.md: add a row for {', '.join(missing)}"
    assert not left, f"docs/exports.md: remove the row of {', '.join(left)}"
    assert len(written) == len(set(written))
    for names, endings in rows.items():
        assert endings == {suffix for one in FORMATS if one.name in names for suffix in one.suffixes}, names
