"""Streams of characters hold weights in the characters' own names, and those of gaze that they lack."""

import json
from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import tts2face
from tts2face.interchange.characters.binding import KEY, CharacterBinding, has_binding, shape_mapping, without_file
from tts2face.interchange.characters.own_weights import own_names
from tts2face.interchange.characters.shapes import ShapeMapping, ShapeSource, with_sides
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.models.face import Face
from tts2face.processes.message import MORE, Message
from tts2face.serving.service.live import LiveTask
from tts2face.serving.service.live_motion import GAZE, Projection
from tts2face.serving.service.messages import Line, Work
from tts2face.session.session import Session
from tts2face.types import Trajectory

HEAD = tts2face.load_face("head")
PREFIXED = {name: (ShapeSource(f"Wolf3D.{name}"),) for name in HEAD.shape_names if "eyeLook" not in name}
VOWELS = {"jawOpen": (ShapeSource("A", 0.5),), "mouthPucker": (ShapeSource("U"), ShapeSource("O", 0.25))}
BOTH = with_sides({name: (ShapeSource("Smile"),) for name in ("mouthSmileLeft", "mouthSmileRight")})
LOUD = {"jawOpen": (ShapeSource("Fcl_MTH_A", 2.0),)}


def character(mapping: ShapeMapping) -> Face:
    """The shipped head as if it had been imported from a character whose shapes have other names."""
    binding = CharacterBinding("/there/avatar.glb", "0" * 64, 0.0, 1.0, (0.0, 0.0, 0.0), mapping)
    return replace(HEAD, metadata=without_file({"name": "avatar", KEY: binding.as_metadata()}))


def posed(**weights: float) -> Trajectory:
    values = np.zeros((2, len(HEAD.shape_names)), np.float32)
    for name, weight in weights.items():
        values[1, HEAD.shape_names.index(name)] = weight
    return Trajectory(HEAD.shape_names, values, 30.0)


@pytest.mark.parametrize(
    ("mapping", "pose", "expected"),
    [
        (PREFIXED, {"jawOpen": 0.4, "browInnerUp": 0.2}, {"Wolf3D.jawOpen": 0.4, "Wolf3D.browInnerUp": 0.2}),
        (VOWELS, {"jawOpen": 0.6, "mouthPucker": 0.8}, {"A": 0.3, "U": 0.8, "O": 0.2}),
        (BOTH, {"mouthSmileLeft": 0.8, "mouthSmileRight": 0.4}, {"Smile": 0.6}),
        (LOUD, {"jawOpen": 0.9}, {"Fcl_MTH_A": 1.8}),
        (PREFIXED, {"eyeLookUpLeft": 0.7}, {"eyeLookUpLeft": 0.7}),
    ],
    ids=["prefixed", "weighted sums", "both sides", "gain", "gaze that it lacks"],
)
def test_weights_have_the_names_of_the_character(
    mapping: ShapeMapping, pose: dict[str, float], expected: dict[str, float]
) -> None:
    projection = Projection(Session(face=character(mapping), palette=None))
    assert projection.names == (*own_names(mapping), *GAZE)
    rows = projection.frames(posed(**pose))
    assert not rows[0].any()
    found = {name: float(weight) for name, weight in zip(projection.names, rows[1], strict=True) if weight}
    assert found == pytest.approx(expected, abs=1e-5)


def test_motion_of_shapes_that_it_lacks_is_carried_by_its_own() -> None:
    projection = Projection(Session(face=character(VOWELS), palette=None))
    weights = projection.frames(posed(mouthLowerDownLeft=0.5, mouthLowerDownRight=0.5))[1]
    assert weights[projection.names.index("A")] > 0.005


def test_a_face_that_is_no_character_keeps_the_names_of_arkit() -> None:
    assert Projection(Session(palette=None)).names == ARKIT_SHAPES


def test_a_stream_names_its_weights_in_the_first_event() -> None:
    session = Session(face=character(PREFIXED), palette=None)
    inputs = deque([Message(MORE, {"type": "say", "text": "Yes."}), Message(MORE, {"type": "end"})])
    steps = LiveTask(session, Work(kind="live", request={"with_idle": False}), inputs).steps()
    events: list[Any] = [json.loads(step.content) for step in steps if isinstance(step, Line)]
    curves = [event for event in events if event["type"] == "curves"]
    assert curves[0]["names"] == [*own_names(PREFIXED), *GAZE]
    assert "names" not in (curves[1:] or [{}])[0]
    weights = np.array([row for event in curves for row in event["weights"]])
    assert weights.shape[1] == len(curves[0]["names"])
    assert weights[:, curves[0]["names"].index("Wolf3D.jawOpen")].max() > 0.05


@pytest.mark.parametrize(
    "damaged",
    [
        {"file": "/etc/passwd", "sha256": "0" * 64},
        {"mapping": {"jawOpen": [["A", "much", ""]]}},
        {"mapping": {"jawOpen": [["A", float("nan"), ""]]}},
        3,
    ],
)
def test_of_a_sent_face_only_whole_names_are_kept(damaged: Any) -> None:
    whole = character(VOWELS).metadata[KEY] | {"file": "/etc/passwd", "sha256": "1" * 64}
    kept = without_file({"name": "avatar", KEY: whole})
    assert (kept[KEY]["file"], kept[KEY]["sha256"]) == ("", "")
    assert shape_mapping(replace(HEAD, metadata=kept)) == VOWELS
    assert not has_binding(replace(HEAD, metadata=kept))
    entry = damaged if not isinstance(damaged, dict) or "file" in damaged else whole | damaged
    assert without_file({"name": "avatar", KEY: entry}) == {"name": "avatar"}
