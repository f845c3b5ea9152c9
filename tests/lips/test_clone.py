"""Parameter transfer between talkers: laws of eq. 5, limits, lip gaps, and appended components."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from lexicon.errors import DataError, InputError
from tts2face.lips.cloning import append_missing_components, build_parameter_transfer, face_size, parameter_limits
from tts2face.lips.retargeting import inner_product_map
from tts2face.models.landmarks import (
    EYE_OUTER_LEFT,
    EYE_OUTER_RIGHT,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LOWER_LIP_INNER_MID,
    MOUTH_REGION,
    N_LANDMARKS,
    UPPER_LIP_INNER_MID,
)
from tts2face.models.talker import ShapeModel
from tts2face.models.talker_file import load_talker
from tts2face.types import Trajectory

INNER_UPPER_LIP, INNER_LOWER_LIP = list(INNER_LIP_UPPER[1:-1]), list(INNER_LIP_LOWER[1:-1])
seeds = st.integers(0, 100_000)
some = settings(deadline=None, max_examples=30)
MOUTH = np.isin(np.arange(N_LANDMARKS), MOUTH_REGION)


def mean_landmarks(gap: float = 0.4, size: float = 1.0) -> np.ndarray:
    """Random landmarks of a face; facing inner lip points are `gap` mm apart."""
    shape = np.random.default_rng(1).uniform(-60, 60, (N_LANDMARKS, 3))
    shape[INNER_UPPER_LIP], shape[INNER_LOWER_LIP] = (0, gap / 2, 0), (0, -gap / 2, 0)
    shape[EYE_OUTER_RIGHT], shape[EYE_OUTER_LEFT] = (-45, 60, 0), (45, 60, 0)
    return shape * size


def model_of(seed: int, n_speech: int = 4, n_other: int = 2, size: float = 1.0) -> ShapeModel:
    """Random orthonormal modes, those of the mouth first, and a rest near the mean."""
    rng = np.random.default_rng(seed)
    rows = []
    for region, n_modes in ((MOUTH, n_speech), (~MOUTH, n_other)):
        modes = np.zeros((n_modes, N_LANDMARKS, 3))
        vectors = np.linalg.qr(rng.normal(size=(3 * int(region.sum()), n_modes)))[0].T
        modes[:, region] = vectors.reshape(n_modes, -1, 3)
        rows.append(modes)
    spread = np.sort(rng.uniform(1, 8, n_speech + n_other))[::-1]
    rest = spread * rng.uniform(-0.5, 0.5, len(spread))
    basis = np.concatenate(rows)
    mean = mean_landmarks(40.0, size)  # lips far apart: they never cross
    return ShapeModel(*(part.astype(np.float32) for part in (mean, basis, spread)), n_speech, rest.astype(np.float32))


def motion_of(model: ShapeModel, seed: int = 3, n_frames: int = 20, spreads: float = 1.0) -> np.ndarray:
    values = np.random.default_rng(seed).uniform(-spreads, spreads, (n_frames, len(model.spread))) * model.spread
    return values.astype(np.float32)


def opening_model(gap: float = 0.4, second: float = 0.0) -> ShapeModel:
    """Two modes: one lowers the lower lip, one moves landmark 0 to the side; unit spread of 10 mm."""
    basis = np.zeros((2, N_LANDMARKS, 3), np.float32)
    basis[0, INNER_LOWER_LIP, 1] = -1 / np.sqrt(len(INNER_LOWER_LIP))
    basis[1, 0, 0] = 1
    rest = np.array([0.0, second], np.float32)
    return ShapeModel(mean_landmarks(gap).astype(np.float32), basis, np.full(2, 10, np.float32), 2, rest)


def gaps_of(model: ShapeModel, parameters: np.ndarray) -> np.ndarray:
    shapes = model.shapes(parameters)
    return shapes[:, INNER_UPPER_LIP, 1] - shapes[:, INNER_LOWER_LIP, 1]


@some
@given(seeds)
def test_a_transfer_to_the_same_talker_is_the_identity(seed: int) -> None:
    model = model_of(seed)
    values = motion_of(model, spreads=2.9)
    assert build_parameter_transfer(model, model).parameters(values) == pytest.approx(values, abs=1e-5)


@some
@given(seeds)
def test_equal_bases_have_the_unit_matrix_as_relation(seed: int) -> None:
    model = model_of(seed)
    assert build_parameter_transfer(model, model).relation == pytest.approx(np.eye(len(model.spread)), abs=1e-6)


@some
@given(seeds, st.floats(0.5, 2.0))
def test_rest_becomes_rest_at_any_gain_and_size(seed: int, gain: float) -> None:
    source, target = model_of(seed), model_of(seed + 1, 3, 4, size=1.7)
    mapped = build_parameter_transfer(source, target, gain=gain).parameters(source.rest[None])
    assert mapped[0] == pytest.approx(target.rest, abs=1e-5)


@some
@given(seeds, st.lists(st.sampled_from([-1.0, 1.0]), min_size=6, max_size=6))
def test_sign_flips_of_modes_cancel_out(seed: int, signs: list[float]) -> None:
    source, target = model_of(seed), model_of(seed + 1)
    flips = np.array(signs, np.float32)
    flipped = replace(source, basis=source.basis * flips[:, None, None], rest=source.rest * flips)
    values = motion_of(source)
    expected = build_parameter_transfer(source, target).parameters(values)
    assert build_parameter_transfer(flipped, target).parameters(values * flips) == pytest.approx(expected, abs=1e-5)
    turned = replace(target, basis=target.basis * flips[:, None, None], rest=target.rest * flips)
    assert build_parameter_transfer(source, turned).parameters(values) == pytest.approx(expected * flips, abs=1e-5)


@some
@given(seeds)
def test_eq_5_is_least_squares_on_the_landmarks(seed: int) -> None:
    """Against numpy's least squares, which does not use inner products."""
    source, target = model_of(seed), model_of(seed + 1, 5, 3, size=0.8)
    values = motion_of(source)
    size = face_size(target) / face_size(source)
    wanted = size * (source.shapes(values) - source.shapes(source.rest[None])).reshape(len(values), -1)
    design = target.basis.reshape(len(target.basis), -1).T.astype(np.float64)
    known = np.linalg.lstsq(design, wanted.T.astype(np.float64), rcond=None)[0].T + target.rest
    assert build_parameter_transfer(source, target).clone_unlimited(values) == pytest.approx(known, abs=1e-3)


