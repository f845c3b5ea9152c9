"""Project files: everything is written and read back, and what is wrong is named."""

import json
from itertools import product
from pathlib import Path
from typing import Any, get_args

import pytest

from lexicon.errors import DataError, InputError
from tests.gestures.test_key_curves import WHOLE
from tts2face.gestures.timeline_file import timeline_json
from tts2face.lips.options import ExcludedToken
from tts2face.picture.options import Picture
from tts2face.request import Request, option_fields
from tts2face.session.corrections import SentenceEdges
from tts2face.session.named_models import Models
from tts2face.session.project import Project
from tts2face.session.project_file import load_project, project_json, save_project

VALUES = (
    None, True, False, -1, 0, 1, 2.5, -0.5, 1e308, 2**31, 10**300, "", "x", "1", "a\0b", "x" * 5000, [], [[]],
    [1, 2, 3], {}, {"x": 1},
)  # fmt: skip


@pytest.fixture
def whole(tmp_path: Path) -> Project:
    (tmp_path / "speech.wav").write_bytes(b"RIFF")
    return Project(
        name="Scène 1",
        request=Request(text="Tea for two.", audio=tmp_path / "speech.wav", seed=3, style="delighted"),
        models=Models(identity="kofi", hair="bob02"),
        picture=Picture(size="320x320"),
        timeline=WHOLE,
        pronunciations={"two": "T UW1", "tea": "/tiː/"},
        edges=(SentenceEdges("", 0, ("t", "i"), (0.0, 0.1, 0.3)),),
        excluded=(ExcludedToken("bbaf2n", 0.48),),
        muted=frozenset({"brows"}),
        solo=frozenset({"head", "brows"}),
    )


def test_a_project_is_read_back_as_it_was(whole: Project, tmp_path: Path) -> None:
    save_project(whole, tmp_path / "one.json")
    back = load_project(tmp_path / "one.json")
    for name in ("name", "request", "models", "picture", "pronunciations", "edges", "excluded", "muted", "solo"):
        assert getattr(back, name) == getattr(whole, name), name
    assert timeline_json(back.timeline) == timeline_json(whole.timeline)


def test_paths_are_relative_to_the_folder_of_the_project(whole: Project, tmp_path: Path) -> None:
    save_project(whole, tmp_path / "one.json")
    assert json.loads((tmp_path / "one.json").read_text(encoding="utf-8"))["request"]["audio"] == "speech.wav"
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    for name in ("one.json", "speech.wav"):
        (tmp_path / name).rename(moved / name)
    assert load_project(moved / "one.json").request.audio == moved / "speech.wav"


def test_defaults_are_not_written(tmp_path: Path) -> None:
    assert project_json(Project(request=Request(text="Hi.")), tmp_path) == {
        "format": "tts2face project",
        "version": 2,
        "name": "untitled",
        "request": {"text": "Hi."},
    }


def test_projects_of_version_1_show_the_face_that_was_the_default_then(tmp_path: Path) -> None:
    for version, models, face in ((1, {}, "head"), (1, {"face": "cartoon"}, "cartoon"), (2, {}, "ada")):
        path = tmp_path / "old.json"
        content = {"format": "tts2face project", "version": version, "models": models}
        path.write_text(json.dumps(content), encoding="utf-8")
        assert load_project(path).models.face == face


def test_silent_features_are_the_muted_and_those_that_are_not_solo(whole: Project) -> None:
    assert whole.silent_features == {"expression", "brows", "blink", "cheeks", "gaze"}
    assert Project(muted=frozenset({"gaze"})).silent_features == {"gaze"}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"format": "x"}, "is not a project"),
        ({"version": 3}, "has version 3; this program reads version 2"),
        ({"colour": 1}, "there is no 'colour' here; choose format, version"),
        ({"name": ""}, r"wrong\.json: a project needs a name of 1 to 200 characters"),
        ({"request": {"speed": 2}}, "request: there is no option 'speed'; choose"),
        ({"request": {"rate": 9}}, "request: rate must lie between 0.5 and 2, not 9"),
        ({"request": {"rate": "fast"}}, r'^\S*wrong\.json, request: rate must be a number, not "fast"'),
        ({"request": {"timeline": "t.json"}}, r"wrong\.json: a project has its own timeline"),
        ({"models": []}, r"wrong\.json: models must be an object in curly brackets, not \[\]"),
        ({"picture": {"size": "9"}}, "picture: "),
        (
            {"timeline": {"nods": [{"time": -1}]}},
            r"wrong\.json, timeline, nods\[0\]: a gesture needs a time of 0 s or more",
        ),
        ({"pronunciations": {"two": "XX"}}, "pronunciations of untitled, line 1"),
        ({"pronunciations": {"two words": "T UW1"}}, "a pronunciation is for one word, not for 'two words'"),
        ({"edges": [{"phones": ["t"], "edges": [0, 0]}]}, "edges: "),
        (
            {"edges": [{"phones": ["t"], "edges": [0, 1], "at": 1}]},
            r"edges\[0\]: there is no 'at' here; choose phones, edges",
        ),
        ({"excluded": [{"utterance": "u"}]}, r"excluded\[0\]: start is missing"),
        ({"muted": ["ears"]}, r"wrong\.json: there is no feature 'ears'"),
    ],
)
def test_projects_that_are_wrong_are_refused(change: dict, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "wrong.json"
    path.write_text(json.dumps({"format": "tts2face project", "version": 2} | change), encoding="utf-8")
    with pytest.raises(DataError, match=reason):
        load_project(path)


def is_of_type(value: Any, kind: type) -> bool:
    if isinstance(value, bool):
        return kind is bool
    return isinstance(value, {Path: str, float: int | float}.get(kind, kind))


def test_an_option_of_a_wrong_type_is_refused_by_its_name(tmp_path: Path) -> None:
    wrong = []
    for part, options in (("request", Request), ("models", Models), ("picture", Picture)):
        for option, value in product(option_fields(options), VALUES):
            kinds = (*(get_args(option.type) or (option.type,)), *((float,) if option.name == "articulation" else ()))
            content = {"format": "tts2face project", "version": 2, part: {option.name: value}}
            (tmp_path / "p.json").write_text(json.dumps(content), encoding="utf-8")
            reason = ""
            try:
                load_project(tmp_path / "p.json")
            except DataError as refused:
                reason = str(refused)
            if not any(is_of_type(value, kind) for kind in kinds) and f"{part}: {option.name} must be" not in reason:
                wrong.append((option.name, value, reason))
    assert wrong == []


def test_a_name_of_another_type_is_refused() -> None:
    with pytest.raises(InputError, match="name must be a text in quotes, not 7"):
        Project(name=7)  # type: ignore[arg-type]


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read the project"):
        load_project(tmp_path / "none.json")
