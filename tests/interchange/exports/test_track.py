"""The lossless track gives back the same bits; damaged tracks are refused with the place."""

import json

import numpy as np
import pytest

import tts2face
from lexicon.errors import DataError, InputError
from tests.interchange.exports.made import FACE, made_clip, made_stream, silent_clip
from tts2face.interchange.exports.track import TrackPiece, read_track
from tts2face.types import Clip, Trajectory


def assert_same(one, other):
    assert one.motion.channels == other.motion.channels
    assert (one.fps, one.speech.waveform.rate) == (other.fps, other.speech.waveform.rate)
    for a, b in (
        (one.motion.values, other.motion.values),
        (one.head.values, other.head.values),
        (one.speech.waveform.samples, other.speech.waveform.samples),
        (one.speech.phones.edges, other.speech.phones.edges),
    ):
        assert a.dtype == b.dtype
        assert a.tobytes() == b.tobytes()
    assert one.speech.phones.phones == other.speech.phones.phones
    assert one.speech.words == other.speech.words


@pytest.mark.parametrize("clip", [made_clip(), made_clip(1), silent_clip(), made_clip(7, 24000 / 1001)])
def test_a_clip_is_read_back_bit_for_bit(clip, tmp_path):
    tts2face.export(clip, tmp_path / "a.track.json")
    assert_same(tts2face.load_clip(tmp_path / "a.track.json"), clip)


def test_extreme_numbers_and_negative_zero_are_kept(tmp_path):
    clip = made_clip(3)
    values = np.array([[-0.0, 0.0, 1e-38, -1e-45], [3.4e38, -1 / 3, np.pi, 1e20], [-0.0, 1, 2, -0.0]], np.float32)
    clip = Clip(Trajectory(clip.motion.channels, values, 30.0), clip.head, clip.speech)
    tts2face.export(clip, tmp_path / "a.json")
    assert_same(tts2face.load_clip(tmp_path / "a.json"), clip)


def test_pieces_and_their_texts_are_kept(tmp_path):
    pieces = [tts2face.Piece(clip, 0.0, 1, text=f"Satz {number}: „Ä“") for number, clip in enumerate(made_stream())]
    tts2face.export(pieces, tmp_path / "a.json")
    read = list(read_track(tmp_path / "a.json"))
    assert [piece.text for piece in read] == [piece.text for piece in pieces]
    for piece, original in zip(read, pieces, strict=True):
        assert_same(piece.clip, original.clip)


def test_other_programs_read_it_as_json_and_may_format_it(tmp_path):
    clip = made_clip(5)
    tts2face.export(clip, tmp_path / "a.json")
    content = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert content["channels"] == list(FACE.shape_names)
    assert np.allclose(content["pieces"][0]["motion"], clip.motion.values, rtol=1e-7, atol=0)
    (tmp_path / "b.json").write_text(json.dumps(content, indent=1))
    assert_same(tts2face.load_clip(tmp_path / "b.json"), clip)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda text: text.replace("tts2face-track", "other"), "its format is 'other', not 'tts2face-track'"),
        (lambda text: text.replace('"version": 1', '"version": 2'), "has version 2 of the track format"),
        (lambda text: text.replace('"pitch"', '"nod"'), "its head_channels are not pitch"),
        (lambda text: text.replace('"fps": 30.0', '"fps": "x"'), 'fps must be a number, not "x"'),
        (lambda text: text.replace('"fps": 30.0', '"fps": -1'), "piece 1: frames per second must be above 0"),
        (lambda text: text.replace('"words"', '"word"'), "piece 1: a piece needs exactly motion, head"),
        (lambda text: text.replace('"samples": "', '"samples": "*'), "piece 1: .*base64"),
        (lambda text: text.rsplit("\n", 2)[0], "ends before its last piece is complete"),
        (lambda text: text[: len(text) // 2], "piece 1, line 1: not JSON"),
        (lambda text: text.splitlines()[0] + "\n]}\n", "it has no piece"),
        (lambda text: "[1]", "it is not a JSON object"),
        (lambda text: "{}", "its format is 'None'"),
        (lambda text: text.replace('"edges": [0.0', '"edges": [9.0'), "piece 1: phone edges must increase"),
    ],
)
def test_damage_is_reported_with_its_place(change, reason, tmp_path):
    path = tmp_path / "a.json"
    tts2face.export(made_clip(3), path)
    path.write_text(change(path.read_text()))
    with pytest.raises(DataError, match=reason):
        tts2face.load_clip(path)


def test_missing_and_binary_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="there is no track"):
        tts2face.load_clip(tmp_path / "no.json")
    with pytest.raises(DataError, match="is a folder"):
        tts2face.load_clip(tmp_path)
    (tmp_path / "b.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match=r"is not UTF-8 text \(byte 0\)"):
        tts2face.load_clip(tmp_path / "b.json")


def test_a_piece_of_a_track_holds_clip_and_text():
    assert TrackPiece(made_clip(1), "a").text == "a"
