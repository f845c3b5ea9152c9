"""Shapes carried over by a whole import, which the tracker reads."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tests.interchange.characters.made import Variant, head_without_mouth, write_character_file, write_landmarks
from tests.interchange.characters.test_transfer import shapeless_head
from tts2face.face.eyelids import BLINK_SHAPES
from tts2face.face.landmarks import landmark_positions, scatter_landmarks
from tts2face.interchange.characters.importing import import_face, read_character
from tts2face.interchange.characters.transfer.cards import move_cards
from tts2face.interchange.characters.transfer.first_look import find_head
from tts2face.interchange.characters.transfer.parts import triangles_of
from tts2face.interchange.characters.transfer.skin import build_skin
from tts2face.interchange.characters.transfer.source import own_landmarks
from tts2face.interchange.characters.transfer.walls import keep_triangles
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, LEFT_LIDS, LIP_LANDMARKS, RIGHT_LIDS


@pytest.mark.usefixtures("face_model")
def test_the_shapes_of_a_head_come_back(tmp_path: Path) -> None:
    """The shipped head without its shapes, turned aside: its own are carried over to it."""
    path = write_character_file(tmp_path / "bare.glb", Variant(turn_deg=22.0), face=shapeless_head())
    steps: list[tuple[int, int]] = []
    imported = import_face(path, shapes="transfer", on_progress=lambda done, of: steps.append((done, of)))
    face, head = imported.face, head_without_mouth()
    assert face.metadata["shapes_from"] == imported.report.carried_from == "head"
    assert 45 < imported.report.n_carried < 53  # gaze turns the eyeballs
    assert any("is turned; --front sets its axis" in note for note in imported.report.notes)
    assert "character" not in face.metadata
    assert len(face.eyes) == 2
    assert steps[-1][0] == len(steps) <= steps[-1][1]
    jaw = face.shapes[face.shape_names.index("jawOpen")]
    assert np.abs(jaw).max() == pytest.approx(np.abs(head.shapes[head.shape_names.index("jawOpen")]).max(), rel=0.1)
    assert face.scores is not None  # it speaks as its own mouth needs
    places = scatter_landmarks(face, landmark_positions(face))
    lips = places[list(INNER_LIP_UPPER[1:-1])] - places[list(INNER_LIP_LOWER[1:-1])]
    assert np.linalg.norm(lips, axis=1).max() < 0.3  # mm; as read in pictures they lie 2 mm apart


def test_a_table_of_lips_and_lids_is_enough(tmp_path: Path) -> None:
    """Without the tracker: the source's landmarks are then its own."""
    path = write_character_file(tmp_path / "bare.glb", face=shapeless_head())
    needed = {*LIP_LANDMARKS, *np.ravel(LEFT_LIDS).tolist(), *np.ravel(RIGHT_LIDS).tolist()}
    write_landmarks(tmp_path / "all.tsv")
    header, *rows = (tmp_path / "all.tsv").read_text().splitlines()
    kept = [row for row in rows if int(row.split("\t")[0]) in needed]
    (tmp_path / "some.tsv").write_text("\n".join([header, *kept]) + "\n")
    imported = import_face(path, shapes="transfer", landmarks=tmp_path / "some.tsv")
    jaw = imported.face.shapes[imported.face.shape_names.index("jawOpen")]
    head = head_without_mouth()
    assert np.abs(jaw).max() == pytest.approx(np.abs(head.shapes[head.shape_names.index("jawOpen")]).max(), rel=0.1)


@pytest.mark.usefixtures("face_model")
def test_two_heads_and_half_a_head_are_refused(tmp_path: Path) -> None:
    head = shapeless_head()
    n, n_triangles = len(head.vertices), len(head.triangles)
    empty = np.zeros((0, 2 * n, 3), np.float32)
    two = replace(
        head, vertices=np.concatenate([head.vertices, head.vertices + np.float32([350, 0, 0])]),
        triangles=np.concatenate([head.triangles, head.triangles + n]), colours=np.tile(head.colours, (2, 1)),
        uv=None if head.uv is None else np.tile(head.uv, (2, 1)), shapes=empty, tangents=None,
        parts=(*head.parts, *(replace(part, first=part.first + n_triangles) for part in head.parts)),
    )  # fmt: skip
    with pytest.raises(DataError, match=r"two faces are recognised, 0\.3\d+ units of the file apart; leave one head"):
        import_face(write_character_file(tmp_path / "two.glb", face=two), shapes="transfer")
    half = keep_triangles(head, (head.vertices[head.triangles][..., 0] < 0).all(axis=1))
    with pytest.raises(DataError, match="only one side of a face is there"):
        import_face(write_character_file(tmp_path / "half.glb", face=half), shapes="transfer")
    assert not list(tmp_path.glob("*.face"))


def test_lashes_turn_with_their_lids() -> None:
    """The motion of a shipped face's lashes in a blink is found from that of its lids alone."""
    face = load_face("mara")
    lashes = np.unique(face.triangles[triangles_of(face, "lashes")])
    blinks = [face.shape_names.index(name) for name in BLINK_SHAPES]
    own, found = face.shapes[blinks].sum(axis=0)[lashes], face.shapes[blinks].astype(np.float64)
    found[:, lashes] = 0.0
    move_cards(face, found, build_skin(face, own_landmarks(face)))
    apart = np.linalg.norm(found.sum(axis=0)[lashes] - own, axis=1).mean()
    assert apart < 0.3 * np.linalg.norm(own, axis=1).mean()  # .22; cards that follow the skin beside them are torn


@pytest.mark.usefixtures("face_model")
def test_a_bald_scalp_is_no_face(tmp_path: Path) -> None:
    """A part of the back of the head was taken for a face, which the whole head around it is not."""
    path = write_character_file(tmp_path / "back.glb", Variant(turn_deg=180.0), face=shapeless_head())
    found = find_head(read_character(path), [0.0, 180.0], None)
    np.testing.assert_allclose(found.mesh.turn[2], [0.0, 0.0, -1.0], atol=0.2)
