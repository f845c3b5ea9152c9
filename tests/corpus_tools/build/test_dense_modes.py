"""The dense shape model against direct solutions of eqs 3 and 4, and against components of the dense shapes."""

from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from corpus_tools.dense.adapt_head import EYE_PARTS
from corpus_tools.dense.mesh_fit import face_landmarks, face_width, part_vertices
from corpus_tools.dense.modes import (
    LIMIT,
    MEAN,
    MOST_MODES,
    OPEN_JAW,
    DenseModel,
    add_modes,
    components,
    dense_model,
    displacements,
    mode_fitter,
    spread_shapes,
)
from corpus_tools.dense.skin_colour import PictureFitter, build_picture_fitter
from corpus_tools.dense.tracked_pictures import TrackedPictures
from lexicon.errors import InputError
from tests.face.posing import posed_vertices
from tests.rendered_takes import ONLY_RENDERED
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, N_MESH_LANDMARKS
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw
from tts2face.video.media import read_frames

SHOWN = {"jawOpen": 0.3, "mouthSmileLeft": 0.3, "mouthSmileRight": 0.3, "browInnerUp": 0.4, "mouthPucker": 0.3}
N_VIDEOS, N_FRAMES, N_MODES = 5, 12, 5
USED = np.arange(0, N_MESH_LANDMARKS, 2)


@pytest.fixture(scope="module")
def head() -> Face:
    return load_face("head")


@pytest.fixture(scope="module")
def talker(head: Face) -> np.ndarray:
    """The head's own landmarks, in another place and size: what is known of the frames is exact."""
    return 0.5 * face_landmarks(head, head.vertices) + (7.0, -3.0, 11.0)


@pytest.fixture(scope="module")
def observed(head: Face, talker: np.ndarray) -> list[TrackedPictures]:
    """Frames of five known shapes at random weights; one frame shows no face."""
    numbers = [head.shape_names.index(name) for name in SHOWN]
    directions = np.stack([face_landmarks(head, head.shapes[number]) for number in numbers])
    amounts = np.random.default_rng(2).uniform(0, list(SHOWN.values()), (N_VIDEOS, N_FRAMES, len(SHOWN)))
    videos = talker + 0.5 * np.einsum("vtk,klc->vtlc", amounts, directions)
    videos[0, 3] = np.nan
    return [
        TrackedPictures(Path(f"{number}.mkv"), video, video) for number, video in enumerate(videos.astype(np.float32))
    ]


@pytest.fixture(scope="module")
def fit(head: Face) -> PictureFitter:
    return mode_fitter(head, USED)


@pytest.fixture(scope="module")
def model(head: Face, fit: PictureFitter, observed: list[TrackedPictures], talker: np.ndarray) -> DenseModel:
    return dense_model(head, fit, observed, talker, N_MODES)


def opened_of(head: Face, weight: float = OPEN_JAW) -> np.ndarray:
    return head.vertices + weight * head.shapes[head.shape_names.index("jawOpen")].astype(np.float64)


def weights_of(face: Face, **shown: float) -> np.ndarray:
    return np.array([shown.get(name, 0.0) for name in face.shape_names])


def test_a_dense_fit_is_the_direct_solution_of_eqs_3_and_4(
    head: Face, fit: PictureFitter, observed: list[TrackedPictures], talker
) -> None:
    """u = x - x0 at the constrained places, c = Phi^-1 u, f = sum c phi(|x - x_i|), phi(r) = exp(-r / 64) at 200 px."""
    moved = displacements(fit, observed[1].landmarks[:3], talker)
    wanted = 2.0 * (observed[1].landmarks[:3] - talker)[:, USED]
    np.testing.assert_allclose(moved, wanted, atol=1e-4)
    places, centres = opened_of(head)[::97], face_landmarks(head, opened_of(head))[USED]
    pixels = 200.0 / face_width(face_landmarks(head, head.vertices.astype(np.float64))[:N_MESH_LANDMARKS])
    between = np.linalg.norm(centres[:, None] - centres, axis=2)
    away = np.linalg.norm(places[:, None] - centres, axis=2)
    for frame in moved:
        coefficients = np.linalg.solve(np.exp(-between * pixels / 64), frame)
        direct = np.exp(-away * pixels / 64) @ coefficients
        np.testing.assert_allclose((fit.spread @ frame)[::97], direct, atol=1e-8)


