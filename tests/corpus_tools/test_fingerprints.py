"""The same recordings, re-encoded or renamed, are found; others of the same person, or of the same words, are not."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from corpus_tools.measures.fingerprints import find_same, fingerprint_observations, fingerprint_talker, similarities
from corpus_tools.measures.splits import check_disjoint, check_unknown
from corpus_tools.recordings.observation import Observation, Quality
from corpus_tools.studies.evaluation.evaluate import evaluate, evaluate_across_talkers
from corpus_tools.studies.evaluation.people import evaluate_people
from corpus_tools.training.short_talker import learn_short_talker
from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence
from tts2face.models.talker import Talker, Utterance
from tts2face.models.talker_file import load_talker

RATE = 16_000


@pytest.fixture(scope="module")
def talker() -> Talker:
    shipped = load_talker("grid_s1")
    return replace(shipped, utterances=shipped.utterances[:60])


@pytest.fixture(scope="module")
def recorded(talker: Talker) -> list[Observation]:
    """The talker's recordings, without their files."""
    return [observed(talker, one) for one in talker.utterances]


def observed(talker: Talker, one: Utterance) -> Observation:
    landmarks = talker.model.shapes(one.shape)
    quality = Quality(-3000.0, 1.0, 0, 0.0)
    return Observation(
        one.name, talker.fps, landmarks, one.head, one.phones, one.words, one.intensity, quality, Path("none.mkv")
    )


def reencoded(one: Observation, *, fps: float = 30.0, cut_s: float = 0.2, jitter_mm: float = 0.1) -> Observation:
    """Another frame rate and beginning, jitter of the landmarks, and a level 12 dB lower; under another name."""
    seconds = np.arange(cut_s, (len(one.landmarks) - 1) / one.fps, 1 / fps)
    known = np.arange(len(one.landmarks)) / one.fps
    flat = np.column_stack([one.landmarks.reshape(len(known), -1), one.head, one.intensity])
    values = np.stack([np.interp(seconds, known, curve) for curve in flat.T], axis=1)
    landmarks = values[:, :-7].reshape(len(seconds), 478, 3)
    landmarks = landmarks + np.random.default_rng(0).normal(0, jitter_mm, landmarks.shape)
    edges = np.maximum(one.phones.edges - cut_s, np.arange(len(one.phones.edges)) * 1e-3)
    return replace(
        one,
        name=f"{one.name} again",
        fps=fps,
        landmarks=landmarks.astype(np.float32),
        head=values[:, -7:-1].astype(np.float32),
        intensity=(values[:, -1] - 12).astype(np.float32),
        phones=PhoneSequence(one.phones.phones, edges),
    )


def test_different_sentences_of_one_person_are_different(recorded: Sequence[Observation]) -> None:
    known = fingerprint_observations(recorded)
    assert find_same(known[:30], known[30:]) == ()


def test_reencoded_recordings_are_found_by_their_motion(recorded: Sequence[Observation]) -> None:
    again = [reencoded(one) for one in recorded[:10]]
    found = find_same(fingerprint_observations(recorded), fingerprint_observations(again))
    assert found == tuple((f"{one.name} again", one.name) for one in recorded[:10])


def test_recordings_are_found_in_a_talker(talker: Talker, recorded: Sequence[Observation]) -> None:
    assert len(find_same(fingerprint_talker(talker), fingerprint_observations([reencoded(recorded[3])]))) == 1
    with pytest.raises(
        InputError, match=rf"is in both the talker GRID s1 and the recordings, there as {recorded[3].name}"
    ):
        check_unknown(talker, [reencoded(recorded[3])])


