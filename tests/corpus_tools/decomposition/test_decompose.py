"""A face made of known parts is taken apart again."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.decomposition.basis import ExpressionBasis, transfer_basis
from corpus_tools.decomposition.blend_weights import build_least_squares_estimator
from corpus_tools.decomposition.capture import FaceRecording
from corpus_tools.decomposition.capture_files import eye_motion
from corpus_tools.decomposition.decompose import (
    IRIS_LANDMARKS,
    IRIS_SHIFT_PER_RAD,
    Decomposition,
    decompose,
    gaze_angles,
    weight_displacements,
)
from corpus_tools.decomposition.derived_styles import read_derived_styles
from corpus_tools.decomposition.learnt_style import add_style
from corpus_tools.decomposition.regions import feature_landmarks
from lexicon.errors import DataError, InputError
from tts2face.face.expressions import expression_landmarks
from tts2face.face.landmarks import axis_ratios, moved_landmarks, rest_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import EYELID_LANDMARKS, MOUTH_REGION
from tts2face.models.palette import EXPRESSIONS, PLAIN, REGION_FEATURES, Delivery
from tts2face.models.palette_file import load_palette
from tts2face.types import Trajectory, Waveform

FPS, SECONDS = 30.0, 12.0
TIMES = np.arange(round(FPS * SECONDS)) / FPS


@pytest.fixture(scope="module")
def basis(face: Face) -> ExpressionBasis:
    return transfer_basis(expression_landmarks(face), rest_landmarks(face), rest_landmarks(face))


def _weights(face: Face, **shown: np.ndarray) -> Trajectory:
    values = np.zeros((len(TIMES), len(face.shape_names)), np.float32)
    for name, track in shown.items():
        values[:, face.shape_names.index(name)] = track
    return Trajectory(face.shape_names, values, FPS)


def _captured(landmarks: np.ndarray, head: np.ndarray | None = None) -> FaceRecording:
    poses = np.zeros((len(TIMES), 6), np.float32) if head is None else head.astype(np.float32)
    sound = Waveform(np.zeros(round(SECONDS * 16_000)), 16_000)
    return FaceRecording("made", FPS, landmarks.astype(np.float32), poses, sound)


def _parts(landmarks: np.ndarray, basis: ExpressionBasis, head: np.ndarray | None = None) -> Decomposition:
    return decompose(
        _captured(landmarks, head), basis, build_least_squares_estimator(weight_displacements(basis.expressions))
    )


def test_no_landmark_lies_in_two_regions_or_in_the_lips() -> None:
    every = np.concatenate([feature_landmarks(feature) for feature in ("brows", "blink", "cheeks")]).tolist()
    assert len(set(every)) == len(every)
    assert not set(every) & set(MOUTH_REGION)


def test_a_slow_expression_is_recovered_by_its_weight(basis: ExpressionBasis) -> None:
    slow = 0.5 - 0.5 * np.cos(2 * np.pi * TIMES / SECONDS)
    happy = EXPRESSIONS.index("happy")
    moved = basis.rest + slow[:, None, None] * basis.expressions[happy]
    made = _parts(moved, basis)
    inner = slice(45, -45)
    np.testing.assert_allclose(made.motion["expression"][inner, happy], slow[inner], atol=0.02)
    others = np.delete(made.motion["expression"][inner], happy, axis=1)
    assert np.abs(others).max() < 0.02
    assert np.abs(made.motion["brows"][inner]).max() < 0.3  # mm; the expression moves brows by up to 1 mm


@pytest.mark.parametrize("fps", [FPS, 50.0, 120.0])
def test_frames_in_long_gaps_are_in_no_piece(basis: ExpressionBasis, fps: float) -> None:
    times = np.arange(round(fps * SECONDS)) / fps
    left_out = ((times >= 2) & (times < 3.5)) | ((times >= 4) & (times < 5))  # with half a second between them
    recording = FaceRecording(
        "made", fps, np.tile(basis.rest, (len(times), 1, 1)).astype(np.float32), np.zeros((len(times), 6), np.float32),
        left_out=left_out,
    )  # fmt: skip
    made = decompose(recording, basis, build_least_squares_estimator(weight_displacements(basis.expressions)))
    pieces = made.measured_pieces()
    assert len(pieces) == 2
    np.testing.assert_allclose([len(piece.intensity) / FPS for piece in pieces], [2.0, 7.0], atol=0.07)
    for piece in pieces:
        assert {len(values) for values in (*piece.motion.values(), piece.speech, piece.pitch)} == {len(piece.intensity)}
    assert replace(made, left_out=np.ones(len(made.intensity), bool)).measured_pieces() == []


def test_quick_brows_are_independent_motion_and_no_expression(basis: ExpressionBasis) -> None:
    brows = feature_landmarks("brows")
    raised = 2.0 * np.sin(2 * np.pi * 1.5 * TIMES)
    moved = np.tile(basis.rest, (len(TIMES), 1, 1))
    moved[:, brows, 1] += raised[:, None]
    made = _parts(moved, basis)
    assert np.abs(made.motion["expression"][45:-45]).max() < 0.03
    height = made.motion["brows"][..., 1].mean(axis=1)
    assert np.corrcoef(height, raised)[0, 1] > 0.999
    assert height.std() == pytest.approx(raised.std(), rel=0.05)  # a Gaussian of 0.03 s leaves 96 % of 1.5 Hz
    assert np.abs(made.motion["cheeks"]).max() < 0.3


def test_speech_remains_in_the_lips(basis: ExpressionBasis) -> None:
    opened = 4.0 * np.maximum(np.sin(2 * np.pi * 4 * TIMES), 0)
    moved = np.tile(basis.rest, (len(TIMES), 1, 1))
    moved[:, 14, 1] -= opened
    made = _parts(moved, basis)
    at = MOUTH_REGION.index(14)
    np.testing.assert_allclose(made.speech[:, at, 1], -opened, atol=0.3)
    assert np.abs(made.motion["brows"]).max() < 0.2


def test_lids_of_a_face_that_blinks(face: Face, basis: ExpressionBasis) -> None:
    shut = np.clip(np.sin(2 * np.pi * 0.5 * TIMES), 0, 1)
    meet = 0.87  # of the head's shape: there its lids meet
    made = _parts(moved_landmarks(face, _weights(face, eyeBlinkLeft=meet * shut, eyeBlinkRight=meet * shut)), basis)
    found = made.motion["blink"]
    np.testing.assert_allclose(found, np.stack([shut, shut], axis=1), atol=0.12)
    assert found[shut == 0].max() < 0.05
    assert found[shut > 0.99].min() > 0.88  # the upper lid of these wide eyes lies 2.7 mm before the lower one


def test_the_line_of_sight_is_the_eyes_and_the_head_s(basis: ExpressionBasis) -> None:
    looking = 0.2 * np.sin(2 * np.pi * 0.5 * TIMES)
    moved = np.tile(basis.rest, (len(TIMES), 1, 1))
    for side, iris in IRIS_LANDMARKS.items():
        _, _, outer, inner = EYELID_LANDMARKS[side]
        width = np.linalg.norm(basis.rest[outer] - basis.rest[inner])
        moved[:, iris, 0] += IRIS_SHIFT_PER_RAD[1] * width * looking
    still = _parts(moved, basis).motion["gaze"]
    np.testing.assert_allclose(still[:, 1], looking, atol=0.01)
    turned = np.zeros((len(TIMES), 6))
    turned[:, 1] = -looking
    held = _parts(moved, basis, turned).motion["gaze"]
    assert np.abs(held[:, 1]).max() < 0.01


def test_a_capture_tells_its_eyes_itself(face: Face, basis: ExpressionBasis) -> None:
    looking = 0.5 + 0.5 * np.sin(2 * np.pi * 0.4 * TIMES)
    weights = _weights(face, eyeLookOutLeft=looking, eyeLookInRight=looking, eyeBlinkLeft=0.3 * looking)
    captured = replace(_captured(moved_landmarks(face, weights)), eyes=eye_motion(face, weights))
    made = decompose(captured, basis, build_least_squares_estimator(weight_displacements(basis.expressions)))
    assert np.ptp(made.motion["gaze"][:, 1]) == pytest.approx(0.436, abs=0.005)  # rad of that shape (25 degrees)
    np.testing.assert_allclose(made.motion["blink"][:, 0], 0.3 * looking, atol=1e-6)


def test_irises_covered_by_lids_are_ignored(basis: ExpressionBasis) -> None:
    shut = np.zeros((len(TIMES), 2), np.float32)
    shut[100:110] = 1.0
    turned = np.zeros((len(TIMES), 2))
    turned[101:109] = 0.5
    assert not gaze_angles(turned, np.zeros((len(TIMES), 6)), shut).any()


def test_the_head_is_centred(basis: ExpressionBasis) -> None:
    head = np.zeros((len(TIMES), 6))
    head[:, 0], head[:, 3] = 0.3 + 0.02 * np.sin(TIMES), 40.0
    made = _parts(np.tile(basis.rest, (len(TIMES), 1, 1)), basis, head)
    assert np.abs(made.motion["head"][:, 0]).max() < 0.03
    np.testing.assert_allclose(made.motion["head"][:, 3], 0, atol=1e-4)


def _style(basis: ExpressionBasis, seed: int, size: float = 1.0) -> list[Decomposition]:
    generator = np.random.default_rng(seed)
    moved = np.tile(size * basis.rest, (len(TIMES), 1, 1))
    tracks = [np.convolve(generator.normal(size=len(TIMES)), np.hanning(25), "same") for _ in range(4)]
    for feature in REGION_FEATURES:
        numbers = feature_landmarks(feature)
        moved[:, numbers, 1] += size * tracks[0][:, None]
        moved[:, numbers[::2], 0] += size * 0.5 * tracks[1][:, None]
    scaled = ExpressionBasis(size * basis.rest, size * basis.expressions)
    return [
        decompose(_captured(moved), scaled, build_least_squares_estimator(weight_displacements(scaled.expressions)))
    ]


def test_a_person_of_another_size_moves_the_common_face_alike(basis: ExpressionBasis) -> None:
    first = add_style(None, "small", _style(basis, 1), basis.rest, {})
    assert min(first.kept.values()) > 0.95
    second = add_style(first.palette, "large", _style(basis, 1, 1.3), 1.3 * basis.rest, {})
    assert second.palette.names == ("small", "large", "measured")
    for feature in REGION_FEATURES:
        small, large = (second.palette.styles[name].motion[feature] for name in ("small", "large"))
        np.testing.assert_allclose(large, small, atol=0.02 * np.abs(small).max())
    np.testing.assert_allclose(axis_ratios(1.3 * basis.rest, basis.rest), 1 / 1.3, rtol=1e-12)


def test_modes_are_orthonormal(basis: ExpressionBasis) -> None:
    palette = add_style(None, "one", _style(basis, 2), basis.rest, {}).palette
    for region in palette.regions.values():
        flat = region.modes.reshape(len(region.modes), -1)
        np.testing.assert_allclose(flat @ flat.T, np.eye(len(flat)), atol=1e-5)


def test_an_existing_style_is_refused(basis: ExpressionBasis) -> None:
    palette = add_style(None, "one", _style(basis, 2), basis.rest, {}).palette
    with pytest.raises(InputError, match="the palette has a style one already"):
        add_style(palette, "one", _style(basis, 2), basis.rest, {})


def test_no_recording(basis: ExpressionBasis) -> None:
    with pytest.raises(InputError, match="no recording could be used"):
        add_style(None, "one", [], basis.rest, {})


def test_a_first_style_without_cheeks(basis: ExpressionBasis) -> None:
    (part,) = _style(basis, 3)
    del part.motion["cheeks"]
    with pytest.raises(InputError, match="the recordings do not show cheeks; a palette begins with"):
        add_style(None, "one", [part], basis.rest, {})


def test_the_paper_s_six_moods_are_derived() -> None:
    made = read_derived_styles("someone")
    assert list(made)[:6] == ["neutral", "depressed", "delighted", "annoyed", "exaggerated", "exasperated"]
    assert all(derived.source == "someone" and derived.summary for derived in made.values())
    assert made["depressed"].changes["expression"].offset == {"sad": 0.9}
    assert made["depressed"].delivery == Delivery(0.9, -2.0, -1.5, 0.7)
    assert made["neutral"].delivery == PLAIN


def test_the_shipped_palette_has_the_derived_styles_of_the_table() -> None:
    shipped = load_palette("starter")
    (recorded,) = shipped.styles
    assert shipped.derivations == read_derived_styles(recorded), (
        "run: python -m corpus_tools.shipped.make_models styles"
    )


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("odd\tears\t1\t1\t\t", "odd changes 'ears', which is not a feature"),
        ("odd\thead\tfast\t1\t\t", "head of odd cannot be read"),
        ("odd\tvoice\t\t\ttone=1\t", "the voice of odd cannot be read"),
        ("odd\thead\t1\t1\tsmile=1\t", "head of odd cannot be read .*no channel 'smile'"),
    ],
)
def test_a_wrong_line_of_the_table(line: str, reason: str, tmp_path) -> None:
    table = tmp_path / "styles.tsv"
    table.write_text(f"style\tfeature\tgain\ttempo\toffsets\twhy\n{line}\n")
    with pytest.raises(DataError, match=reason):
        read_derived_styles("someone", table)