def test_limits_are_least_squares_within_limits() -> None:
    """An orthonormal basis: the nearest shape within limits is eq. 5, clipped."""
    source, target = model_of(5), replace(model_of(6), spread=np.full(6, 0.3, np.float32), rest=np.zeros(6, np.float32))
    values = motion_of(source, spreads=3)
    mapped = build_parameter_transfer(source, target).parameters(values)
    design = target.basis.reshape(6, -1).T.astype(np.float64)
    wanted = (values - source.rest) @ source.basis.reshape(6, -1).astype(np.float64)
    assert (np.abs(mapped) > 0.899).any()
    for frame, displacement in zip(mapped, wanted, strict=True):
        assert frame == pytest.approx(lsq_linear(design, displacement, (-0.9, 0.9)).x, abs=1e-4)


@some
@given(seeds, st.floats(0, 50), st.sampled_from([0.01, 1.0, 7.3]))
def test_no_parameter_leaves_three_spreads(seed: int, gain: float, narrow: float) -> None:
    source, target = model_of(seed), model_of(seed + 1)
    target = replace(target, spread=target.spread * np.float32(narrow), rest=target.rest * np.float32(narrow))
    mapped = build_parameter_transfer(source, target, gain=gain).parameters(motion_of(source, spreads=4))
    assert (np.abs(mapped.astype(np.float64)) <= 3.0 * target.spread.astype(np.float64)).all()


@some
@given(seeds)
def test_a_rest_beyond_three_spreads_extends_the_limit_of_its_mode(seed: int) -> None:
    """As of talkers of few sentences, in both roles."""
    source, far = model_of(seed), model_of(seed + 1)
    rest = far.rest.copy()
    rest[2] = -4.5 * far.spread[2]
    far = replace(far, rest=rest)
    limits = parameter_limits(far)
    assert limits[2] == -rest[2]
    assert np.delete(limits, 2) == pytest.approx(np.delete(3 * far.spread, 2))
    mapped = build_parameter_transfer(source, far).parameters(np.stack([source.rest, *motion_of(source, spreads=4)]))
    assert mapped[0] == pytest.approx(rest, abs=1e-5)
    assert (np.abs(mapped) <= limits).all()
    back = build_parameter_transfer(far, source).parameters(rest[None])
    assert back[0] == pytest.approx(source.rest, abs=1e-5)


