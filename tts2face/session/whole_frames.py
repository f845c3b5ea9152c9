"""Spoken parts of a clip in whole frames: their sound goes on as it is spoken, and frames follow it.

A part is cut at its last whole frame, and what is behind it begins the next part. So the sound of a text is the same at
any frame rate at which a frame is no longer than the silence at the end of a sentence (`joining.LEAST_TAIL_S`).
"""

from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lexicon.sequence import PhoneSequence
from tts2face.gestures.kinds import KINDS
from tts2face.gestures.timeline import Timeline
from tts2face.session.joining import last_audible, with_length
from tts2face.session.speech import SpokenSentence
from tts2face.types import Speech, Waveform, concatenate_speech, first_sample, frame_count


class FramedPart(NamedTuple):
    """A spoken part in whole frames: its first frame, their number, and the phones of the part as it was spoken.

    These are in seconds of the frames: they begin behind the rest of the part before, and may end behind the frames.
    """

    spoken: SpokenSentence
    first: int
    n_frames: int
    phones: PhoneSequence


class WholeFrames:
    """Cuts consecutive spoken parts at frames.

    Parameters
    ----------
    frame
        Frame of a longer clip at which the first part begins.
    ends_on_frame
        More may follow the last part: it is padded with silence up to the end of its last frame.

    Attributes
    ----------
    frame
        Frame at which the next part begins.
    """

    def __init__(self, frame: int, fps: Fraction, *, ends_on_frame: bool) -> None:
        self.frame = frame
        self._fps = fps
        self._ends_on_frame = ends_on_frame
        self._rest: SpokenSentence | None = None

    def add(self, spoken: SpokenSentence, *, is_last: bool) -> FramedPart:
        """A part with what is left of the part before it, in whole frames, unless it is the last."""
        first, rest = self.frame, self.finish()
        whole = spoken if rest is None else _joined(rest, spoken)
        own, before_s = spoken.speech.phones, 0.0 if rest is None else rest.sound.duration
        phones = PhoneSequence(own.phones, own.edges + before_s)
        n_frames, n_samples = self._length(whole.sound, is_last=is_last)
        self.frame += n_frames
        if not is_last and n_samples < len(whole.sound.samples):
            self._rest = _after(whole, n_samples)
        return FramedPart(_with_length(whole, n_samples), first, n_frames, phones)

    def _length(self, sound: Waveform, *, is_last: bool) -> tuple[int, int]:
        """Frames and samples of a part."""
        if is_last:
            n_frames = frame_count(sound.duration, float(self._fps))
            # a hundredth of a frame, which is rounding, is left out where more may follow
            return n_frames, self._n_samples(n_frames, sound.rate) if self._ends_on_frame else len(sound.samples)
        n_frames = self._n_whole(len(sound.samples), sound.rate)
        # a frame may be longer than the silence at the end
        if n_frames == 0 or self._n_samples(n_frames, sound.rate) < last_audible(sound):
            n_frames += 1
        return n_frames, self._n_samples(n_frames, sound.rate)

    def finish(self) -> SpokenSentence | None:
        """The rest of the last part, where it was not known to be the last."""
        rest, self._rest = self._rest, None
        return rest

    def _n_samples(self, n_frames: int, rate: int) -> int:
        """Samples of frames from the present one on."""
        return first_sample(self.frame + n_frames, rate, self._fps) - first_sample(self.frame, rate, self._fps)

    def _n_whole(self, n_samples: int, rate: int) -> int:
        """Frames of which all samples are there."""
        n_frames = int(n_samples * self._fps / rate)
        while self._n_samples(n_frames + 1, rate) <= n_samples:  # bounds of frames are rounded to samples
            n_frames += 1
        while self._n_samples(n_frames, rate) > n_samples:
            n_frames -= 1
        return n_frames


def _after(spoken: SpokenSentence, n_samples: int) -> SpokenSentence:
    """Silence at the end of a part, from a sample on, with the instants of its timeline there."""
    voice, sound = spoken.speech.waveform, spoken.sound
    at = n_samples / sound.rate
    instants: dict[str, Any] = {
        name: tuple(element for element in getattr(spoken.timeline, name) if element.time >= at)
        for name, kind in KINDS.items()
        if kind.shape == "instant"
    }
    silence = Speech.without_phones(voice.part(n_samples, len(sound.samples)))
    return SpokenSentence(silence, Timeline(**instants).shift(-at), (), sound.part(n_samples, len(sound.samples)))


def _joined(rest: SpokenSentence, spoken: SpokenSentence) -> SpokenSentence:
    """A part that begins with the rest of another one."""
    seconds = rest.sound.duration
    return SpokenSentence(
        concatenate_speech([rest.speech, spoken.speech]),
        rest.timeline.merge(spoken.timeline.shift(seconds, holds_start=True)),
        tuple(replace(mark, seconds=mark.seconds + seconds) for mark in spoken.marks),
        Waveform(np.concatenate([rest.sound.samples, spoken.sound.samples]), spoken.sound.rate),
    )


def _with_length(spoken: SpokenSentence, n_samples: int) -> SpokenSentence:
    speech, sound = with_length(spoken.speech, n_samples), spoken.sound.padded(n_samples).part(0, n_samples)
    return replace(spoken, speech=speech, sound=sound)