def test_modes_are_the_principal_components_of_the_dense_shapes(
    head: Face, fit: PictureFitter, observed: list[TrackedPictures], talker: np.ndarray, model: DenseModel
) -> None:
    frames = np.concatenate([displacements(fit, one.landmarks, talker) for one in observed])
    assert model.n_frames == len(frames) == N_VIDEOS * N_FRAMES - 1
    skin = part_vertices(head, ("skin",))
    shapes = np.stack([(fit.spread[skin] @ frame).ravel() for frame in frames])
    left = shapes - shapes.mean(axis=0)
    _, scales, vectors = np.linalg.svd(left, full_matrices=False)
    np.testing.assert_allclose(model.dense.variances[:N_MODES], scales[:N_MODES] ** 2 / len(frames), rtol=1e-6)
    np.testing.assert_allclose(model.mean[skin].ravel(), shapes.mean(axis=0), atol=1e-8)
    for number in range(N_MODES):
        mode = model.modes[number, skin].ravel()
        size = scales[number] / np.sqrt(len(frames))
        np.testing.assert_allclose(np.linalg.norm(mode), size, rtol=1e-6)
        assert abs(mode @ vectors[number]) / size == pytest.approx(1.0, abs=1e-6)
    shares = np.cumsum(scales**2) / np.square(scales).sum()
    np.testing.assert_allclose(model.dense.shares()[:N_MODES], shares[:N_MODES], rtol=1e-6)
    assert model.dense.n_modes(0.95) == int(np.argmax(shares >= 0.95)) + 1


def test_the_sparse_model_is_that_of_the_landmarks(
    observed: list[TrackedPictures], fit: PictureFitter, talker, model: DenseModel
) -> None:
    frames = np.concatenate([displacements(fit, one.landmarks, talker) for one in observed]).reshape(model.n_frames, -1)
    scales = np.linalg.svd(frames - frames.mean(axis=0), compute_uv=False)
    np.testing.assert_allclose(model.sparse.variances[:N_MODES], scales[:N_MODES] ** 2 / len(frames), rtol=1e-6)


def test_five_shapes_are_five_modes_and_frames_held_out_lie_in_them(model: DenseModel) -> None:
    assert model.dense.shares()[N_MODES - 1] > 1 - 1e-6
    assert model.dense.shares()[N_MODES - 2] < 1 - 1e-4
    assert model.held_out is not None
    assert model.held_out.n_modes == (1, 2, 3, 4)
    assert list(model.held_out.dense) == sorted(model.held_out.dense, reverse=True)


def test_errors_of_held_out_frames_are_those_of_dense_shapes() -> None:
    generator = np.random.default_rng(3)
    spread = generator.normal(size=(50, 6))
    frames, others = generator.normal(size=(40, 6, 3)), generator.normal(size=(9, 6, 3))
    found = components(frames, spread.T @ spread)
    dense = np.einsum("vn,tnc->tvc", spread, frames).reshape(40, -1)
    _, _, vectors = np.linalg.svd(dense - dense.mean(axis=0), full_matrices=False)
    away = np.einsum("vn,tnc->tvc", spread, others).reshape(9, -1) - dense.mean(axis=0)
    direct = away - away @ vectors[:4].T @ vectors[:4]
    left = np.einsum("vn,tnc->tvc", spread, found.residual(others, 4)).reshape(9, -1)
    np.testing.assert_allclose(left, direct, atol=1e-9)


def test_a_face_file_shows_a_frame_by_its_parameters(
    head: Face,
    fit: PictureFitter,
    observed: list[TrackedPictures],
    talker: np.ndarray,
    model: DenseModel,
    tmp_path: Path,
) -> None:
    write_face(tmp_path / "me.face", add_modes(head, model))
    face = read_face(tmp_path / "me.face")
    names = [f"dense{number}" for number in range(1, N_MODES + 1)]
    assert face.shape_names == (*head.shape_names, MEAN, *names)
    np.testing.assert_array_equal(face.limits[-N_MODES:], [[-LIMIT, LIMIT]] * N_MODES)
    frame = displacements(fit, observed[2].landmarks[:1], talker)
    parameters = np.tensordot(frame - model.dense.mean, model.dense.duals[:N_MODES], axes=((1, 2), (1, 2)))[0]
    amounts = dict(zip(names, parameters / np.sqrt(model.dense.variances[:N_MODES]), strict=True))
    shown = posed_vertices(face, weights_of(face, denseMean=1.0, **amounts))
    np.testing.assert_allclose(shown, head.vertices + spread_shapes(head, fit, frame)[0], atol=0.02)  # 16-bit steps
    picture = draw(face, weights_of(face, denseMean=1.0, dense1=2.0), picture=Picture(size="64x64"))
    assert np.abs(picture.astype(int) - draw(face, weights_of(face), picture=Picture(size="64x64"))).max() > 20


