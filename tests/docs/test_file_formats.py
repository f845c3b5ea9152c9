"""The examples of docs/file-formats.md are read by the readers of the files that they describe."""

import json
import re
from pathlib import Path

import pytest

from lexicon.dictionary import read_dictionary
from lexicon.text_marks import parse_marks
from tests.docs.blocks import DOCS, code_blocks
from tts2face.gestures.timeline import parse_style
from tts2face.gestures.timeline_file import parse_timeline
from tts2face.models.palette import Palette
from tts2face.models.palette_file import load_palette
from tts2face.models.talker_file import load_talker
from tts2face.request import Request
from tts2face.session.prepared import prepare
from tts2face.session.project_file import load_project, project_json

PAGE = DOCS / "file-formats.md"
STYLE_MARK = re.compile(r"\[style:([a-z][^\]]*)\]")


@pytest.fixture(scope="module")
def palette() -> Palette:
    return load_palette("starter")


def test_timelines_are_read_and_name_styles_that_exist(palette: Palette) -> None:
    examples = [example for example in code_blocks(PAGE, "json") if '"format"' not in example]
    assert examples
    for example in examples:
        named = parse_timeline(example).style_names
        assert named
        assert set(named) <= set(palette.names)


def test_a_project_is_read_and_prepared(tmp_path: Path) -> None:
    (example,) = (example for example in code_blocks(PAGE, "json") if '"format"' in example)
    (tmp_path / "scene.json").write_text(example, encoding="utf-8")
    project = load_project(tmp_path / "scene.json")
    assert project.prepare().dictionary["maps"]
    assert project.excluded[0].utterance in {utterance.name for utterance in load_talker("grid_s1").utterances}
    written = project_json(project, tmp_path)
    assert {key: written[key] for key in json.loads(example) if key != "timeline"} == {
        key: value for key, value in json.loads(example).items() if key != "timeline"
    }


def test_marks_name_styles_that_exist(palette: Palette) -> None:
    page = PAGE.read_text(encoding="utf-8")
    named = [style for mark in STYLE_MARK.findall(page) for style in parse_style(mark).values()]
    assert named
    assert set(named) <= set(palette.names)


@pytest.mark.parametrize("mark", ["[pause 0.4]", "[nod]", "[nod 0.5]", "[style:delighted] ... [/style]"])
def test_marks_of_the_table_are_marks(mark: str) -> None:
    assert f"`{mark}`" in PAGE.read_text(encoding="utf-8")
    assert "[" not in parse_marks(f"Well, {mark} hello.").text


def test_ssml_is_prepared() -> None:
    examples = code_blocks(PAGE, "xml")
    assert examples
    for example in examples:
        prepared = prepare(Request(text=example.strip()))
        assert "hello there" in prepared.text.text
        assert len(prepared.text.marks) >= 3  # a pause, given phones, a named mark


def test_dictionaries_are_read(tmp_path: Path) -> None:
    (example,) = code_blocks(PAGE, "text")
    path = tmp_path / "words.txt"
    path.write_text(example, encoding="utf-8")
    assert set(read_dictionary(path).entries) == {"gif", "tomato"}
