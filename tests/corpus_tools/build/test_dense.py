"""The default head adapted to talkers with known shapes, and to a real one."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.dense.adapt_head import RIGID_MOUTH_PARTS, adapt_head
from corpus_tools.dense.build_face import build_face
from corpus_tools.dense.mesh_fit import OPEN_JAW_WEIGHT, align_to_head, face_landmarks, part_vertices
from corpus_tools.dense.skin_canvas import build_canvas, polygon_depth
from corpus_tools.dense.skin_colour import build_picture_fitter, welded_normals
from corpus_tools.dense.tracked_pictures import find_videos
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError, InputError
from tests.face.posing import posed_vertices
from tests.rendered_takes import ONLY_RENDERED
from tts2face.models.consent import consent_record
from tts2face.models.face import Face
from tts2face.models.face_file import read_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.storage.shipped import find_file

LIPS_MM = 0.5  # facing lips that are nearer touch


@pytest.fixture(scope="module")
def head() -> Face:
    return read_face(find_file("head", "face"))


@pytest.fixture(scope="module")
def long_face(head: Face) -> np.ndarray:
    """Landmarks of a talker whose face is longer and narrower than the head's, in another place and size."""
    rest = face_landmarks(head, head.vertices)
    taller = rest * (0.95, 1.06, 1.0)
    return 1.7 * taller + (30.0, -400.0, 12.0)


@pytest.fixture(scope="module")
def long_head(head: Face, long_face: np.ndarray) -> Face:
    return adapt_head(head, long_face)


def weights_of(face: Face, **shown: float) -> np.ndarray:
    return np.array([shown.get(name, 0.0) for name in face.shape_names], np.float32)


def lip_gaps(face: Face, **shown: float) -> np.ndarray:
    marks = face_landmarks(face, posed_vertices(face, weights_of(face, **shown)))
    return marks[list(INNER_LIP_UPPER), 1] - marks[list(INNER_LIP_LOWER), 1]


def test_landmarks_of_the_adapted_head_are_the_talkers(long_head: Face, long_face: np.ndarray) -> None:
    reached = face_landmarks(long_head, long_head.vertices)[:N_MESH_LANDMARKS]
    off = np.linalg.norm(align_to_head(long_face, reached) - reached, axis=1)
    assert np.median(off) < 0.3
    assert np.percentile(off, 95) < 1.5


def test_the_heads_own_landmarks_leave_it_as_it_is(head: Face) -> None:
    same = adapt_head(head, face_landmarks(head, head.vertices))
    np.testing.assert_allclose(same.vertices, head.vertices, atol=1e-4)
    np.testing.assert_allclose(same.shapes, head.shapes, atol=1e-3)


def test_shapes_keep_their_names_and_meanings(head: Face, long_head: Face) -> None:
    assert long_head.shape_names == head.shape_names
    assert np.abs(lip_gaps(long_head)).max() < LIPS_MM
    assert lip_gaps(long_head, jawOpen=0.6).max() > 8.0
    assert np.abs(lip_gaps(long_head, jawOpen=0.6, mouthClose=0.6)).max() < 2.0


def test_eyeballs_stay_round_and_the_lids_close_over_them(head: Face, long_head: Face) -> None:
    blinks = weights_of(head, eyeBlinkLeft=1, eyeBlinkRight=1)
    own, blinking = (face_landmarks(face, posed_vertices(face, blinks)) for face in (head, long_head))
    for upper, lower in ((159, 145), (386, 374)):
        overlap = own[upper, 1] - own[lower, 1]
        assert overlap < 0
        assert abs(blinking[upper, 1] - blinking[lower, 1] - overlap) < 1.0
    for before, after in zip(head.eyes, long_head.eyes, strict=True):
        span = slice(before.first, before.first + before.count)
        old = np.linalg.norm(head.vertices[span] - before.centre, axis=1)
        new = np.linalg.norm(long_head.vertices[span] - after.centre, axis=1)
        np.testing.assert_allclose(new / old, np.median(new / old), rtol=1e-3)
        assert 0.9 < np.median(new / old) < 1.1
    np.testing.assert_allclose(np.mean([eye.centre for eye in long_head.eyes], axis=0), 0.0, atol=1e-4)


def test_teeth_are_scaled_but_never_bent(head: Face, long_head: Face) -> None:
    bone = part_vertices(head, RIGID_MOUTH_PARTS)[::40]
    old = np.linalg.norm(head.vertices[bone][:, None] - head.vertices[bone], axis=2)
    new = np.linalg.norm(long_head.vertices[bone][:, None] - long_head.vertices[bone], axis=2)
    far = old > 5.0
    np.testing.assert_allclose(new[far] / old[far], np.median(new[far] / old[far]), rtol=1e-3)


