"""Clips of a given number of frames, from rest to rest, which can be joined in any order."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from lexicon.marked_text import MAX_PAUSE_S, PauseMark
from lexicon.sequence import PhoneSequence
from tts2face.numeric.arrays import smoothstep
from tts2face.request import Idle, Listening, Recorded, Spoken
from tts2face.session.joining import silent_frames, with_length
from tts2face.session.prepared import PreparedRequest, prepare
from tts2face.session.speech_stream import Piece
from tts2face.source_options import IDLE_LIMITS_S, LEAD_S
from tts2face.types import Clip, first_sample

EASE_S = 0.25  # from and to rest; a head turns back within a quarter of a second
OPENING_S = 0.03  # after the lead, within which a face is fully there: its lips speak
MARGIN_FRAMES = 0.25  # by which a padded sound ends before its last frame does, so that rounding adds no frame
MIN_PHONE_S = 0.005  # shorter rests of a phone that is cut are dropped
Stream = Callable[[PreparedRequest], Iterator[Piece]]


@dataclass(frozen=True, slots=True)
class Length:
    """Length of a clip in frames, and the share of its channels that are eased: all, or those from `first_channel`."""

    n_frames: int
    first_channel: int = 0


def clips_of_length(
    prepared: PreparedRequest, sound_end: float | None, length: Length, stream: Stream
) -> Iterator[Clip]:
    """Yield the clip of a request in pieces with `length.n_frames` frames in total.

    Idle animation follows the speech up to the end; speech beyond the end is cut. Head and face are at rest in the
    first and last frame, so that clips can be joined.

    Parameters
    ----------
    sound_end
        Seconds of the clip at which the sound of its text ends; None for a recording or idle animation.
    stream
        Function that synthesises a prepared request, as `Session.stream`.
    """
    fps, left = prepared.fps, length.n_frames
    done, rate = 0, 0
    speech = prepared if sound_end is None else _with_pause(prepared, sound_end, left)
    clips: Iterator[Clip] = (piece.clip for piece in stream(speech))
    n_speech = left if sound_end is None else min(left, _frames_with_pause(sound_end, left, fps))
    source = prepared.request.source
    if isinstance(source, Recorded):
        recorded = list(clips)
        clips, n_speech = iter(recorded), min(left, sum(len(clip.motion) for clip in recorded))
    lead = (source.lead or 0.0) if isinstance(source, Spoken) else LEAD_S
    opening_s = EASE_S if isinstance(source, Idle | Listening) else lead + OPENING_S
    for clip in _eased(clips, n_speech, length.first_channel, opening_s):
        rate = clip.speech.waveform.rate
        first, done = done, done + len(clip.motion)
        n_samples = first_sample(done, rate, fps) - first_sample(first, rate, fps)
        clip = replace(clip, speech=with_length(clip.speech, n_samples))  # noqa: PLW2901 - idle animation follows
        yield clip
    while done < length.n_frames:
        n_idle = min(length.n_frames - done, int(IDLE_LIMITS_S[1] * fps))
        if n_idle < IDLE_LIMITS_S[0] * fps:
            yield _resting(clip, n_idle, done, fps)
            return
        request = replace(
            prepared.request,
            source=Idle(float(n_idle / fps)),
            dictionary=None,
            seed=prepared.request.known_seed + done,
            expression=None,
            timeline=None,
        )
        for idle in _eased((piece.clip for piece in stream(prepare(request))), n_idle, length.first_channel):
            yield replace(idle, speech=silent_frames(done, done + len(idle.motion), rate, fps))
            done += len(idle.motion)


def first_frames(clip: Clip, n_frames: int) -> Clip:
    """The first frames of a clip, with the phones and whole words that they contain."""
    if n_frames >= len(clip.motion):
        return clip
    fps, sound = clip.fps, clip.speech.waveform
    n_samples = min(round(n_frames / fps * sound.rate), len(sound.samples))
    seconds, phones = n_samples / sound.rate, clip.speech.phones
    n_phones = max(int(np.searchsorted(phones.edges[:-1], seconds - MIN_PHONE_S)), 1)
    labels = [*phones.phones[:n_phones]]
    speech = replace(
        clip.speech,
        waveform=sound.part(0, n_samples),
        phones=PhoneSequence(labels, [*phones.edges[:n_phones], seconds]),
        words=tuple(word for word in clip.speech.words if word.last <= n_phones),
    )
    return Clip(clip.motion.part(0, n_frames), clip.head.part(0, n_frames), speech)


def ease_weights(n_frames: int, fps: float, opening_s: float = EASE_S) -> NDArray[np.float32]:
    """(n_frames,) weights that rise from 0 at the first frame in `opening_s`, and fall to 0 at the last in `EASE_S`.

    They rise within two frames at least, and within `EASE_S` and half of the frames at most.
    """
    longest = max(1, min(round(EASE_S * fps), (n_frames - 1) // 2))
    n_opening = min(max(round(opening_s * fps), 2), longest)
    to_edge = np.minimum(np.arange(n_frames) / n_opening, np.arange(n_frames)[::-1] / longest)
    return smoothstep(to_edge).astype(np.float32)


def _eased(clips: Iterator[Clip], n_frames: int, first_channel: int, opening_s: float = EASE_S) -> Iterator[Clip]:
    """Clips cut to `n_frames` in total, with head and face at rest in the first and last frame."""
    at = 0
    weights: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None
    for whole in clips:
        if at >= n_frames:
            return
        clip = first_frames(whole, n_frames - at)
        if weights is None:
            weights = ease_weights(n_frames, clip.fps, opening_s), ease_weights(n_frames, clip.fps)
        face, head = (curve[at : at + len(clip.motion), None] for curve in weights)
        at += len(clip.motion)
        values = clip.motion.values.copy()
        values[:, first_channel:] *= face
        yield replace(
            clip,
            motion=replace(clip.motion, values=values),
            head=replace(clip.head, values=clip.head.values * head),
        )


def _with_pause(prepared: PreparedRequest, sound_end: float, n_frames: int) -> PreparedRequest:
    """The request with a pause at its end, as long as the clip or as a pause may be."""
    pause = _pause(sound_end, n_frames, prepared.fps)
    if pause <= 0.0:
        return prepared
    if prepared.excerpt is not None:
        return replace(prepared, excerpt=replace(prepared.excerpt, silence=pause))
    text = prepared.text
    return replace(prepared, text=replace(text, marks=(*text.marks, PauseMark(len(text.text), pause))))


def _pause(sound_end: float, n_frames: int, fps: Fraction) -> float:
    return min(float((n_frames - MARGIN_FRAMES) / fps) - sound_end, MAX_PAUSE_S)


def _frames_with_pause(sound_end: float, n_frames: int, fps: Fraction) -> int:
    pause = max(_pause(sound_end, n_frames, fps), 0.0)
    # a hundredth of a frame is rounding
    return int(np.ceil((sound_end + pause) * float(fps) - 0.01))


def _resting(like: Clip, n_frames: int, first: int, fps: Fraction) -> Clip:
    """Some frames in which the face keeps its last position."""
    return Clip(
        replace(like.motion, values=np.repeat(like.motion.values[-1:], n_frames, axis=0)),
        replace(like.head, values=np.repeat(like.head.values[-1:], n_frames, axis=0)),
        silent_frames(first, first + n_frames, like.speech.waveform.rate, fps),
    )
