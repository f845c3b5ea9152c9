"""What a project changes in its clip."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import InputError
from tests.tones import VOICE
from tests.world import World
from tts2face.gestures.elements import ChannelEdit
from tts2face.gestures.timeline import Timeline
from tts2face.lips.options import ExcludedToken
from tts2face.models.palette import FEATURES
from tts2face.request import Request
from tts2face.session.corrections import SentenceEdges
from tts2face.session.named_models import Models
from tts2face.session.project import Project
from tts2face.session.project_file import load_project, save_project
from tts2face.session.session import Session
from tts2face.session.speech_stream import Piece

TEXT = "Bob may move. Five maps were there. Bob may move."
PROJECT = Project(request=Request(text=TEXT, voice=VOICE))


@pytest.fixture(scope="module")
def session(tones: World) -> Session:
    return tones.session(memory_mb=100)


@pytest.fixture(scope="module")
def pieces(session: Session) -> list[Piece]:
    return list(session.stream(PROJECT.prepare()))


def moved(session: Session, project: Project) -> list[np.ndarray]:
    return [piece.clip.motion.values for piece in session.stream(project.prepare())]


def dragged(piece: Piece, occurrence: int) -> SentenceEdges:
    """The edges of a sentence with its third edge 40 ms later."""
    phones = piece.clip.speech.phones
    edges = phones.edges.copy()
    edges[3] += 0.04
    return SentenceEdges(piece.text, occurrence, phones.phones, tuple(edges.tolist()))


def test_memory_does_not_change_the_clip(session: Session, world: World) -> None:
    plain = world.session().clip(PROJECT.prepare())
    again = session.clip(PROJECT.prepare())
    np.testing.assert_array_equal(again.motion.values, plain.motion.values)
    np.testing.assert_array_equal(again.head.values, plain.head.values)
    np.testing.assert_array_equal(again.speech.waveform.samples, plain.speech.waveform.samples)


def test_a_changed_timeline_with_memory_is_the_same_as_without(
    session: Session, pieces: list[Piece], world: World
) -> None:
    painted = replace(PROJECT, request=Request(text=TEXT, voice=VOICE, style="delighted", gain="head=2"))
    np.testing.assert_array_equal(
        np.concatenate(moved(session, painted)), world.session().clip(painted.prepare()).motion.values
    )


@pytest.mark.parametrize(("at", "occurrence"), [(0, 0), (2, 1)])
def test_corrected_edges_move_the_lips_of_their_sentence_only(
    session: Session, pieces: list[Piece], at: int, occurrence: int
) -> None:
    still = replace(PROJECT, muted=frozenset(FEATURES))  # gestures follow what was said before
    before = moved(session, still)
    after = moved(session, replace(still, edges=(dragged(pieces[at], occurrence),)))
    for number, (old, new) in enumerate(zip(before, after, strict=True)):
        assert np.array_equal(old, new) == (number != at)


def test_corrected_edges_of_other_phones_are_refused(session: Session, pieces: list[Piece]) -> None:
    other = replace(dragged(pieces[0], 0), text=pieces[1].text)
    with pytest.raises(InputError, match="the corrected phone edges of the sentence 'Five maps were there"):
        moved(session, replace(PROJECT, edges=(other,)))


def test_a_pronunciation_changes_the_phones(session: Session) -> None:
    project = replace(PROJECT, pronunciations={"maps": "/mɑps/"})
    phones = [label for piece in session.stream(project.prepare()) for label in piece.clip.speech.phones.phones]
    assert "ɑ" in phones
    assert "æ" not in phones


def test_an_edit_is_added_to_its_channel_only(session: Session, pieces: list[Piece]) -> None:
    edit = ChannelEdit("browInnerUp", ((0.2, 0.0), (0.5, 0.4), (0.8, 0.0)))
    head = ChannelEdit("yaw", ((0.0, 0.1),))
    after = list(session.stream(replace(PROJECT, timeline=Timeline(edits=(edit, head))).prepare()))
    before, changed = pieces[0].clip, after[0].clip
    difference = changed.motion.values - before.motion.values
    at = before.motion.channels.index("browInnerUp")
    assert difference[15, at] == pytest.approx(0.4, abs=1e-5)
    assert not difference[30:, at].any()
    assert np.abs(np.delete(difference, at, axis=1)).max() < 1e-6  # hair follows the head
    np.testing.assert_allclose(changed.head.values[:, 1] - before.head.values[:, 1], 0.1, atol=1e-6)
    with pytest.raises(InputError, match="this face has no channel 'ear' to edit"):
        moved(session, replace(PROJECT, timeline=Timeline(edits=(ChannelEdit("ear", ((0.0, 1.0),)),))))


def test_muted_features_rest(session: Session, pieces: list[Piece]) -> None:
    after = list(session.stream(replace(PROJECT, muted=frozenset({"head"})).prepare()))
    assert pieces[1].clip.head.values.any()
    assert not after[1].clip.head.values.any()


def test_an_excluded_example_is_not_used(session: Session, pieces: list[Piece]) -> None:
    phone = next(one for one in pieces[1].explain() if one.phone == "f")
    best = ExcludedToken(phone.tokens[0].utterance, phone.tokens[0].start)
    after = list(session.stream(replace(PROJECT, excluded=(best,)).prepare()))
    tokens = next(one for one in after[1].explain() if one.phone == "f").tokens
    assert best not in [ExcludedToken(token.utterance, token.start) for token in tokens]
    assert tokens[0].utterance == phone.tokens[1].utterance


def test_the_command_renders_the_motion_of_the_project(
    session: Session, pieces: list[Piece], world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from cli.main import run

    models = Models(str(world.talker_file), str(world.face_file), palette=str(world.palette_file))
    project = replace(PROJECT, models=models, edges=(dragged(pieces[0], 0),), muted=frozenset({"blink"}))
    save_project(project, tmp_path / "scene.json")
    assert run(["render", str(tmp_path / "scene.json"), "--export", str(tmp_path / "scene.npz"), "--quiet"]) == 0
    with np.load(tmp_path / "scene.npz") as track:
        values = next(track[name] for name in track.files if track[name].ndim == 2 and track[name].shape[1] > 40)
    np.testing.assert_array_equal(values, np.concatenate(moved(session, load_project(tmp_path / "scene.json"))))
    assert run(["render", str(tmp_path / "scene.json")]) == 2
    assert "there is no output" in capsys.readouterr().err