def test_no_triangle_of_the_skin_is_torn_or_turned_over(head: Face, long_head: Face) -> None:
    skin = head.triangles[: head.parts[0].count]
    sides = [np.linalg.norm(np.diff(face.vertices[skin], axis=1), axis=2) for face in (head, long_head)]
    long_enough = sides[0] > 0.5
    assert (sides[1][long_enough] / sides[0][long_enough]).max() < 2.5
    along = (welded_normals(head) * welded_normals(long_head)).sum(axis=1)[np.unique(skin)]
    assert np.percentile(along, 0.5) > 0.5


def test_the_fit_recovers_a_posed_head(long_head: Face) -> None:
    opened = long_head.vertices + OPEN_JAW_WEIGHT * long_head.shapes[long_head.shape_names.index("jawOpen")]
    fit = build_picture_fitter(long_head, opened, np.arange(N_MESH_LANDMARKS))
    turn = np.array([[np.cos(0.3), 0, np.sin(0.3)], [0, 1, 0], [-np.sin(0.3), 0, np.cos(0.3)]])
    there = 2.0 * long_head.vertices.astype(np.float64) @ turn.T + (300, -200, 10)
    points = face_landmarks(long_head, there) * (1, -1, -1)
    placed, found = fit.fit(points.astype(np.float32))
    np.testing.assert_allclose(found, turn, atol=1e-4)
    np.testing.assert_allclose(placed, there, atol=0.01)


def test_the_canvas_leaves_out_eyes_mouth_and_the_back(long_head: Face) -> None:
    canvas = build_canvas(long_head)
    place = canvas.texels.interpolate(long_head.vertices.astype(np.float64))
    marks = face_landmarks(long_head, long_head.vertices)
    assert canvas.share[place[:, 2] < -70].max() == 0
    assert canvas.share[canvas.in_mouth].max() == 0
    cheek = np.linalg.norm(place - marks[205], axis=1) < 5
    assert canvas.share[cheek].min() > 0.8


def test_depth_inside_a_square() -> None:
    square = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)])
    places = np.array([(5.0, 5.0), (5.0, 1.0), (5.0, -2.0), (13.0, 14.0), (80.0, 5.0)])
    np.testing.assert_allclose(polygon_depth(places, square, 6.0), [5.0, 1.0, -2.0, -5.0, -6.0])


def test_a_head_without_texture_is_refused(head: Face) -> None:
    with pytest.raises(DataError, match="has no texture"):
        build_canvas(replace(head, textures=(), parts=(), triangles=head.triangles[:0]))


def test_only_videos_are_looked_at(tmp_path: Path) -> None:
    note = tmp_path / "note.txt"
    note.write_text("no video")
    with pytest.raises(InputError, match="is not a video"):
        find_videos(note)
    with pytest.raises(InputError, match="there is no folder"):
        find_videos(tmp_path / "nowhere")


def test_a_talkers_head(
    few_takes: Path, face_model: Path, tmp_path: Path, head: Face, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("corpus_tools.dense.skin_colour.N_FRAMES", 12)  # no texture is judged
    consent = consent_record("Speaker 1", "agreed: the speakers of GRID, 2006-01-01", date="2026-01-31")
    out, steps = tmp_path / "me.face", []
    built = build_face(
        few_takes,
        out,
        consent=consent,
        run_options=RunOptions(tmp_path / "cache", 1, face_model),
        on_progress=lambda done, of: steps.append((done, of)),
    )
    face = read_face(out)
    assert (built.n_videos, built.n_found) == (3, 3)
    assert steps[-1] == (6, 6)
    assert built.error_mm < 0.6
    assert out.stat().st_size < 6e6
    assert face.metadata["consent"] == dict(consent)
    assert face.metadata["licence"] == "mesh: CC0-1.0; likeness of the person: not stated"
    assert len(face.landmarks) == N_LANDMARKS
    assert face.shape_names == head.shape_names
    assert face.textures
    assert head.textures
    assert built.look.length in (
        "short",
        "bob",
        "long",
    )  # a recorded man; a rendered woman, whose picture ends at the neck
    assert face.hairdo == built.look.hairdo
    assert face.metadata["look"] == built.look.summary()
    canvas = build_canvas(face)
    rows, columns = canvas.texels.rows[canvas.in_mouth], canvas.texels.columns[canvas.in_mouth]
    difference = face.textures[0].pixels[rows, columns].astype(int) - head.textures[0].pixels[rows, columns]
    assert np.abs(difference).mean() < 3  # JPEG's, no pixels of the talker's mouth


@ONLY_RENDERED
def test_a_face_without_consent_is_refused(few_takes: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-c", "import sys; from cli.main import run; sys.exit(run(sys.argv[1:]))"]
    command += ["corpus", "face", str(few_takes), "--out", str(tmp_path / "me.face")]
    asked = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    assert asked.returncode == 2
    assert "state the consent" in asked.stderr
    assert "Traceback" not in asked.stderr
    assert not (tmp_path / "me.face").exists()
