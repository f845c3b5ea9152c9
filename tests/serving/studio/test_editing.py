"""Edits of projects: what each changes, and what is refused."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from lexicon.errors import DataError, InputError
from lexicon.sequence import PhoneSequence
from tts2face.gestures.elements import GazeTarget, Gesture, ListeningSpan, StyleSpan
from tts2face.gestures.kinds import KINDS
from tts2face.lips.options import ExcludedToken
from tts2face.models.palette import FEATURES
from tts2face.request import Request
from tts2face.serving.studio.editing import EDITS, MIN_PHONE_S, apply
from tts2face.session.named_models import Models
from tts2face.session.project import Project

PROJECT = Project(request=Request(text="Bob may move."))
SENTENCE = ("Bob may move.", 0)
PHONES = PhoneSequence(("sil", "b", "ɑ", "b", "sil"), (0.0, 0.1, 0.2, 0.4, 0.415, 0.6))


def edited(project: Project, *edits: Mapping[str, Any]) -> Project:
    for edit in edits:
        project = apply(project, edit, {SENTENCE: PHONES})
    return project


def paint(feature: str, style: str, start: float, end: float | None) -> dict[str, Any]:
    return {"kind": "paint", "feature": feature, "style": style, "start": start, "end": end}


def spans(project: Project, feature: str) -> list[tuple[str, float, float]]:
    return [(one.style, one.start, one.end) for one in project.timeline.spans if one.feature == feature]


def test_paint_replaces_what_it_covers_in_its_lane_only() -> None:
    project = edited(PROJECT, paint("brows", "sad", 0, 4), paint("head", "sad", 0, 4), paint("brows", "glad", 1, 2))
    assert spans(project, "brows") == [("sad", 0, 1), ("glad", 1, 2), ("sad", 2, 4)]
    assert spans(project, "head") == [("sad", 0, 4)]


def test_all_features_are_painted_at_once_and_to_the_end() -> None:
    project = edited(PROJECT, paint("all", "glad", 1, None))
    assert {one.feature for one in project.timeline.spans} == set(FEATURES)
    assert {one.end for one in project.timeline.spans} == {math.inf}


def test_erase_cuts_a_hole() -> None:
    project = edited(PROJECT, paint("brows", "sad", 0, 4), {"kind": "erase", "feature": "brows", "start": 1, "end": 2})
    assert spans(project, "brows") == [("sad", 0, 1), ("sad", 2, 4)]
    assert spans(edited(project, {"kind": "erase", "feature": "all", "start": 0, "end": None}), "brows") == []


@pytest.mark.parametrize(
    ("edit", "part"),
    [
        ({"kind": "curve", "expression": "happy"}, "curves"),
        ({"kind": "strength", "feature": "head"}, "strengths"),
        ({"kind": "channel", "channel": "jawOpen"}, "edits"),
    ],
)
def test_a_curve_is_replaced_and_removed(edit: dict[str, Any], part: str) -> None:
    first = edited(PROJECT, edit | {"keys": [[0, 0.5], [1, 1]]})
    second = edited(first, edit | {"keys": [[0.5, 0.25]]})
    (curve,) = getattr(second.timeline, part)
    assert curve == KINDS[part].record(edit[KINDS[part].owner], ((0.5, 0.25),))
    assert getattr(edited(second, edit | {"keys": []}).timeline, part) == ()


def test_nods_and_gaze_are_placed_replaced_and_removed() -> None:
    project = edited(
        PROJECT,
        {"kind": "gesture", "name": "nod", "time": 1.0, "size": 1.0},
        {"kind": "gesture", "name": "nod", "time": 1.02, "size": 0.5},
        {"kind": "gaze", "start": 0, "end": 2, "down_deg": 5, "left_deg": -10},
        {"kind": "listen", "start": -1, "end": 2}, {"kind": "listen", "start": 1, "end": 3},
    )  # fmt: skip
    assert project.timeline.gestures == (Gesture(1.02, size=0.5),)
    assert project.timeline.gaze == (GazeTarget(5, -10, 0, 2),)
    assert project.timeline.listens == (ListeningSpan(0, 1), ListeningSpan(1, 3))
    removed = ({"kind": "remove_gesture", "time": 1.03, "name": "nod"}, {"kind": "remove_gaze", "time": 0.5})
    empty = edited(project, *removed, *({"kind": "remove_listen", "time": time} for time in (0.5, 2))).timeline
    assert (empty.gestures, empty.gaze, empty.listens) == ((), (), ())
    for kind in ("gesture", "gaze", "listen"):
        with pytest.raises(InputError, match=r"at 5.00 s; click on one"):
            edited(project, {"kind": f"remove_{kind}", "time": 5, "name": "nod"})


def test_gestures_of_other_names_stay() -> None:
    look = {"kind": "gesture", "name": "look_away", "time": 1.01, "size": 1, "seconds": 2, "left_deg": -20.0}
    project = edited(PROJECT, {"kind": "gesture", "name": "nod", "time": 1.0, "size": 1}, look)
    assert project.timeline.gestures == (Gesture(1.0), Gesture(1.01, "look_away", 1.0, 2.0, None, -20.0))
    assert (
        edited(project, {"kind": "remove_gesture", "name": "nod", "time": 1}).timeline.gestures[0].name == "look_away"
    )


def test_lanes_are_muted_solo_and_seeded() -> None:
    project = edited(
        PROJECT,
        {"kind": "mute", "feature": "head", "on": True}, {"kind": "solo", "feature": "brows", "on": True},
        {"kind": "seed", "feature": "gaze", "seed": 7},
    )  # fmt: skip
    assert (project.muted, project.solo, dict(project.timeline.seeds)) == ({"head"}, {"brows"}, {"gaze": 7})
    assert edited(project, {"kind": "mute", "feature": "head", "on": False}).muted == frozenset()


@pytest.mark.parametrize(
    ("index", "time", "expected"), [(2, 0.3, 0.3), (2, 0.05, 0.1 + MIN_PHONE_S), (2, 0.9, 0.4 - MIN_PHONE_S)]
)
def test_an_edge_stays_between_its_neighbours(index: int, time: float, expected: float) -> None:
    edit = {"kind": "edge", "text": SENTENCE[0], "occurrence": 0, "index": index, "time": time}
    (made,) = edited(PROJECT, edit).edges
    assert made.phones == PHONES.phones
    assert made.edges == (*PHONES.edges[:index].tolist(), expected, *PHONES.edges[index + 1 :].tolist())
    reset = {"kind": "reset_edges", "text": SENTENCE[0], "occurrence": 0}
    assert edited(replace(PROJECT, edges=(made,)), reset).edges == ()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"index": 0}, "edge 0 of a sentence cannot move; choose one between two phones, 1 to 4"),
        ({"index": 5}, "edge 5"),
        ({"text": "Other."}, "there is no sentence 'Other.' in the clip"),
        ({"occurrence": 1}, "there is no sentence"),
    ],
)
def test_wrong_edges_are_refused(change: dict[str, Any], reason: str) -> None:
    edit = {"kind": "edge", "text": SENTENCE[0], "occurrence": 0, "index": 2, "time": 0.3}
    with pytest.raises(InputError, match=reason):
        edited(PROJECT, edit | change)


def test_an_edge_between_two_shortest_phones_is_refused() -> None:
    short = PhoneSequence(("a", "b", "sil"), (0.0, 0.008, 0.016, 0.5))
    with pytest.raises(InputError, match="too short to move"):
        apply(PROJECT, {"kind": "edge", "text": "x", "occurrence": 0, "index": 1, "time": 0.01}, {("x", 0): short})


def test_a_word_gets_phones_and_loses_them() -> None:
    project = edited(PROJECT, {"kind": "pronounce", "word": "tomato", "phones": "T AH0 M EY1 T OW2"})
    project = edited(project, {"kind": "pronounce", "word": "Tomato", "phones": "/təmɑtoʊ/"})
    assert dict(project.pronunciations) == {"Tomato": "/təmɑtoʊ/"}
    assert not edited(project, {"kind": "pronounce", "word": "TOMATO", "phones": " "}).pronunciations
    with pytest.raises(DataError, match="QQ"):
        edited(PROJECT, {"kind": "pronounce", "word": "tomato", "phones": "QQ"})


def test_an_example_is_excluded_used_again_and_forgotten_with_its_talker() -> None:
    edit = {"kind": "exclude", "utterance": "lgir9s", "start": 1.5, "on": True}
    project = edited(PROJECT, edit, edit)
    assert project.excluded == (ExcludedToken("lgir9s", 1.5),)
    assert edited(project, edit | {"on": False}).excluded == ()
    assert edited(project, {"kind": "models", "options": {"hair": "bald"}}).excluded == project.excluded
    assert edited(project, {"kind": "models", "options": {"talker": "other"}}).excluded == ()


def test_options_change_alone() -> None:
    project = edited(
        PROJECT,
        {"kind": "request", "options": {"rate": 1.2, "voice": "espeak"}},
        {"kind": "models", "options": {"hair": "bald"}},
        {"kind": "picture", "options": {"size": "640x480"}}, {"kind": "name", "name": " New "},
    )  # fmt: skip
    assert (project.request, project.models) == (
        Request(text="Bob may move.", rate=1.2, voice="espeak"), Models(face="ada", hair="bald"),
    )  # fmt: skip
    assert (project.picture.size, project.name) == ("640x480", "New")


@pytest.mark.parametrize(
    ("edit", "reason"),
    [
        ({}, "there is no edit 'None'; choose one of paint, erase"),
        ({"kind": "explode"}, "there is no edit 'explode'"),
        (paint("head", "glad", 0, 1) | {"end": "late"}, "end of the edit paint must be a number"),
        ({"kind": "paint", "style": "glad", "start": 0, "end": 1}, "the edit paint needs feature"),
        (paint("nose", "glad", 0, 1), "there is no feature 'nose'"),
        (paint("head", "glad", 2, 1), "must end after it begins"),
        ({"kind": "seed", "feature": "head", "seed": 1.5}, "seed of the edit seed must be a whole number"),
        ({"kind": "seed", "feature": "head", "seed": True}, "must be a whole number"),
        ({"kind": "mute", "feature": "head", "on": 1}, "on of the edit mute must be true or false"),
        ({"kind": "strength", "feature": "head", "keys": [[0, "a"]]}, "keys must be a list of"),
        ({"kind": "strength", "feature": "head", "keys": [[0, 9]]}, "the strength of head"),
        ({"kind": "gesture", "name": "nod", "time": math.nan, "size": 1}, "time of the edit gesture must be a number"),
        ({"kind": "gesture", "name": "wave", "time": 1, "size": 1}, "there is no gesture 'wave'; choose nod"),
        ({"kind": "gesture", "name": "nod", "time": 1, "size": 1, "seconds": "2"}, "seconds of the edit gesture must"),
        ({"kind": "request", "options": {"speed": 2}}, "there is no option 'speed'"),
        ({"kind": "request", "options": {"rate": "fast"}}, "rate must be a number"),
        ({"kind": "request", "options": {"rate": 9}}, "rate"),
        ({"kind": "request", "options": {"text": None}}, "text must be a text"),
        ({"kind": "request", "options": {"text": ["a"]}}, "text must be a text in quotes, not"),
        ({"kind": "name", "name": " "}, "a project needs a name"),
    ],
)  # fmt: skip
def test_wrong_edits_are_refused_with_their_reason(edit: dict[str, Any], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        edited(PROJECT, edit)


def test_every_kind_of_edit_is_tested() -> None:
    assert set(EDITS) == {
        "paint", "erase", "curve", "strength", "channel", "gesture", "remove_gesture", "gaze", "remove_gaze", "listen",
        "remove_listen", "mute", "solo", "seed", "edge", "reset_edges", "pronounce", "exclude", "request", "models",
        "picture", "name",
    }  # fmt: skip


def test_an_edit_leaves_the_project_as_it_was() -> None:
    before = edited(PROJECT, paint("brows", "sad", 0, 4))
    edited(before, paint("brows", "glad", 1, 2))
    assert before.timeline.spans == (StyleSpan("brows", "sad", 0, 4),)
