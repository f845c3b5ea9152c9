"""One channel of a recording from several."""

import wave
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from tts2face.request import Request
from tts2face.serving.work.resource_check import RefusedFileError
from tts2face.serving.work.uploaded_file import decode_sound
from tts2face.session.prepared import prepare
from tts2face.video import channels
from tts2face.video.channels import channel_samples as samples_of
from tts2face.video.channels import mix_of_products
from tts2face.video.media import read_sound, sound_blocks
from tts2face.video.sound_survey import survey_sound

RATE = 48_000
RNG = np.random.default_rng(3)
NONE = np.zeros(RATE)
VOICE = 0.2 * np.sin(2 * np.pi * 180 * np.arange(RATE) / RATE) * np.hanning(RATE)
OTHER = 0.2 * np.sin(2 * np.pi * 310 * np.arange(RATE) / RATE) * np.hanning(RATE)
NOISE = RNG.normal(0, 0.002, RATE)
BASS = 0.3 * np.sin(2 * np.pi * 40 * np.arange(RATE) / RATE)
SIX = ("FL", "FR", "FC", "LFE", "BL", "BR")
PLACES = {
    "mono": [VOICE], "both sides": [VOICE, VOICE], "left": [VOICE, NONE], "right": [NONE, VOICE],
    "right beside noise": [NOISE, VOICE], "centre of three": [NONE, NONE, VOICE],
    "centre of six": [NONE, NONE, VOICE, NONE, NONE, NONE], "fourth microphone": [NONE, NONE, NONE, VOICE],
    "last of eight": [NONE] * 7 + [VOICE], "all of six": [VOICE] * 6, "behind": [NONE, NONE, NONE, NONE, VOICE, VOICE],
    "inverted": [VOICE, -VOICE], "inverted and weaker": [0.6 * VOICE, -VOICE], "offset": [NONE + 0.3, VOICE - 0.2],
    "inverted in noise": [VOICE + NOISE, NOISE[::-1] - VOICE], "two of six inverted": [VOICE, -VOICE, *[NONE] * 4],
}  # fmt: skip


def write(path: Path, channels: list[NDArray[np.floating]]) -> Path:
    with wave.open(str(path), "wb") as file:
        file.setparams((len(channels), 2, RATE, 0, "NONE", ""))
        file.writeframes((np.clip(np.stack(channels, 1), -1, 1) * 32767).astype("<i2").tobytes())
    return path


def level(samples: NDArray[np.floating]) -> float:
    return float(20 * np.log10(np.std(samples)))


@pytest.mark.parametrize("name", PLACES)
def test_a_voice_keeps_its_level_wherever_it_stands(name: str, tmp_path: Path) -> None:
    path = write(tmp_path / "a.wav", PLACES[name])
    found = read_sound(path, RATE).samples
    assert level(found) == pytest.approx(level(VOICE), abs=0.1)
    assert abs(np.corrcoef(found, VOICE)[0, 1]) > 0.99
    np.testing.assert_allclose(np.concatenate(list(sound_blocks(path, RATE))), found, atol=1e-4)
    decode_sound(path, tmp_path / "sent.wav", 10.0)  # what is sent to the service
    np.testing.assert_allclose(read_sound(tmp_path / "sent.wav", RATE).samples, found, atol=1e-3)


@pytest.mark.parametrize(("name", "taken"), [("inverted", 1), ("inverted and weaker", 2), ("both sides", 0)])
def test_a_channel_that_stands_for_all_is_named(name: str, taken: int, tmp_path: Path) -> None:
    mix = survey_sound(write(tmp_path / "a.wav", PLACES[name])).mix
    assert mix.taken == taken
    assert mix.note("a.wav") == (
        f"the 2 channels of a.wav cancel each other, as one is inverted: channel {taken} is taken alone; give a file "
        "with one channel to use another one"
        if taken
        else ""
    )


@pytest.mark.parametrize(
    ("channels", "gains"),
    [  # gains that BS.775-3 gives to the channels beside the loudest one
        ([0.1 * OTHER, 0.1 * OTHER, VOICE, NONE, NONE, NONE], {0: 0.7071, 1: 0.7071, 2: 1.0}),
        ([NONE, NONE, VOICE, BASS, 0.1 * OTHER, NONE], {2: 1.0, 3: 0.0, 4: 0.5}),
        ([VOICE, OTHER, NONE, NONE, NONE, NONE], {0: 0.7071, 1: 0.7071}),
    ],
)
def test_channels_of_a_layout_have_their_weights(channels: list[NDArray[np.floating]], gains: dict[int, float]) -> None:
    sound = np.stack(channels)
    mix = mix_of_products(sound @ sound.T, SIX)
    for channel, gain in gains.items():
        assert mix.weights[channel] == pytest.approx(gain, abs=0.02)


