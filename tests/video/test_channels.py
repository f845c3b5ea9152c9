"""One channel of a recording from several."""

import wave
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from tts2face.request import Request
from tts2face.serving.work.uploaded_file import decode_sound
from tts2face.session.prepared import prepare
from tts2face.video.channels import mix_of_products
from tts2face.video.media import channel_mix, read_sound, sound_blocks

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
    mix = channel_mix(write(tmp_path / "a.wav", PLACES[name]))
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


def test_the_first_track_that_is_not_silent_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "screen.mkv"
    with av.open(str(path), "w") as container:
        streams = [container.add_stream("flac", rate=RATE, layout="mono") for _ in range(3)]
        for at in range(0, RATE, 4800):
            for stream, samples in zip(streams, (NONE, VOICE, OTHER), strict=True):
                block = np.round(samples[None, at : at + 4800] * 32767).astype(np.int16)
                frame = av.AudioFrame.from_ndarray(block, format="s16", layout="mono")
                frame.sample_rate, frame.pts = RATE, at
                container.mux(stream.encode(frame))
        for stream in streams:
            container.mux(stream.encode(None))
    assert np.corrcoef(read_sound(path, RATE).samples, VOICE)[0, 1] > 0.99
    assert channel_mix(path).note("screen.mkv").startswith("sound track 2 of 3 of screen.mkv is taken")
