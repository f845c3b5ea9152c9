"""Faces of other programs' shapes in whole clips: visemes alone, no landmarks, own expressions."""

from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

import tts2face
from tests.world import World
from tts2face.face.expressions import OWN_EXPRESSIONS, add_expression_shapes, expression_weights
from tts2face.face.lip_constraints import build_lip_constraints
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.palette import EXPRESSIONS
from tts2face.picture.occlusion import bake_occlusion

TEXT = "Bob may move."
VISEMES = {"jawOpen": "mouthViseme_aa", "mouthFunnel": "mouthViseme_oh", "mouthPucker": "mouthViseme_ou"}


def with_visemes(face: Face, has_landmarks: bool) -> Face:
    """The made face as an import leaves it: visemes in place of the jaw, and shadows for them."""
    kept = [at for at, name in enumerate(face.shape_names) if name in VISEMES or not name.startswith(("jaw", "mouth"))]
    names = tuple(VISEMES.get(face.shape_names[at], face.shape_names[at]) for at in kept)
    n = len(face.landmarks) if has_landmarks else 0
    made = replace(
        face, shape_names=names, shapes=face.shapes[kept], limits=face.limits[kept], occlusion=None, scores=None,
        opened_by="mouthViseme_aa", landmarks=face.landmarks[:n], landmark_vertices=face.landmark_vertices[:n],
        landmark_weights=face.landmark_weights[:n],
    )  # fmt: skip
    return bake_occlusion(made, n_directions=8)


@pytest.mark.parametrize("has_landmarks", [True, False])
@pytest.mark.parametrize("is_old", [True, False])
def test_a_face_of_visemes_alone_is_drawn_with_gestures(
    has_landmarks: bool, is_old: bool, world: World, tmp_path: Path
) -> None:
    face = with_visemes(world.face, has_landmarks)
    if is_old:  # before faces said what opens them, imports kept shadows at rest alone
        assert face.occlusion is not None
        face = replace(face, occlusion=face.occlusion[:1], opened_by="jawOpen")
    write_face(tmp_path / "v.face", face)
    session = world.session(face=read_face(tmp_path / "v.face"))
    files = [tmp_path / name for name in ("v.csv", "v.a2f.json", "v.curves.jsonl")]
    clip = session.clip(TEXT)
    for file in files:
        tts2face.export(clip, file, face=session.mesh)
        assert file.stat().st_size > 1000
    session.write(TEXT, tmp_path / "v.mp4", size="64x64")
    with av.open(str(tmp_path / "v.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) == len(clip.motion)
    table = np.genfromtxt(files[0], delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert table["JawOpen"].max() > 0.05
    assert clip.motion.columns(["mouthViseme_aa"]).max() > 0.05


def test_own_expressions_take_the_place_of_those_of_the_table(world: World) -> None:
    face = world.face
    own = np.zeros((1, *face.vertices.shape), np.float32)
    own[0, :, 1] = 1.0
    face = replace(
        face,
        shape_names=(*face.shape_names, OWN_EXPRESSIONS["happy"]),
        shapes=np.concatenate([face.shapes, own]),
        limits=np.concatenate([face.limits, [[0.0, 1.0]]]).astype(np.float32),
        scores=None,
    )
    complete = add_expression_shapes(face)
    weights = expression_weights(complete, build_lip_constraints(complete))
    happy = dict(zip(complete.shape_names, weights[EXPRESSIONS.index("happy")], strict=True))
    assert happy[OWN_EXPRESSIONS["happy"]] == pytest.approx(1.0)
    assert happy["mouthSmileLeft"] < 0.3
    assert weights[EXPRESSIONS.index("sad"), complete.shape_names.index(OWN_EXPRESSIONS["happy"])] == 0.0
    assert weights[EXPRESSIONS.index("sad")].max() > 0.2
