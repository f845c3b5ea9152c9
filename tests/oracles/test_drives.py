"""The linear drive against direct regression, the network against finite differences and a known answer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.training.linear_audio_map import TrainingUtterance, learn_linear_map
from corpus_tools.training.network_audio_map import NetworkMapOptions, learn_network_map, loss_and_gradient
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.audio_map import AudioMap
from tts2face.models.audio_map_file import StoredAudioMap
from tts2face.models.talker import ShapeModel, Talker, Utterance
from tts2face.models.talker_file import read_talker, write_talker

THREE = "level+level+level"  # three numbers a frame, as the lessons have


def lessons(n: int = 12, seed: int = 0, bend: float = 0.0) -> list[TrainingUtterance]:
    """Parameters that follow this frame's and the next frame's features, straight or bent."""
    generator = np.random.default_rng(seed)
    mixing = np.random.default_rng(7).normal(size=(3, 4))
    made = []
    for _ in range(n):
        features = generator.normal(2.0, (1.0, 3.0, 0.5), (60, 3))
        ahead = np.concatenate([features[1:], features[-1:]])
        cause = (features - 2.0 + 0.5 * (ahead - 2.0)) @ mixing
        seen = np.sin(bend * cause) / bend if bend else cause
        made.append(
            TrainingUtterance(
                features.astype(np.float32), (seen + generator.normal(0, 0.05, (60, 4))).astype(np.float32)
            )
        )
    return made


@pytest.mark.parametrize(("before", "after"), [(0, 0), (1, 2)])
def test_with_all_factors_equation_8_is_direct_regression(before: int, after: int) -> None:
    """As many parameters as numbers in a window: the factors span the whole input."""
    generator = np.random.default_rng(3)
    n_inputs = 3 * (before + 1 + after)
    taught = [
        TrainingUtterance(one.features, generator.normal(size=(60, n_inputs)).astype(np.float32) + one.features[:, :1])
        for one in lessons()
    ]
    drive = learn_linear_map(taught, feature="mfcc", before=before, after=after)
    rows = [np.pad(one.features, ((before, after), (0, 0)), mode="edge") for one in taught]
    inputs = np.concatenate(
        [np.concatenate([row[k : k + 60] for k in range(before + 1 + after)], axis=1) for row in rows]
    )
    seen = np.concatenate([one.parameters for one in taught])
    table = np.concatenate([inputs, np.ones((len(inputs), 1))], axis=1).astype(np.float64)
    expected = table @ np.linalg.lstsq(table, seen, rcond=None)[0]
    made = np.concatenate([drive.parameters(one.features) for one in taught])
    np.testing.assert_allclose(made, expected, atol=1e-4)  # float32 of numbers about 5


def test_with_fewer_factors_equation_8_is_still_least_squares_on_what_it_can_reach() -> None:
    """The factors of two visual parameters span both: the fit equals direct regression."""
    taught = [TrainingUtterance(one.features, one.parameters[:, :2]) for one in lessons()]
    drive = learn_linear_map(taught, feature="mfcc")
    assert len(drive.biases[0]) == 2
    inputs = np.concatenate([one.features for one in taught])
    table = np.concatenate([inputs, np.ones((len(inputs), 1))], axis=1).astype(np.float64)
    seen = np.concatenate([one.parameters for one in taught])
    expected = table @ np.linalg.lstsq(table, seen, rcond=None)[0]
    np.testing.assert_allclose(drive.parameters(inputs)[5:-5], expected[5:-5], atol=1e-4)


@pytest.mark.parametrize("decay", [0.0, 0.01])
def test_the_gradient_is_that_of_finite_differences(decay: float) -> None:
    generator = np.random.default_rng(0)
    shapes = ((4, 6), (4,), (3, 4), (3,))
    layers = tuple(generator.normal(0, 0.5, shape) for shape in shapes)
    inputs, seen = generator.normal(size=(20, 6)), generator.normal(size=(20, 3))
    _, slope = loss_and_gradient(layers, inputs, seen, decay)
    differences = []
    for which, layer in enumerate(layers):
        for place in np.ndindex(layer.shape):
            errors = []
            for step in (1e-6, -1e-6):
                moved = [one.copy() for one in layers]
                moved[which][place] += step
                errors.append(loss_and_gradient(tuple(moved), inputs, seen, decay)[0])
            differences.append((errors[0] - errors[1]) / 2e-6)
    np.testing.assert_allclose(slope, differences, atol=1e-8)


def test_the_network_learns_what_a_linear_map_cannot() -> None:
    taught, unseen = lessons(40, bend=0.5), lessons(5, seed=9, bend=0.5)
    straight = learn_linear_map(taught, feature="mfcc", after=1)
    bent = learn_network_map(
        taught, feature="mfcc", options=NetworkMapOptions(n_hidden=30, before=0, after=1, weight_decay=1e-6)
    )
    error = {
        name: np.mean([np.square(drive.parameters(one.features) - one.parameters).mean() for one in unseen])
        for name, drive in (("linear", straight), ("network", bent))
    }
    assert error["network"] < 0.4 * error["linear"]


def test_the_same_seed_gives_the_same_network_and_another_seed_another() -> None:
    options = [NetworkMapOptions(n_hidden=3, before=1, after=1, seed=seed) for seed in (0, 0, 1)]
    first, again, other = (learn_network_map(lessons(), feature="mfcc", options=one) for one in options)
    np.testing.assert_array_equal(first.weights[0], again.weights[0])
    assert not np.array_equal(first.weights[0], other.weights[0])


def test_pieces_with_their_context_are_the_whole() -> None:
    drive = learn_linear_map(lessons(), feature="mfcc", before=2, after=3)
    features = lessons(1)[0].features
    whole = drive.parameters(features)
    np.testing.assert_array_equal(drive.inside(features[5:20]), whole[7:17])


def test_a_talker_file_keeps_its_drives_and_old_files_have_none(tmp_path: Path) -> None:
    model = ShapeModel(
        np.zeros((478, 3), np.float32),
        np.linalg.qr(np.random.default_rng(0).normal(size=(1434, 4)))[0].T.reshape(4, 478, 3).astype(np.float32),
        np.ones(4, np.float32),
        4,
        np.zeros(4, np.float32),
    )
    motion = np.zeros((5, 4), np.float32)
    spoken = Utterance("a", PhoneSequence([SILENCE, "m"], [0.0, 0.1, 0.2]), (), motion, np.zeros((5, 6)), np.zeros(5))
    drive = learn_network_map(lessons(), feature=THREE, options=NetworkMapOptions(n_hidden=3, before=1, after=2))
    for drives in ({}, {"network": drive, "linear": learn_linear_map(lessons(), feature=THREE)}):
        path = tmp_path / "a.talker"
        write_talker(path, Talker(25.0, model, (spoken,), {"name": "Ada"}, audio_maps=drives))
        kept = read_talker(path).audio_maps
        assert set(kept) == set(drives)
    inputs = lessons(1)[0].features
    assert (kept["network"].feature, kept["network"].before, kept["network"].after) == (THREE, 1, 2)
    np.testing.assert_array_equal(kept["network"].parameters(inputs), drive.parameters(inputs))


def test_a_drive_that_lost_a_part_is_refused() -> None:
    stored = StoredAudioMap.of(learn_linear_map(lessons(), feature="mfcc"))
    inner, outer = stored.weights
    with pytest.raises(DataError, match="do not fit each other"):
        replace(stored, weights=(inner[:, :2], outer)).audio_map()


def test_features_of_another_number_are_refused() -> None:
    drive: AudioMap = learn_linear_map(lessons(), feature="mfcc")
    with pytest.raises(InputError, match="takes 3 features per frame, not the shape"):
        drive.parameters(np.zeros((10, 4)))


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: learn_linear_map([], feature="mfcc"), "needs training utterances with sound"),
        (lambda: learn_network_map(lessons(1), feature="mfcc", options=NetworkMapOptions()), "at least 2 utterances"),
        (lambda: NetworkMapOptions(n_hidden=0), "needs at least one hidden unit"),
        (lambda: TrainingUtterance(np.zeros((3, 2)), np.zeros((4, 2))), "not 3 and 4"),
    ],
)
def test_unusable_training_data_are_refused(make: object, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        make()
