"""Sources of the speech of a live face: a text, a text that grows, a recording, or a microphone."""

import codecs
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.values.files import is_file
from tts2face.sound.microphone import open_microphone
from tts2face.types import SOUND_RATE
from tts2face.video.media import sound_blocks

AHEAD_S = 1.0  # by which a recording is given before it is heard
READ_BYTES = 4096  # of a text that is read at once


class Speaker(Protocol):
    """The part of a live face that feeds use; `tts2face.session.live.stream.FaceStream` is one."""

    def push_text(self, part: str) -> int: ...  # noqa: D102
    def end_text(self) -> None: ...  # noqa: D102
    def push_sound(self, samples: NDArray[np.floating], rate: int) -> int: ...  # noqa: D102
    def end_sound(self) -> None: ...  # noqa: D102


Feed = Callable[[Speaker, Callable[[], bool]], int]  # says all and returns the last utterance; 0: none


def text_feed(text: str) -> Feed:
    """Says a text; an empty one is refused (`InputError`)."""
    if not text.strip():
        raise InputError("the text is empty; add words to speak")

    def feed(speaker: Speaker, _: Callable[[], bool]) -> int:
        number = speaker.push_text(text)
        speaker.end_text()
        return number

    return feed


def with_notice(words: str, then: Feed | None) -> Feed:
    """Says that the voice is synthetic, then what another feed says."""
    notice = text_feed(words)

    def feed(speaker: Speaker, has_ended: Callable[[], bool]) -> int:
        number = notice(speaker, has_ended)
        return number if then is None else then(speaker, has_ended) or number

    return feed


def growing_feed(descriptor: int, *, may_be_empty: bool = False) -> Feed:
    """Says the text of a file descriptor as it is written, each sentence when it is complete.

    One that ends without a text is an `InputError`, unless it may be empty.
    """

    def feed(speaker: Speaker, has_ended: Callable[[], bool]) -> int:
        decoder, number = codecs.getincrementaldecoder("utf-8")(errors="replace"), 0
        has_text = may_be_empty
        while not has_ended() and (content := os.read(descriptor, READ_BYTES)):
            if part := decoder.decode(content):
                number = speaker.push_text(part)
                has_text = has_text or not part.isspace()
        speaker.end_text()
        if not has_text and not has_ended():
            raise InputError("standard input ended without a text; write one, or add --stay for a silent face")
        return number

    return feed


def recording_feed(path: Path) -> Feed:
    """Says the sound of a file, at most `AHEAD_S` ahead of the time at which it is heard.

    Raises
    ------
    InputError
        There is no such file; it is read when the feed runs.
    """
    if not is_file(path):
        raise InputError(f"there is no recording {path}; check the path")

    def feed(speaker: Speaker, has_ended: Callable[[], bool]) -> int:
        began, given_s = time.monotonic(), 0.0
        number = 0
        for samples in sound_blocks(path, SOUND_RATE):
            ahead = given_s - (time.monotonic() - began)
            time.sleep(max(0.0, ahead - AHEAD_S))
            if has_ended():
                break
            number = speaker.push_sound(samples, SOUND_RATE)
            given_s += len(samples) / SOUND_RATE
        speaker.end_sound()
        return number

    return feed


def microphone_feed(device: str) -> Feed:
    """Says what a microphone hears, until the end."""

    def feed(speaker: Speaker, has_ended: Callable[[], bool]) -> int:
        number = 0
        with open_microphone(device) as (rate, blocks):
            for samples in blocks:
                if has_ended():
                    break
                number = speaker.push_sound(samples, rate)
        speaker.end_sound()
        return number

    return feed
