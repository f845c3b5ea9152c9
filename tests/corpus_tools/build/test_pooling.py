"""Lip tracks of another speaker: features of both landmark schemes, reading, alignment without sound, and pooling."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from corpus_tools.pool_talker import pool_talker
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.training.network_training import TrainingOptions
from corpus_tools.training.phone_codes import feature_table
from corpus_tools.training.phone_network import FEATURE_NOISE, add_phone_network, follow_features
from corpus_tools.training.pooling.lip_alignment import LipSpeech, align_phones, alignment_features, fit_part_model
from corpus_tools.training.pooling.lip_features import FEATURES, landmark_features, parameter_features, track_features
from corpus_tools.training.pooling.lip_tracks import LipTrack, SpokenPhone, read_lip_tracks
from corpus_tools.training.pooling.speech import align_lip_tracks, spoken_sequence
from corpus_tools.training.train_talker import learn_talker
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE
from tests.corpus_tools.speaking import FPS, observation
from tts2face.models.landmarks import CHIN
from tts2face.models.talker import Talker
from tts2face.models.talker_file import read_talker, write_talker

ERROR_BEFORE_S = 0.3  # of the times given with a track
PHONE_ROWS = "\n".join(
    (
        "start_s\tend_s\tphone\tword",
        "0.0\t0.4\tSIL\t",
        "0.4\t0.5\tAH\tabout,",
        "0.5\t0.6\tB\tabout,",
        "0.6\t0.8\tAW\tabout,",
        "0.8\t0.9\tT\tabout,",
        "",
    )
)


@pytest.fixture(scope="module")
def talker() -> Talker:
    return learn_talker([observation(number) for number in range(30)], metadata=EVALUATION_METADATA)


@pytest.fixture(autouse=True)
def long_training(monkeypatch: pytest.MonkeyPatch) -> None:
    """More passes over the few artificial utterances than over hours of recordings."""
    options = TrainingOptions(hidden=(24, 16), n_epochs=120, weight_decay=1e-5)
    monkeypatch.setattr("corpus_tools.training.pooling.lip_alignment.TRAINING", options)


def track(number: int, n_utterances: int = 4) -> tuple[LipTrack, np.ndarray]:
    """A track of several utterances with a larger mouth, phones with wrong times; the true ends of the phones."""
    seen = [observation(200 + 10 * number + at, 2.0) for at in range(n_utterances)]
    features = np.concatenate([landmark_features(one.landmarks, one.landmarks[0]) for one in seen])
    stream, labels, ends, begin = np.random.default_rng(number), [], [], 0.0
    for one in seen:
        for label, end in zip(one.phones.phones, one.phones.edges[1:], strict=True):
            labels.append(label)
            ends.append(begin + end)
        begin += len(one.landmarks) / FPS
        ends[-1] = begin
    merged = [
        at for at in range(len(labels)) if at + 1 == len(labels) or (labels[at], labels[at + 1]) != (SILENCE, SILENCE)
    ]
    true = np.array([ends[at] for at in merged])
    wrong = np.maximum.accumulate(true + stream.uniform(-ERROR_BEFORE_S, ERROR_BEFORE_S, len(true)))
    phones = tuple(
        SpokenPhone(labels[at], float(end), is_optional=False) for at, end in zip(merged, wrong, strict=True)
    )
    return LipTrack(f"t{number}", FPS, features - features.mean(axis=0), phones), true


def test_alignment_finds_the_edges_without_sound(talker: Talker) -> None:
    tracks, true = zip(*(track(number) for number in range(3)), strict=True)
    found = align_lip_tracks(tracks, talker)
    errors = np.concatenate([np.abs(one.phones.edges[1:-1] - ends[:-1]) for one, ends in zip(found, true, strict=True)])
    given = np.concatenate([[phone.end for phone in one.phones] - ends for one, ends in zip(tracks, true, strict=True)])
    # Bilabials and silence look alike in the artificial mouth, so that single edges stay uncertain.
    assert np.median(errors) < 0.07
    assert np.median(errors) < 0.6 * np.median(np.abs(given))
    for one in found:
        np.testing.assert_allclose(one.features[one.is_used].mean(axis=0), 0.0, atol=1e-9)
        np.testing.assert_allclose(one.features[one.is_used].std(axis=0)[:2], 1.0, rtol=1e-9)


def test_the_right_text_costs_less_than_a_wrong_one(talker: Talker) -> None:
    inventory = tuple(sorted({phone for one in talker.utterances for phone in one.phones.phones}))
    known = [
        LipSpeech(alignment_features(landmark_features(seen.landmarks, seen.landmarks[0]), FPS), seen.phones)
        for seen in (observation(number) for number in range(30))
    ]
    scale = np.concatenate([one.features for one in known])
    scaled = [
        LipSpeech((one.features - scale.mean(axis=0)) / np.maximum(scale.std(axis=0), 1e-9), one.phones)
        for one in known
    ]
    model = fit_part_model(scaled, [], inventory, feature_table(inventory))
    one = scaled[3]
    labels, expected = list(one.phones.phones), one.phones.edges[1:]
    required = np.zeros(len(labels), bool)
    _, right = align_phones(one.features, labels, required, expected, model, speaker=0)
    _, wrong = align_phones(
        one.features, [labels[0], *labels[-2:0:-1], labels[-1]], required, expected, model, speaker=0
    )
    assert right < wrong


def test_an_optional_silence_is_skipped_where_there_is_none(talker: Talker) -> None:
    one, true = track(0)
    padded = []
    for phone in one.phones:
        padded.append(phone)
        if phone.label != SILENCE:
            padded.append(SpokenPhone(SILENCE, phone.end, is_optional=True))
    (found,) = align_lip_tracks([replace(one, phones=tuple(padded))], talker)
    n_sounding = sum(label != SILENCE for label in found.phones.phones)
    assert n_sounding == sum(phone.label != SILENCE for phone in one.phones)
    labels = (SILENCE, *found.phones.phones, SILENCE)
    apart = [
        at
        for at in range(2, len(labels) - 2)
        if labels[at] == SILENCE and not {"p", "b", "m"} & {labels[at - 1], labels[at + 1]}
    ]
    n_pauses = sum(phone.label == SILENCE for phone in one.phones[1:-1])
    assert len(apart) <= n_pauses  # closed lips beside a bilabial may be read as a pause
    assert found.phones.end == pytest.approx(true[-1], abs=0.1)


def test_phones_that_do_not_fit_are_refused(talker: Talker) -> None:
    one, _ = track(0)
    with pytest.raises(DataError, match="phones do not fit into"):
        align_lip_tracks([replace(one, phones=one.phones * 40)], talker)


def test_phones_without_duration_are_omitted() -> None:
    spoken = spoken_sequence([SILENCE, "p", SILENCE, "i"], np.array([0.2, 0.3, 0.3, 0.5]))
    assert spoken.phones == (SILENCE, "p", "i")
    np.testing.assert_array_equal(spoken.edges, [0.0, 0.2, 0.3, 0.5])


def dlib_points(opening: np.ndarray, roll: np.ndarray, scale: float) -> np.ndarray:
    """(T, 68, 2) points whose inner lips are `opening` apart, of a head that rolls, at `scale` pixels."""
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (68, 2))
    points[[36, 45]] = (-0.5, 0.0), (0.5, 0.0)
    points[[61, 62, 63, 65, 66, 67], 1] = 0.5
    moved = np.tile(points, (len(opening), 1, 1))
    moved[:, 65:68, 1] += opening[:, None]
    turn = np.stack([np.stack([np.cos(roll), -np.sin(roll)], 1), np.stack([np.sin(roll), np.cos(roll)], 1)], 1)
    return scale * np.einsum("tij,tpj->tpi", turn, moved) + 300


def test_features_do_not_depend_on_roll_size_and_position() -> None:
    times = np.arange(500) / 25
    opening = 0.05 + 0.03 * np.sin(2 * np.pi * 2 * times)
    still = track_features(dlib_points(opening, np.zeros(500), 150.0), 25.0)
    rolled = track_features(dlib_points(opening, 0.2 * np.sin(0.3 * times), 200.0), 25.0)
    assert np.corrcoef(still[25:-25, 0], opening[25:-25])[0, 1] > 0.99
    np.testing.assert_allclose(rolled[25:-25, 0], still[25:-25, 0], atol=0.002)
    assert still.shape == (500, len(FEATURES))


def test_slow_drift_is_removed() -> None:
    times = np.arange(1500) / 25
    speech = 0.03 * np.sin(2 * np.pi * 2 * times)
    drifting = track_features(dlib_points(0.1 + speech + 0.05 * times / 60, np.zeros(1500), 150.0), 25.0)
    assert np.corrcoef(drifting[100:-100, 0], speech[100:-100])[0, 1] > 0.99
    assert abs(drifting[-200:-100, 0].mean() - drifting[100:200, 0].mean()) < 0.005


def test_both_schemes_measure_the_same_distances() -> None:
    one = observation(3)
    features = landmark_features(one.landmarks, one.landmarks[0])
    eyes = 90.0  # mm in the artificial face
    np.testing.assert_allclose(features[:, 3], -one.landmarks[:, CHIN, 1] / eyes, rtol=1e-5)
    width = np.linalg.norm(one.landmarks[:, 61] - one.landmarks[:, 291], axis=1) / eyes
    np.testing.assert_allclose(features[:, 1], width, rtol=1e-5)


def test_features_of_parameters_are_those_of_their_landmarks(talker: Talker) -> None:
    parameters = talker.utterances[0].shape[:, : talker.model.n_speech]
    expected = landmark_features(talker.model.shapes(parameters), talker.model.mean)
    np.testing.assert_allclose(parameter_features(parameters, talker.model), expected, atol=1e-6)  # float32 landmarks


def write_track(folder: Path, rows: str = PHONE_ROWS, points: np.ndarray | None = None) -> Path:
    folder.mkdir()
    kept = dlib_points(np.full(60, 0.05), np.zeros(60), 150.0) if points is None else points
    np.savez(folder / "a.npz", points=kept.astype(np.int16), fps=25.0)
    (folder / "a.phones.tsv").write_text(rows, encoding="utf-8")
    return folder


def test_unstressed_vowels_are_read_from_the_dictionary(tmp_path: Path) -> None:
    (read,) = read_lip_tracks(write_track(tmp_path / "t"))
    assert [phone.label for phone in read.phones] == [SILENCE, "ə", "b", "aʊ", "t", SILENCE]
    assert [phone.is_optional for phone in read.phones] == [False] * 6
    assert [phone.end for phone in read.phones] == [0.4, 0.5, 0.6, 0.8, 0.9, 60 / 25]


@pytest.mark.parametrize(
    ("rows", "points", "reason"),
    [
        (PHONE_ROWS.replace("AW", "QQ"), None, "line 5: .*QQ"),
        (PHONE_ROWS.replace("0.8", "x"), None, "'x' is not a number of seconds"),
        (PHONE_ROWS.replace("\tabout,\n", "\n"), None, "line 3: 3 columns, not 4"),
        ("a\tb\n", None, "must have the columns"),
        ("start_s\tend_s\tphone\tword\n", None, "holds no phones"),
        (PHONE_ROWS, np.zeros((60, 136)), "points must be"),
    ],
)
def test_damaged_tracks_are_refused(tmp_path: Path, rows: str, points: np.ndarray | None, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        read_lip_tracks(write_track(tmp_path / "t", rows, points))


def test_a_track_without_phones_or_a_folder_without_tracks_is_refused(tmp_path: Path) -> None:
    (write_track(tmp_path / "t") / "a.phones.tsv").unlink()
    with pytest.raises(DataError, match=r"add a\.phones\.tsv"):
        read_lip_tracks(tmp_path / "t")
    with pytest.raises(InputError, match="holds no lip tracks"):
        read_lip_tracks(tmp_path / "none")


def test_pooled_networks_know_phones_of_both_speakers(talker: Talker, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("corpus_tools.training.phone_network.MIN_FRAMES", 100)
    pooled = align_lip_tracks([track(0)[0]], talker)
    trained = add_phone_network(talker, pooled)
    assert trained.network is not None
    assert {"ʃ", "ɔɪ", "ʒ", "ŋ"} < set(trained.network.inventory)
    assert trained.network.weights[-1].shape[2] == talker.model.n_speech
    again = add_phone_network(talker, pooled)
    assert again.network is not None
    for one, other in zip(trained.network.weights, again.network.weights, strict=True):
        assert one.tobytes() == other.tobytes()


def test_parameters_follow_the_features_that_a_network_predicts() -> None:
    """Two features that are linear in three parameters; the network's own prediction of them is drawn to the other.

    The minimum of the sum of both errors in single frames cannot share a mistake with the folded weights.
    """
    stream = np.random.default_rng(4)
    parameters = stream.normal(size=(4000, 3)) * [1.0, 0.7, 0.4] + [0.2, -0.1, 0.3]
    to_features = stream.normal(size=(3, 2))
    targets = np.hstack([parameters, parameters @ to_features, stream.normal(size=(4000, 6))]).astype(np.float32)
    layers = [stream.normal(size=shape).astype(np.float32) for shape in ((1, 2, 5), (4, 5), (1, 5), (5, 6), (6,))]
    outer, biases = (stream.normal(size=shape).astype(np.float32) for shape in ((6, 11), (11,)))
    made = follow_features((*layers, outer, biases), targets, 3)
    for before, after in zip(layers, made[:5], strict=True):
        assert before is after
    hidden = stream.uniform(size=(50, 6)).astype(np.float32)
    plain, drawn = hidden @ outer + biases, hidden @ made[5] + made[6]
    np.testing.assert_array_equal(drawn[:, 3:], plain[:, 3:])
    precision = np.linalg.inv(np.cov(targets[:, :3].T.astype(np.float64)))
    for one, other in zip(plain.astype(np.float64), drawn.astype(np.float64), strict=True):
        offset = targets[:, 3:5].mean(axis=0) - targets[:, :3].mean(axis=0) @ to_features

        def loss(change: np.ndarray, one: np.ndarray = one, offset: np.ndarray = offset) -> float:
            apart = one[3:5] - ((one[:3] + change) @ to_features + offset)
            return float(change @ precision @ change + apart @ apart / FEATURE_NOISE)

        best = loss(other[:3] - one[:3])
        for _ in range(10):
            assert loss(other[:3] - one[:3] + stream.normal(size=3) * 0.02) > best


def test_the_command_keeps_all_of_the_talker_but_its_networks(
    tmp_path: Path, talker: Talker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("corpus_tools.training.phone_network.MIN_FRAMES", 100)
    monkeypatch.setattr("corpus_tools.pool_talker.MIN_FRAMES", 100)
    monkeypatch.setattr("corpus_tools.pool_talker.read_lip_tracks", lambda _: [track(0)[0]])
    write_talker(tmp_path / "a.talker", talker)
    (tmp_path / "tracks").mkdir()
    flags = [str(tmp_path / "a.talker"), str(tmp_path / "tracks"), "--source", "artificial lips, CC0"]
    assert run(["corpus", "pool", *flags, "--out", str(tmp_path / "b.talker")]) == 0
    one, other = (read_talker(tmp_path / f"{name}.talker") for name in "ab")
    assert other.metadata["pooled"] == "artificial lips, CC0"
    assert one.network is None
    assert other.network is not None
    for before, after in zip(one.utterances, other.utterances, strict=True):
        np.testing.assert_array_equal(before.shape, after.shape)


def test_a_talker_that_is_too_short_or_a_missing_source_is_refused(tmp_path: Path, talker: Talker) -> None:
    write_talker(tmp_path / "a.talker", replace(talker, utterances=talker.utterances[:4]))
    with pytest.raises(InputError, match="too few for networks"):
        pool_talker(str(tmp_path / "a.talker"), tmp_path, tmp_path / "b.talker", source="x")
    with pytest.raises(InputError, match="source of the tracks is empty"):
        pool_talker(str(tmp_path / "a.talker"), tmp_path, tmp_path / "b.talker", source=" ")