def test_no_mode_tears_the_lips_or_moves_upper_teeth(head: Face, model: DenseModel) -> None:
    face, skin = add_modes(head, model), head.triangles[: head.parts[0].count]
    sides = np.linalg.norm(np.diff(head.vertices[skin], axis=1), axis=2)
    near_lips = np.isin(skin, head.landmark_vertices[[*INNER_LIP_UPPER, *INNER_LIP_LOWER]]).any(axis=1)
    for number in range(1, N_MODES + 1):
        for amount in (-1.0, 2.0):
            shown = posed_vertices(face, weights_of(face, denseMean=1.0, **{f"dense{number}": amount}))
            stretched = np.linalg.norm(np.diff(shown[skin], axis=1), axis=2)[near_lips & (sides.min(axis=1) > 0.3)]
            assert (stretched / sides[near_lips & (sides.min(axis=1) > 0.3)]).max() < 3.0
            np.testing.assert_array_equal(
                shown[part_vertices(head, EYE_PARTS)], head.vertices[part_vertices(head, EYE_PARTS)]
            )
    jaw = head.shapes[head.shape_names.index("jawOpen")]
    still = part_vertices(head, ("teeth_upper",))
    assert np.abs(jaw[still]).max() < 1e-6
    assert np.abs(model.modes[:, still]).max() < 1e-3


def test_the_edge_of_the_lower_lip_follows_the_jaw_evenly(head: Face) -> None:
    """Between landmarks it moves as far as at them; evaluated with hardly open lips it is serrated."""
    jaw = head.shapes[head.shape_names.index("jawOpen")].astype(np.float64)
    moved, marks = face_landmarks(head, jaw), face_landmarks(head, head.vertices)
    lower = list(INNER_LIP_LOWER[3:-3])
    away = np.linalg.norm(head.vertices[:, None] - marks[lower], axis=2)
    edge = np.flatnonzero((away.min(axis=1) < 3.0) & (jaw[:, 1] < 0.9 * moved[lower, 1][away.argmin(axis=1)]))
    assert len(edge) > 20
    lags = {}
    for name, fit in (
        ("open", mode_fitter(head, np.arange(N_MESH_LANDMARKS))),
        ("closed", build_picture_fitter(head, opened_of(head, 0.12), np.arange(N_MESH_LANDMARKS))),
    ):
        lags[name] = float(np.abs(fit.spread[edge] @ moved[:N_MESH_LANDMARKS, 1] / jaw[edge, 1] - 1).mean())
    assert lags["open"] < 0.03
    assert lags["closed"] > 2 * lags["open"]


@pytest.mark.parametrize("n_modes", [0, N_VIDEOS * N_FRAMES])
def test_more_modes_than_frames_are_refused(
    n_modes: int, head: Face, fit: PictureFitter, observed: list[TrackedPictures], talker
) -> None:
    with pytest.raises(InputError, match=f"{n_modes} dense modes cannot be computed from 59 frames; choose 1 to 58"):
        dense_model(head, fit, observed, talker, n_modes)


@pytest.mark.parametrize("n_modes", [-1, MOST_MODES + 1])
def test_a_basis_out_of_range_is_refused_before_any_video(n_modes: int, tmp_path: Path, capsys) -> None:
    words = ["corpus", "face", "nowhere", "--out", str(tmp_path / "me.face"), "--consent", "me"]
    assert run([*words, "--basis", str(n_modes)]) == 2
    assert f"a basis has 0 to 100 dense modes, not {n_modes}" in capsys.readouterr().err


@ONLY_RENDERED
def test_a_talkers_modes(few_takes: Path, face_model: Path, tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.setattr("corpus_tools.dense.skin_colour.N_FRAMES", 12)  # no texture is judged
    out = tmp_path / "me.face"
    words = [
        "corpus",
        "face",
        str(few_takes),
        "--out",
        str(out),
        "--consent",
        "agreed: the speakers of GRID, 2006-01-01",
        "--basis",
        "8",
    ]
    assert run([*words, "--model", str(face_model), "--cache", str(tmp_path / "cache")]) == 0
    said = capsys.readouterr().err
    assert "8 dense modes: 9" in said
    face = read_face(out)
    assert face.shape_names[-9:] == (MEAN, *[f"dense{number}" for number in range(1, 9)])
    n_frames = sum(len(list(read_frames(path))) for path in few_takes.glob("clips/*.mkv"))
    assert face.metadata["dense"]["frames"] == n_frames
    assert face.metadata["command"].endswith("--basis 8")
    # Speech opens and spreads the lips; which of the two moves more, and so is first, is the takes' own.
    first = [face_landmarks(face, face.shapes[face.shape_names.index(name)]) for name in ("dense1", "dense2")]
    assert max(abs(mode[13, 1] - mode[14, 1]) for mode in first) > 1.0  # mm between the lips