@some
@given(seeds, st.floats(0.2, 3.0))
def test_the_gain_scales_the_displacement_from_rest(seed: int, gain: float) -> None:
    source, target = model_of(seed), model_of(seed + 1)
    values = motion_of(source)
    plain = build_parameter_transfer(source, target).clone_unlimited(values) - target.rest
    assert build_parameter_transfer(source, target, gain=gain).clone_unlimited(values) - target.rest == pytest.approx(
        gain * plain, abs=1e-9
    )


def test_two_modes_in_closed_form() -> None:
    """The target's modes are the source's turned by 30 degrees, its face twice as large."""
    source = model_of(2, 2, 1)
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(np.pi / 6), np.sin(np.pi / 6)], [-np.sin(np.pi / 6), np.cos(np.pi / 6)]]
    basis = np.tensordot(turn, source.basis, axes=1).astype(np.float32)
    rest = np.array([1.0, -2.0, 0.5], np.float32)
    target = ShapeModel(2 * source.mean, basis, np.full(3, 100, np.float32), 2, rest)
    moved = build_parameter_transfer(source, target, gain=1.5).parameters(
        source.rest + np.array([[4.0, 0.0, 0.0], [0.0, 4.0, 1.0]])
    )
    expected = rest + 12 * np.array([[np.cos(np.pi / 6), -0.5, 0.0], [0.5, np.cos(np.pi / 6), 0.25]])
    assert moved == pytest.approx(expected, abs=1e-4)


def test_a_round_trip_loses_only_motion_outside_the_target() -> None:
    source, target = model_of(8), model_of(9, size=1.3)
    wide = np.full(6, 1000, np.float32)
    source, target = replace(source, spread=wide), replace(target, spread=wide)
    values = motion_of(model_of(8))
    lost = build_parameter_transfer(target, source).parameters(
        build_parameter_transfer(source, target).parameters(values)
    )
    seen = inner_product_map(source.basis.reshape(6, -1), target.basis.reshape(6, -1))
    assert lost - source.rest == pytest.approx((values - source.rest) @ seen.T @ seen, abs=1e-4)
    whole = append_missing_components(source, target)
    back = build_parameter_transfer(whole, source).parameters(
        build_parameter_transfer(source, whole).parameters(values)
    )
    assert back == pytest.approx(values, abs=1e-3)


@some
@given(seeds, st.integers(0, 6))
def test_appended_modes_keep_the_talker_file_s_invariants(seed: int, n: int) -> None:
    source, target = model_of(seed), model_of(seed + 1, 3, 3, size=1.2)
    joined = append_missing_components(source, target, n)
    flat = joined.basis.reshape(len(joined.basis), -1).astype(np.float64)
    assert flat @ flat.T == pytest.approx(np.eye(6 + n), abs=1e-6)
    assert not joined.basis[: joined.n_speech, ~MOUTH].any()
    assert not joined.basis[joined.n_speech :, MOUTH].any()
    others = slice(joined.n_speech, joined.n_speech + 3)
    assert np.array_equal(joined.basis[:3], target.basis[:3])
    assert np.array_equal(joined.basis[others], target.basis[3:])
    assert np.array_equal(joined.spread[others], target.spread[3:])
    assert joined.shapes(joined.rest[None]) == pytest.approx(target.shapes(target.rest[None]), abs=1e-5)


def test_with_all_missing_components_the_target_spans_the_source() -> None:
    source, target = model_of(1), model_of(2, 3, 3)
    joined = append_missing_components(source, target)
    seen = inner_product_map(source.basis.reshape(6, -1), joined.basis.reshape(len(joined.basis), -1))
    assert (seen**2).sum(axis=0) == pytest.approx(np.ones(6), abs=1e-6)


def test_components_are_appended_in_order_of_motion() -> None:
    source, target = model_of(1), model_of(2, 3, 3, size=1.5)
    lost = []
    for n in range(7):
        transfer = build_parameter_transfer(source, append_missing_components(source, target, n))
        lost.append(((source.spread**2) * (1.5**2 - (transfer.relation**2).sum(axis=0))).sum())
    assert all(np.diff(lost) < 0)
    assert lost[-1] == pytest.approx(0, abs=1e-4)


