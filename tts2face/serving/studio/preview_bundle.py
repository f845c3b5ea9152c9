"""Previews as a page receives them: one block of bytes with what has changed since a revision that it has.

``uint32`` length of a JSON header, the header, ``float32`` motion (n, K) row by row, ``float32`` head pose (n, 6), and
``int16`` samples of the sound, little-endian throughout. The header says which frames and samples they are.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lexicon.sequence import PhoneSequence
from tts2face.storage.memory import ResultMemory
from tts2face.types import HEAD_CHANNELS

FLOAT_BYTES, SAMPLE_BYTES = 4, 2
N_HEAD = len(HEAD_CHANNELS)
DIGEST_LENGTH = 24  # characters of each of the three digests of a piece: motion, head, sound


@dataclass(frozen=True, slots=True, eq=False)
class Preview:
    """A state of a project's preview.

    Parameters
    ----------
    pieces
        Descriptions of its pieces as `tts2face.serving.studio.tasks.preview` sends them.
    is_complete
        Whether nothing more will come for the present state of the project.
    notes
        What a person should know, one sentence each.
    """

    revision: int = 0
    fps: float = 30.0
    pieces: tuple[Mapping[str, Any], ...] = ()
    is_complete: bool = False
    notes: tuple[str, ...] = ()
    error: str = ""
    extras: Mapping[str, Any] = field(default_factory=dict)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels of the motion."""
        return tuple(self.pieces[0]["channels"]) if self.pieces else ()

    @property
    def rate(self) -> int:
        """Samples a second."""
        return int(self.pieces[0]["rate"]) if self.pieces else 0

    @property
    def duration(self) -> float:
        """Seconds of sound."""
        return sum(piece["n_samples"] for piece in self.pieces) / self.rate if self.pieces else 0.0

    def sentences(self) -> dict[tuple[str, int], PhoneSequence]:
        """Phones of each sentence, or of a whole recording, in seconds of the sentence."""
        found = {}
        for piece in self.pieces:
            timed = piece.get("transcript", piece)
            if piece["text"] or "transcript" in piece:
                found[piece["text"], piece["occurrence"]] = PhoneSequence(timed["phones"], timed["edges"])
        return found


def bundle(preview: Preview, memory: ResultMemory, earlier: Preview | None) -> bytes | None:
    """Bytes with what has changed since an earlier preview; None if a content is no longer kept.

    Without an earlier one, or with one of another clock or other channels, all comes.
    """
    is_same = earlier is not None and (earlier.fps, earlier.channels) == (preview.fps, preview.channels)
    old = earlier.pieces if earlier is not None and is_same else ()
    first, last = _changed(preview.pieces, old, _motion_key)
    is_same_sound = earlier is not None and earlier.rate == preview.rate
    first_heard, last_heard = _changed(
        preview.pieces, earlier.pieces if earlier is not None and is_same_sound else (), _sound_key
    )
    motions = []
    heads = []
    sounds = []
    for number, piece in enumerate(preview.pieces):
        content = memory.get(piece["digest"])
        if content is None:
            return None
        motion_end = piece["n_frames"] * len(preview.channels) * FLOAT_BYTES
        head_end = motion_end + piece["n_frames"] * N_HEAD * FLOAT_BYTES
        if first <= number < last:
            motions.append(content[:motion_end])
            heads.append(content[motion_end:head_end])
        if first_heard <= number < last_heard:
            sounds.append(content[head_end:])
    frames = [piece["n_frames"] for piece in preview.pieces]
    samples = [piece["n_samples"] for piece in preview.pieces]
    header = {
        "revision": preview.revision, "is_complete": preview.is_complete, "fps": preview.fps,
        "n_frames": sum(frames), "first_frame": sum(frames[:first]), "n": sum(frames[first:last]),
        "channels": preview.channels, "rate": preview.rate, "n_samples": sum(samples),
        "sound_first": sum(samples[:first_heard]), "n_sound": sum(samples[first_heard:last_heard]),
        "duration": preview.duration, **_timing(preview), "notes": preview.notes, "error": preview.error,
        **preview.extras,
    }  # fmt: skip
    text = json.dumps(header, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % FLOAT_BYTES)  # arrays begin where their numbers are aligned
    return b"".join([struct.pack("<I", len(text)), text, *motions, *heads, *sounds])


def read_bundle(content: bytes) -> tuple[dict[str, Any], np.ndarray, np.ndarray, np.ndarray]:
    """Header, motion (n, K), head pose (n, 6) and samples of `bundle`."""
    (length,) = struct.unpack_from("<I", content)
    header = json.loads(content[4 : 4 + length])
    n = header["n"]
    n_channels = len(header["channels"])
    at = 4 + length
    motion = np.frombuffer(content, "<f4", n * n_channels, at).reshape(n, n_channels)
    at += motion.nbytes
    head = np.frombuffer(content, "<f4", n * N_HEAD, at).reshape(n, N_HEAD)
    return header, motion, head, np.frombuffer(content, "<i2", offset=at + head.nbytes)


def _motion_key(piece: Mapping[str, Any]) -> Any:
    return piece["digest"][: 2 * DIGEST_LENGTH], piece["n_frames"]


def _sound_key(piece: Mapping[str, Any]) -> Any:
    return piece["digest"][2 * DIGEST_LENGTH :], piece["n_samples"]


def _changed(new: Sequence[Mapping[str, Any]], old: Sequence[Mapping[str, Any]], key: Any) -> tuple[int, int]:
    """Range of the pieces that differ; those after it are equal, and as far from the start as before."""
    new_keys, old_keys = [key(piece) for piece in new], [key(piece) for piece in old]
    first = 0
    while first < min(len(new), len(old)) and new_keys[first] == old_keys[first]:
        first += 1
    last = len(new)
    if sum(n for _, n in new_keys) == sum(n for _, n in old_keys):
        at = len(old)
        # from the end, while the pieces are equal
        while last > first and at > first and new_keys[last - 1] == old_keys[at - 1]:
            last, at = last - 1, at - 1
    return first, last


def _timing(preview: Preview) -> dict[str, Any]:
    """Words, phones and sentences in seconds of the whole clip."""
    words: list[Any] = []
    phones: list[Any] = []
    sentences: list[Any] = []
    is_recording = bool(preview.pieces) and "transcript" in preview.pieces[0]
    for piece in preview.pieces:
        first_s = piece["begin"]
        if not (is_recording and sentences):
            timed = piece.get("transcript", piece)
            end = preview.duration if is_recording else first_s + timed["edges"][-1]
            at = len(sentences)
            sentences.append([piece["text"], piece["occurrence"], round(first_s, 6), round(end, 6)])
            phones += [
                [label, round(first_s + a, 6), round(first_s + b, 6), at, index]
                for index, (label, a, b) in enumerate(
                    zip(timed["phones"], timed["edges"], timed["edges"][1:], strict=False)
                )
            ]
        words += [
            [text, round(first_s + a, 6), round(first_s + b, 6), len(sentences) - 1, is_doubtful]
            for text, a, b, is_doubtful in piece["words"]
        ]
    return {"words": words, "phones": phones, "sentences": sentences}
