"""Track, channels and clock of the sound of a file, from one pass through it before it is read."""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lexicon.errors import DataError, InputError
from tts2face.video.channels import ChannelMeter, ChannelMix, TrackLevel, choose_track
from tts2face.video.container import decode_packets, file_version, open_container, sound_stream, start_time
from tts2face.video.cut_files import missing_seconds
from tts2face.video.sound_clock import ClockMeter, SoundClock

if TYPE_CHECKING:
    from av.container import InputContainer

# Formats without times of their own: FFmpeg counts the samples.
COUNTED = frozenset({"wav", "w64", "mp3", "flac", "aac", "aiff", "caf", "au", "ac3", "eac3", "amr"})


@dataclass(frozen=True, slots=True, eq=False)
class SoundSurvey:
    """How the channels of a file become one, and the clock of its track, which is empty where it cannot differ.

    `missing_s` seconds of sound that it states are missing at its end.
    """

    mix: ChannelMix
    clock: SoundClock = field(default_factory=SoundClock)
    missing_s: float = 0.0

    def notes(self, name: str) -> tuple[str, ...]:
        """Sentences for the user on what is guessed, filled and resampled."""
        cut = (
            f"{name} is cut off: the last {self.missing_s:.2f} s of sound that it states are missing, and what is "
            "there is read; copy it again if its original is longer"
        )
        return tuple(filter(None, [cut * (self.missing_s > 0), self.mix.note(name), *self.clock.notes(name)]))


def survey_sound(path: Path, formats: str | None = None, longest_s: float | None = None) -> SoundSurvey:
    """Survey the sound of a file, decoding no more than a number of seconds of each track.

    A file of one channel that has no times beside its samples is not decoded. Errors as `media.read_sound`.
    """
    return _survey(path, file_version(path), formats, longest_s)


def sound_notes(paths: Iterable[Path]) -> tuple[str, ...]:
    """Sentences for the user on what is guessed of the sound of files; none of files that cannot be read."""
    notes: list[str] = []
    for path in paths:
        with suppress(InputError, DataError):  # who reads the sound says so
            notes += survey_sound(path).notes(path.name)
    return tuple(notes)


@lru_cache(maxsize=64)
def _survey(path: Path, version: tuple[int, int, int], formats: str | None, longest_s: float | None) -> SoundSurvey:
    with open_container(path, formats) as container:
        n_tracks = len(container.streams.audio)
        n_channels = sound_stream(container, path).codec_context.channels
        is_counted = _counts_samples(container)
        missing_s = missing_seconds(path, (container.duration or 0) / 1e6)
    if n_tracks == 1 and n_channels == 1 and is_counted:
        return SoundSurvey(ChannelMix(np.ones(1)), missing_s=missing_s)
    tracks: list[tuple[SoundSurvey, TrackLevel]] = []
    for track in range(n_tracks):  # recorders of screens write the system's sound first, then the microphone
        tracks.append(_survey_track(path, formats, track, longest_s))
        if tracks[-1][1].is_certain:
            break
    chosen, passed = choose_track([level for _, level in tracks])
    found = tracks[chosen][0]
    return replace(found, missing_s=missing_s, mix=replace(found.mix, track=chosen, n_tracks=n_tracks, passed=passed))


def _survey_track(
    path: Path, formats: str | None, track: int, longest_s: float | None
) -> tuple[SoundSurvey, TrackLevel]:
    start = start_time(path, formats)
    channels, clock = ChannelMeter(), ClockMeter()
    seconds = 0.0
    with open_container(path, formats) as container:
        stream = sound_stream(container, path, track)
        for frame in decode_packets(container.demux(stream), path, start):
            channels.add(frame)
            clock.add(frame)
            seconds += frame.samples / frame.sample_rate
            if longest_s is not None and seconds > longest_s:
                break
        found = SoundClock() if _counts_samples(container) else clock.clock()
    return SoundSurvey(channels.mix(), found), channels.level()


def _counts_samples(container: "InputContainer") -> bool:
    return not COUNTED.isdisjoint(container.format.name.split(","))