def test_the_spread_of_an_appended_mode_is_the_source_s_about_its_rest() -> None:
    """A source with one mode outside the target: what is missing is that mode, at the target's size."""
    target = model_of(3, 3, 2, size=2.0)
    own = model_of(4, 1, 1)
    own = replace(own, spread=np.array([3.0, 0.01], np.float32), rest=np.array([4.0, 0], np.float32))
    joined = append_missing_components(own, target)
    unseen = inner_product_map(own.basis.reshape(2, -1), target.basis.reshape(5, -1))[:, 0]
    assert joined.spread[3] == pytest.approx(2 * 5 * np.sqrt(1 - unseen @ unseen), rel=1e-5)
    assert len(joined.spread) == 6


def test_the_same_model_has_no_missing_components() -> None:
    model = model_of(1)
    assert np.array_equal(append_missing_components(model, model).basis, model.basis)
    with pytest.raises(InputError, match="0 components of the source are missing in the target, not 1"):
        append_missing_components(model, model, 1)


def test_frames_are_independent() -> None:
    source, target = model_of(1), opening_model()
    transfer, values = build_parameter_transfer(source, target), motion_of(source, spreads=3)
    assert np.array_equal(transfer.parameters(values)[::-1], transfer.parameters(values[::-1]))
    assert np.array_equal(transfer.parameters(values)[4:5], transfer.parameters(values[4:5]))


def test_speech_parameters_map_to_speech_parameters() -> None:
    source, target = model_of(1, 4, 2), model_of(2, 3, 5)
    transfer, values = build_parameter_transfer(source, target), motion_of(source)
    whole = transfer.clone(Trajectory([f"shape{i}" for i in range(6)], values, 25.0))
    speech = transfer.clone(Trajectory([f"shape{i}" for i in range(4)], values[:, :4], 25.0))
    assert (len(whole.channels), speech.channels, speech.fps) == (8, ("shape0", "shape1", "shape2"), 25.0)
    assert whole.values[:, :3] == pytest.approx(speech.values, abs=1e-6)  # other modes do not reach the mouth


def test_invalid_input_is_refused() -> None:
    source, target = model_of(1), model_of(2)
    with pytest.raises(InputError, match="gain must be 0 or more, not -1"):
        build_parameter_transfer(source, target, gain=-1)
    with pytest.raises(InputError, match="not nan"):
        build_parameter_transfer(source, target, gain=float("nan"))
    with pytest.raises(InputError, match=r"channels \('jawOpen',\)... \(1\) are not the source's 4 speech"):
        build_parameter_transfer(source, target).clone(Trajectory(["jawOpen"], [[0.0]], 25.0))
    with pytest.raises(InputError, match=r"\(5\) are not the source's 4 speech"):
        build_parameter_transfer(source, target).clone(
            Trajectory([f"shape{i}" for i in range(5)], np.zeros((1, 5)), 25.0)
        )
    few = replace(source, mean=source.mean[:68], basis=source.basis[:, :68])
    with pytest.raises(DataError, match="68 landmarks, not 478"):
        build_parameter_transfer(few, target)
    with pytest.raises(DataError, match="68 landmarks, not 478"):
        append_missing_components(source, few)
    with pytest.raises(
        DataError, match=r"rest of a talker lies .* standard deviations from its mean in mode 2, limit 20"
    ):
        build_parameter_transfer(source, replace(target, rest=np.array([0, 0, 9e9, 0, 0, 0], np.float32)))
    with pytest.raises(InputError, match="6 components of the source are missing in the target, not 13"):
        append_missing_components(source, target, 13)


def test_a_real_talker_keeps_limits_and_lips_under_gain() -> None:
    """The starter talker onto half of its own modes, amplified."""
    talker = load_talker("grid_s1")
    own, kept = talker.model, [*range(10), *range(20, 25)]
    half = ShapeModel(own.mean, own.basis[kept], own.spread[kept], 10, own.rest[kept])
    values = np.concatenate([utterance.shape for utterance in talker.utterances[:10]])
    transfer = build_parameter_transfer(own, half, gain=1.5)
    mapped = transfer.parameters(values)
    assert (np.abs(mapped) <= parameter_limits(half)).all()
    assert gaps_of(half, mapped).min() > 0
    middle = [INNER_UPPER_LIP.index(UPPER_LIP_INNER_MID)]
    assert INNER_LOWER_LIP[middle[0]] == LOWER_LIP_INNER_MID
    opened = [gaps_of(model, frames)[:, middle[0]] for model, frames in ((own, values), (half, mapped))]
    assert np.corrcoef(*opened)[0, 1] > 0.98