def test_equal_durations_are_needed_where_the_motion_is_less_similar(recorded: Sequence[Observation]) -> None:
    """Most of the motion is that of another recording; the same words said again do not have the same durations."""
    one, other = recorded[0], recorded[1]
    n_frames = min(len(one.landmarks), len(other.landmarks))
    mixed = replace(
        one,
        landmarks=(one.landmarks[:n_frames] + 1.7 * (other.landmarks[:n_frames] - other.landmarks[:n_frames].mean(0))),
        head=one.head[:n_frames] + 1.7 * other.head[:n_frames],
        intensity=one.intensity[:n_frames],
    )
    known = fingerprint_observations([one])
    similar = similarities([fingerprint_observations([mixed])[0].motion], [known[0].motion])[0, 0]
    assert 0.5 <= similar < 0.71
    assert find_same(known, fingerprint_observations([mixed]))
    steps = np.random.default_rng(0).uniform(-0.02, 0.02, len(one.phones)) + one.phones.durations
    edges = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 0.02))])
    said_again = replace(mixed, phones=PhoneSequence(one.phones.phones, edges))
    assert not find_same(known, fingerprint_observations([said_again]))


def sound_file(path: Path, samples: np.ndarray, codec: str) -> Path:
    """A file of sound at 44.1 kHz."""
    import soxr

    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=44_100, layout="mono")
        frame = av.AudioFrame.from_ndarray(
            soxr.resample(samples.astype(np.float32), RATE, 44_100)[None], "fltp", "mono"
        )
        frame.sample_rate = 44_100
        container.mux([*stream.encode(frame), *stream.encode(None)])
    return path


def test_the_same_sound_is_found_whatever_the_motion(recorded: Sequence[Observation], tmp_path: Path) -> None:
    """Noise whose bands change like syllables; encoded as MP3 and AAC, and cut."""
    rng = np.random.default_rng(0)

    def babble() -> np.ndarray:
        parts = []
        for band in range(6):
            spectrum = np.fft.rfft(rng.normal(size=3 * RATE))
            spectrum[np.abs(np.fft.rfftfreq(3 * RATE, 1 / RATE) - 400 * (band + 1)) > 150] = 0
            level = np.interp(np.arange(3 * RATE) / RATE, np.arange(0, 3.1, 0.1), rng.exponential(1, 31))
            parts.append(np.fft.irfft(spectrum) * level)
        return 0.2 * np.sum(parts, axis=0) / np.abs(np.sum(parts, axis=0)).max()

    sounds = [babble() for _ in range(4)]
    files = [sound_file(tmp_path / f"{at}.m4a", sound, "aac") for at, sound in enumerate(sounds)]
    again = sound_file(tmp_path / "again.mp3", 0.3 * sounds[2][round(0.2 * RATE) :], "libmp3lame")
    known = [replace(one, video=file) for one, file in zip(recorded, files, strict=False)]
    other = replace(recorded[20], video=again)
    assert find_same(fingerprint_observations(known), fingerprint_observations([other])) == (
        (recorded[20].name, recorded[2].name),
    )


@pytest.mark.parametrize("name", ["other name", None])
def test_every_split_is_guarded(
    talker: Talker, recorded: Sequence[Observation], name: str | None, tmp_path: Path
) -> None:
    train, test = tuple(recorded[:30]), (replace(reencoded(recorded[5]), name=name or recorded[5].name),)
    where = f", there as {recorded[5].name}" if name else ""
    reason = rf"{test[0].name} is in both the training and the held-out part{where} \(1 in all\); remove it from one"
    with pytest.raises(InputError, match=reason):
        evaluate([(train, test)])
    with pytest.raises(InputError, match=reason):
        evaluate_across_talkers(train, test)
    with pytest.raises(InputError, match="is in both the talker GRID s1 and the recordings"):
        evaluate_people(talker, [test])


def test_a_base_that_holds_the_recordings_is_named(recorded: Sequence[Observation]) -> None:
    notes = learn_short_talker([reencoded(one) for one in recorded[:3]], "grid_s1", metadata={"name": "short"}).notes
    one = recorded[0].name
    assert notes[-1].startswith(f"the base grid_s1 was learnt from 3 of these recordings ({one} again, there as {one})")


def test_equal_names_of_different_recordings_are_a_warning(recorded: Sequence[Observation]) -> None:
    train, test = tuple(recorded[:10]), tuple(recorded[10:12])
    assert check_disjoint([(train, test)]) == ()
    renamed = (replace(test[0], name=train[0].name), test[1])
    (warning,) = check_disjoint([(train, renamed)])
    assert warning == (
        "1 name is in both the training and the held-out part, though the contents differ "
        f"({train[0].name}); check that none is a copy"
    )
