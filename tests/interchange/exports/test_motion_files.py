"""Head motion, arrays and sound, read back by OpenFaceFX, NumPy and wave, and BVH by its own rule of multiplication."""

import wave

import numpy as np
import pytest

import tts2face
from lexicon.errors import InputError
from tests.interchange.exports.made import FACE, RATE, WORDS, made_clip, made_stream, silent_clip, turned_clip
from tests.packages import package
from tts2face.face.deformation import head_rotation
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Waveform, concatenate_clips

pytestmark = pytest.mark.formats


def bvh_frames(path):
    """Channel names, seconds per frame and values (T, 6) of a BVH file with one joint."""
    header, motion = path.read_text().split("MOTION\n")
    channels = next(line for line in header.splitlines() if "CHANNELS" in line).split()[2:]
    count, time, *rows = motion.splitlines()
    values = np.array([[float(number) for number in row.split()] for row in rows])
    assert int(count.removeprefix("Frames:")) == len(values)
    return channels, float(time.removeprefix("Frame Time:")), values


def axis_matrix(name, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return {
        "Xrotation": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "Yrotation": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "Zrotation": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[name]


def test_bvh_rotations_multiplied_in_their_order_are_the_head_s(tmp_path):
    clip = made_clip(40, 25.0)
    tts2face.export(clip, tmp_path / "a.bvh")
    channels, seconds, values = bvh_frames(tmp_path / "a.bvh")
    assert (seconds, len(values)) == (0.04, 40)
    for row, head in zip(values, clip.head.values, strict=True):
        turn = np.eye(3)
        for name, value in zip(channels[3:], row[3:], strict=True):
            turn = turn @ axis_matrix(name, value)
        assert np.allclose(turn, head_rotation(*map(float, head[:3])), rtol=0, atol=1e-7)
        assert np.allclose(row[:3] * 10, head[3:], rtol=0, atol=1e-5)  # cm


@pytest.mark.parametrize(("channel", "name"), [("pitch", "headPitch"), ("yaw", "headYaw"), ("roll", "headRoll")])
def test_openfacefx_reads_ten_degrees(channel, name, tmp_path):
    importers = package("openfacefx.importers_bvh")
    tts2face.export(turned_clip(**{channel: np.radians(10.0)}), tmp_path / "a.bvh")
    track, warnings = importers.read_bvh(str(tmp_path / "a.bvh"))
    assert not warnings
    assert [one.name for one in track.channels] == [name]
    assert {key.value for key in track.channels[0].keys} == {10.0}


def test_bvh_at_a_broadcast_rate_and_of_one_frame(tmp_path):
    tts2face.export(made_clip(1, 30000 / 1001), tmp_path / "a.bvh")
    _, seconds, values = bvh_frames(tmp_path / "a.bvh")
    assert seconds == pytest.approx(1001 / 30000, abs=1e-9)
    assert values.shape == (1, 6)


def test_numpy_reads_all_arrays(tmp_path):
    pieces = made_stream()
    whole = concatenate_clips(pieces)
    tts2face.export(pieces, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz", allow_pickle=False) as arrays:
        assert np.array_equal(arrays["motion"], whole.motion.values)
        assert np.array_equal(arrays["head"], whole.head.values)
        assert np.array_equal(arrays["samples"], whole.speech.waveform.samples)
        assert arrays["motion"].dtype == arrays["samples"].dtype == np.float32
        assert tuple(arrays["channels"]) == FACE.shape_names
        assert tuple(arrays["head_channels"]) == HEAD_CHANNELS
        assert (arrays["fps"], arrays["rate"]) == (30.0, RATE)
        assert tuple(arrays["phones"]) == whole.speech.phones.phones
        assert np.allclose(arrays["phone_edges"], whole.speech.phones.edges, rtol=0, atol=1e-9)
        assert list(arrays["words"]) == [word.text for word in WORDS] * 3
        assert arrays["word_times"].shape == (6, 2)


def test_numpy_reads_a_clip_without_words(tmp_path):
    tts2face.export(silent_clip(1), tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["word_times"].shape == (0, 2)
        assert arrays["words"].shape == (0,)


def test_wave_reads_the_sound(tmp_path):
    pieces = made_stream(2, 31, 30000 / 1001)
    tts2face.export(pieces, tmp_path / "a.wav")
    with wave.open(str(tmp_path / "a.wav")) as file:
        assert (file.getnchannels(), file.getsampwidth(), file.getframerate()) == (1, 2, RATE)
        samples = np.frombuffer(file.readframes(file.getnframes()), "<i2")
    whole = concatenate_clips(pieces).speech.waveform.samples
    assert len(samples) == len(whole)
    assert np.abs(samples / 32767 - whole).max() <= 0.51 / 32767


def test_sound_beyond_four_gigabytes_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("tts2face.storage.wave_files.MOST_BYTES", RATE)
    with pytest.raises(InputError, match=r"a .wav file has at most 4 GB of sound"):
        tts2face.export(made_stream(2), tmp_path / "a.wav")
    assert not list(tmp_path.iterdir())


def test_a_clip_that_ends_within_a_frame_is_followed_by_silence(tmp_path):
    first, second = made_stream(2)
    speech = first.speech
    samples = Waveform(speech.waveform.samples[:-100], RATE)
    edges = np.array(speech.phones.edges)
    edges[-1] = samples.duration
    short = Clip(first.motion, first.head, Speech(samples, type(speech.phones)(speech.phones.phones, edges), ()))
    tts2face.export([short, second], [tmp_path / "a.wav", tmp_path / "a.npz", tmp_path / "a.TextGrid"])
    with np.load(tmp_path / "a.npz") as arrays:
        sound = arrays["samples"]
        assert len(sound) == 2 * RATE
        assert not sound[RATE - 100 : RATE].any()
        assert np.array_equal(sound[RATE:], second.speech.waveform.samples)
        assert arrays["phone_edges"][-1] == 2.0
    with wave.open(str(tmp_path / "a.wav")) as file:
        assert file.getnframes() == 2 * RATE
