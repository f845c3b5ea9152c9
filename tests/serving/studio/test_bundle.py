"""Previews as bytes: all of it, and the difference to what a page has."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tts2face.serving.studio.preview_bundle import Preview, bundle, read_bundle
from tts2face.storage.memory import ResultMemory

CHANNELS, RATE, FPS = ["jawOpen", "tongueOut"], 300, 30.0


def piece(
    memory: ResultMemory, number: int, *, n_frames: int = 3, motion: float = 0.0, sound: int = 0
) -> dict[str, Any]:
    """A piece of `n_frames` frames whose arrays hold one value each."""
    arrays = (
        np.full((n_frames, 2), motion, "<f4"),
        np.full((n_frames, 6), number, "<f4"),
        np.full(10 * n_frames, sound, "<i2"),
    )
    digest = f"{number}-{n_frames}-{motion}".ljust(24, ".") + f"{number}-{n_frames}".ljust(24, ".")
    digest += f"{n_frames}-{sound}".ljust(24, ".")
    content = b"".join(array.tobytes() for array in arrays)
    memory.put(digest, content, len(content))
    return {
        "number": number, "text": f"T{number}", "occurrence": 0, "begin": 0.0, "seconds": n_frames / FPS, "rate": RATE,
        "n_frames": n_frames, "n_samples": 10 * n_frames, "digest": digest, "phones": ["sil", "a"],
        "edges": [0.0, 0.04, n_frames / FPS], "words": [["w", 0.04, n_frames / FPS, False]], "channels": CHANNELS,
    }  # fmt: skip


def preview(revision: int, *pieces: dict[str, Any]) -> Preview:
    placed, begin = [], 0.0
    for one in pieces:
        placed.append(one | {"begin": begin})
        begin += one["seconds"]
    return Preview(revision, FPS, tuple(placed), is_complete=True)


@pytest.fixture
def memory() -> ResultMemory:
    return ResultMemory(1_000_000)


def read(preview: Preview, memory: ResultMemory, earlier: Preview | None = None) -> Any:
    content = bundle(preview, memory, earlier)
    assert content is not None
    return read_bundle(content)


def test_a_first_bundle_has_all(memory: ResultMemory) -> None:
    shown = preview(4, piece(memory, 0, motion=0.5, sound=7), piece(memory, 1, n_frames=2, sound=8))
    header, motion, head, sound = read(shown, memory)
    assert (header["revision"], header["n_frames"], header["first_frame"], header["n"]) == (4, 5, 0, 5)
    assert (header["n_samples"], header["sound_first"], header["n_sound"]) == (50, 0, 50)
    assert motion[:, 0].tolist() == [0.5] * 3 + [0.0] * 2
    assert head[:, 0].tolist() == [0] * 3 + [1] * 2
    assert sound.tolist() == [7] * 30 + [8] * 20
    assert header["sentences"] == [["T0", 0, 0.0, 0.1], ["T1", 0, 0.1, 0.166667]]
    assert header["phones"][2:] == [["sil", 0.1, 0.14, 1, 0], ["a", 0.14, 0.166667, 1, 1]]
    assert header["words"][1] == ["w", 0.14, 0.166667, 1, False]


def test_only_changed_frames_and_samples_follow(memory: ResultMemory) -> None:
    same, other, last = piece(memory, 0), piece(memory, 1), piece(memory, 2)
    before, after = preview(1, same, other, last), preview(2, same, piece(memory, 1, motion=0.9), last)
    header, motion, _, sound = read(after, memory, before)
    assert (header["first_frame"], header["n"], header["n_frames"], header["n_sound"]) == (3, 3, 9, 0)
    np.testing.assert_array_equal(motion[:, 0], np.float32([0.9] * 3))
    assert len(sound) == 0


def test_changed_sound_comes_without_frames(memory: ResultMemory) -> None:
    before, after = (
        preview(1, piece(memory, 0), piece(memory, 1)),
        preview(2, piece(memory, 0), piece(memory, 1, sound=5)),
    )
    header, _, _, sound = read(after, memory, before)
    assert (header["n"], header["sound_first"], header["n_samples"]) == (0, 30, 60)
    assert sound.tolist() == [5] * 30


def test_a_longer_piece_moves_all_that_follows(memory: ResultMemory) -> None:
    last = piece(memory, 2)
    before = preview(1, piece(memory, 0), piece(memory, 1), last)
    header, motion, _, sound = read(preview(2, piece(memory, 0), piece(memory, 1, n_frames=4), last), memory, before)
    assert (header["first_frame"], header["n"], header["n_frames"], len(sound)) == (3, 7, 10, 70)
    assert len(motion) == 7


def test_merging_differences_gives_the_whole(memory: ResultMemory) -> None:
    states = [
        preview(1, piece(memory, 0), piece(memory, 1)),
        preview(2, piece(memory, 0, motion=0.3), piece(memory, 1)),
        preview(3, piece(memory, 0, motion=0.3)),
        preview(4, piece(memory, 0, motion=0.3), piece(memory, 1, motion=0.7, sound=3), piece(memory, 2)),
    ]
    motion, sound = np.zeros((0, 2), np.float32), np.zeros(0, np.int16)
    for before, after in zip([None, *states], states, strict=False):
        header, new, _, heard = read(after, memory, before)
        motion = np.resize(motion, (header["n_frames"], 2)) if len(motion) else np.zeros((header["n_frames"], 2), "<f4")
        motion[header["first_frame"] : header["first_frame"] + header["n"]] = new
        sound = np.resize(sound, header["n_samples"]) if len(sound) else np.zeros(header["n_samples"], "<i2")
        sound[header["sound_first"] : header["sound_first"] + len(heard)] = heard
        _, whole, _, all_sound = read(after, memory)
        np.testing.assert_array_equal(motion, whole)
        np.testing.assert_array_equal(sound, all_sound)


@pytest.mark.parametrize("change", [{"fps": 25.0}, {"channels": ["jawOpen", "other"]}])
def test_another_clock_or_other_channels_send_all_frames(memory: ResultMemory, change: dict[str, Any]) -> None:
    before = preview(1, piece(memory, 0))
    after = replace(before, revision=2, fps=change.get("fps", FPS))
    if "channels" in change:
        after = replace(after, pieces=tuple({**one, **change} for one in after.pieces))
    header, _, _, sound = read(after, memory, before)
    assert (header["first_frame"], header["n"], len(sound)) == (0, 3, 0)


def test_a_recording_is_one_sentence(memory: ResultMemory) -> None:
    transcript = {"phones": ["sil", "a", "sil"], "edges": [0.0, 0.05, 0.15, 0.2]}
    pieces = [piece(memory, 0) | {"text": "", "transcript": transcript}, piece(memory, 1) | {"text": ""}]
    shown = preview(1, *pieces)
    header, *_ = read(shown, memory)
    assert header["sentences"] == [["", 0, 0.0, 0.2]]
    assert [one[0] for one in header["phones"]] == ["sil", "a", "sil"]
    assert [one[3] for one in header["words"]] == [0, 0]
    assert shown.sentences()["", 0].phones == ("sil", "a", "sil")


def test_memory_is_bounded_and_what_is_missing_is_said() -> None:
    small = ResultMemory(500)
    shown = preview(1, *(piece(small, number) for number in range(5)))
    assert small.n_bytes <= 500
    assert bundle(shown, small, None) is None