@pytest.mark.parametrize("layout", ["3.1.2", "5.1.2", "5.1.4", "7.1.2", "7.1.4", "9.1.4", "22.2"])
def test_bass_is_left_out_of_a_layout_with_height(layout: str) -> None:
    names = tuple(channel.name for channel in av.AudioLayout(layout).channels)
    places = {"FC": VOICE, "LFE": BASS, "TFL": 0.1 * OTHER}
    sound = np.stack([places.get(name, NONE) for name in names])
    weights = dict(zip(names, mix_of_products(sound @ sound.T, names).weights, strict=True))
    assert weights["FC"] == pytest.approx(1.0, abs=0.02)
    assert weights["LFE"] == 0.0
    assert weights["TFL"] == weights["TFR"] == pytest.approx(0.5, abs=0.02)  # above, as beside the listener


def test_a_channel_above_can_hold_the_voice() -> None:
    names = tuple(channel.name for channel in av.AudioLayout("7.1.4").channels)
    sound = np.stack([VOICE if name == "TBR" else NONE for name in names])
    assert mix_of_products(sound @ sound.T, names).weights[names.index("TBR")] == pytest.approx(1.0)


def test_ambisonics_are_heard_from_all_directions() -> None:
    names = tuple(channel.name for channel in av.AudioLayout("ambisonic 1").channels)
    sound = np.stack([0.7 * VOICE, VOICE, NONE, NONE])  # from the left
    np.testing.assert_allclose(mix_of_products(sound @ sound.T, names).weights, [1, 0, 0, 0], atol=1e-6)


def test_only_bass_is_better_than_nothing() -> None:
    sound = np.stack([NONE, NONE, NONE, BASS, NONE, NONE])
    assert mix_of_products(sound @ sound.T, SIX).weights[3] == pytest.approx(1.0)


def test_silence_has_no_channel_to_choose() -> None:
    mix = mix_of_products(np.zeros((2, 2)), ("FL", "FR"))
    assert mix.taken == 0
    np.testing.assert_array_equal(mix.weights, [0.5, 0.5])


def test_a_request_says_which_channel_it_takes(tmp_path: Path) -> None:
    inverted = write(tmp_path / "a.wav", PLACES["inverted"])
    (note,) = prepare(Request(audio=inverted)).notes
    assert note.startswith("the 2 channels of a.wav cancel each other")
    assert prepare(Request(audio=write(tmp_path / "b.wav", PLACES["right"]))).notes == ()


def write_tracks(path: Path, tracks: list[NDArray[np.floating]]) -> Path:
    with av.open(str(path), "w") as container:
        streams = [container.add_stream("flac", rate=RATE, layout="mono") for _ in tracks]
        for at in range(0, len(tracks[0]), 4800):
            for stream, samples in zip(streams, tracks, strict=True):
                block = np.round(samples[None, at : at + 4800] * 32767).astype(np.int16)
                frame = av.AudioFrame.from_ndarray(block, format="s16", layout="mono")
                frame.sample_rate, frame.pts = RATE, at
                container.mux(stream.encode(frame))
        for stream in streams:
            container.mux(stream.encode(None))
    return path


HUM = np.sin(2 * np.pi * 50 * np.arange(RATE) / RATE)
SPEECH = VOICE * (np.arange(RATE) // 6000 % 2)  # with pauses
NO_SPEECH = {
    "silence": NONE, "dither": RNG.integers(-1, 2, RATE) / 32767, "hum": 0.01 * HUM, "loud hum": 0.3 * HUM,
    "noise": 10 * NOISE, "hum that begins late": np.where(np.arange(RATE) < RATE // 2, 0, 0.1 * HUM),
    "crosstalk": 0.001 * SPEECH, "offset": NONE + 0.2, "hum in noise": 0.02 * HUM + NOISE,
}  # fmt: skip


@pytest.mark.parametrize("name", NO_SPEECH)
def test_the_first_track_with_speech_is_taken(name: str, tmp_path: Path) -> None:
    path = write_tracks(tmp_path / "screen.mkv", [NO_SPEECH[name], SPEECH, VOICE])
    assert np.corrcoef(read_sound(path, RATE).samples, SPEECH)[0, 1] > 0.99
    is_silent = name in {"silence", "offset"}
    assert survey_sound(path).mix.note("screen.mkv") == (
        f"sound track 2 of 3 of screen.mkv is taken, as what precedes it is {'silent' if is_silent else 'noise'}"
        f"{'' if is_silent else ' without speech'}; give a file with one track to use another one"
    )


@pytest.mark.parametrize(
    "tracks",
    [[0.1 * SPEECH, SPEECH], [SPEECH + 3 * NOISE, VOICE], [SPEECH, NONE], [10 * NOISE, NONE], [0.1 * HUM, NOISE]],
)
def test_speech_or_the_only_sound_stays_the_first_track(tracks: list[NDArray[np.floating]], tmp_path: Path) -> None:
    path = write_tracks(tmp_path / "screen.mkv", tracks)
    assert survey_sound(path).notes("screen.mkv") == ()


def test_an_upload_that_is_too_long_is_decoded_to_its_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []
    monkeypatch.setattr(channels, "channel_samples", lambda frame: seen.append(frame.samples) or samples_of(frame))
    path = write(tmp_path / "a.wav", [np.tile(VOICE, 20), np.tile(OTHER, 20)])
    with pytest.raises(RefusedFileError, match="longer than 3 s"):
        decode_sound(path, tmp_path / "sent.wav", 3.0)
    assert sum(seen) < 2 * 3.5 * RATE
