"""Training of audio maps: sound features have the frames of the landmarks."""

from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from cli.main import run
from corpus_tools.build_talker import add_audio_maps
from corpus_tools.recordings.observe import Observations
from corpus_tools.training.learn_audio_maps import (
    AUDIO_MAP_FEATURES,
    learn_audio_maps,
    sound_features,
    utterance_features,
)
from corpus_tools.training.network_audio_map import NetworkMapOptions
from corpus_tools.training.train_talker import learn_talker
from lexicon.errors import DataError, InputError
from tts2face.models.talker_file import read_talker, write_talker
from tts2face.sound.features import FEATURE_RATE
from tts2face.types import Waveform

ABOUT = dict.fromkeys(("name", "language", "sources", "licence", "attribution", "command", "created"), "")


def test_features_stand_on_the_clock_of_the_landmarks(make_observation) -> None:
    """An utterance that begins 0.4 s into its video, whose sound comes 0.2 s late: a click stays at its instant."""
    seen = make_observation("a", 1)
    seen = replace(seen, quality=replace(seen.quality, cut=0.4, lag=0.2))
    samples = np.zeros(4 * FEATURE_RATE)
    samples[round((0.4 + 0.2 + 10 / 25) * FEATURE_RATE)] = 1.0
    levels = utterance_features(seen, Waveform(samples, FEATURE_RATE), "level")
    assert levels.shape == (60, 1)
    assert levels.argmax() == 10


def talking_film(path: Path, opening: np.ndarray) -> Path:
    """A sound file whose loudness follows an opening (T,) at 25 frames a second."""
    generator = np.random.default_rng(0)
    times = np.arange(round(len(opening) / 25 * FEATURE_RATE)) / FEATURE_RATE
    loud = 10 ** (np.clip(np.interp(times, np.arange(len(opening)) / 25, opening), -20, 20) / 20)
    samples = np.clip(0.02 * loud * generator.normal(size=len(times)), -1, 1)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=FEATURE_RATE)
        stream.layout = "mono"
        frame = av.AudioFrame.from_ndarray((samples * 32767).astype(np.int16)[None], format="s16", layout="mono")
        frame.rate, frame.pts = FEATURE_RATE, 0
        for part in (frame, None):
            container.mux(stream.encode(part))
    return path


@pytest.fixture
def corpus(make_observation, tmp_path: Path) -> list:
    found = []
    for number in range(22):
        seen = make_observation(f"u{number:02d}", number)
        gap = seen.landmarks[:, 13] - seen.landmarks[:, 14]
        signed = gap @ np.linalg.svd(gap)[2][0]
        found.append(replace(seen, video=talking_film(tmp_path / f"u{number:02d}.wav", 10 * signed / signed.std())))
    return found


def test_audio_maps_follow_the_sound_they_were_trained_on(corpus: list) -> None:
    talker = learn_talker(corpus, n_speech=2, n_other=1, metadata=ABOUT)
    calls = []

    def stages(name: str):
        calls.append((name, []))
        return lambda done, of: calls[-1][1].append((done, of))

    audio_maps = learn_audio_maps(
        corpus, talker, network=NetworkMapOptions(n_hidden=4, before=1, after=1), stages=stages
    )
    assert calls == [
        ("computing sound features", [(n, 22) for n in range(1, 23)]),
        ("learning audio maps", [(1, 2), (2, 2)]),
    ]
    assert set(audio_maps) == {"linear", "network"}
    features = sound_features(corpus[:3], (AUDIO_MAP_FEATURES,))[AUDIO_MAP_FEATURES]
    for audio_map in audio_maps.values():
        assert audio_map.feature == AUDIO_MAP_FEATURES
        assert np.isfinite(audio_map.loudness)
        made = audio_map.parameters(features["u01"])
        assert made.shape == (60, 2)
        real = talker.utterances[1].shape[:, :2]
        assert np.corrcoef((real - real.mean(0)).ravel(), (made - made.mean(0)).ravel())[0, 1] > 0.3  # measured: .5


def test_a_talker_without_drives_is_given_them(
    corpus: list, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    talker = learn_talker(corpus, n_speech=2, n_other=1, metadata=ABOUT)
    write_talker(tmp_path / "bare.talker", talker)
    monkeypatch.setattr("corpus_tools.build_talker.observe", lambda *_, **__: Observations(tuple(corpus), ()))
    command = ["corpus", "audio-maps", str(tmp_path), "--talker", str(tmp_path / "bare.talker"), "--out"]
    assert run([*command, str(tmp_path / "full.talker")]) == 0
    assert "linear (features: mfcc+lsf), network (features: mfcc+lsf)" in capsys.readouterr().err
    full = read_talker(tmp_path / "full.talker")
    assert set(full.audio_maps) == {"linear", "network"}
    assert len(full.utterances) == len(talker.utterances)


@pytest.mark.parametrize(
    ("n", "fps", "refusal"),
    [(5, 25.0, (InputError, "too little speech")), (22, 30.0, (DataError, "talker's 30 frames per second"))],
)
def test_recordings_that_teach_no_drive_are_refused(
    n: int, fps: float, refusal: tuple, corpus: list, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    talker = replace(learn_talker(corpus, n_speech=2, n_other=1, metadata=ABOUT), fps=fps)
    monkeypatch.setattr("corpus_tools.build_talker.observe", lambda *_, **__: Observations(tuple(corpus[:n]), ()))
    kind, reason = refusal
    with pytest.raises(kind, match=reason):
        add_audio_maps(tmp_path, talker, tmp_path / "full.talker")
    assert not (tmp_path / "full.talker").exists()


def test_few_utterances_teach_no_drive(corpus: list) -> None:
    talker = learn_talker(corpus[:5], n_speech=2, n_other=1, metadata=ABOUT)
    assert learn_audio_maps(corpus[:5], talker) == {}
