"""Exports of outputs: the tracks of their segments, one after another, in files of other programs."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence
from tts2face.interchange.exports.table import batch_format
from tts2face.interchange.exports.track import read_track
from tts2face.interchange.exports.writer import ExportWriter, mesh_of, plan_exports
from tts2face.request import OWN_FACE, Request
from tts2face.serving.batch.output import Output, Sound
from tts2face.serving.batch.segment import Segment
from tts2face.session.named_models import Models
from tts2face.storage.marks import Making
from tts2face.storage.signing import Signer
from tts2face.types import SOUND_RATE, Clip, Speech, Waveform, exact_rate, first_sample

if TYPE_CHECKING:
    from tts2face.session.session import Session


# faces in a message
MAX_SHOWN = 3


def check_faces(output: Output) -> None:
    """Refuse exports of an output with several faces, whose channels differ, or of a mesh where there is none."""
    if not output.exports:
        return
    faces = dict.fromkeys(map(_face_of, output.segments))
    meshes = [info.name for _, info in map(batch_format, output.exports) if info.uses_face]
    if meshes and any(face[0] == OWN_FACE for face in faces):
        raise InputError(f"{output.stem} shows a talker's own face, which {meshes[0]} cannot show; choose another face")
    if len(faces) > 1:
        shown = ", ".join(" ".join(str(part) for part in face if part) for face in list(faces)[:MAX_SHOWN])
        raise InputError(
            f"{output.stem} shows {len(faces)} faces ({shown}), which one export cannot hold; choose --per cue, or one "
            "face, identity, hair and palette for all speakers"
        )


class Exporter:
    """Writes the exports of outputs; the session whose face they show is kept."""

    def __init__(self) -> None:
        self._shown: Models | None = None
        self._session: Session | None = None

    def write(self, output: Output, tracks: Sequence[Path], folder: Path, signer: Signer | None = None) -> list[Path]:
        """Write the exports of an output from the tracks of its segments; their paths, those of sounds beside included.

        Raises
        ------
        DataError
            A track is damaged.
        InputError, BackendError
            The face has no mesh, a package is missing, or the files cannot be written.
        """
        files = plan_exports([folder / name for name in output.names if name != output.stem + output.suffix])
        face = None
        if any(file.format.uses_face for file in files):
            session = self._session_of(output)
            gestures = Request(gestures=output.segments[0].request.get("gestures", Request().gestures))
            face = mesh_of(session.animated_face(has_gestures=gestures.has_gestures), files)
        making = Making(_text_of(output), signer=signer)
        with ExportWriter(files, face=face, making=making) as writer:
            lengths = [track.slot_frames if track.fills_slot else None for track in output.tracks]
            for clip in joined_clips(tracks, output.fps, output.sounds, lengths):
                writer.add(clip)
        return list(writer.paths)

    def _session_of(self, output: Output) -> "Session":
        models = output.segments[0].models
        if self._session is None or models != self._shown:
            self._shown, self._session = models, models.open_session()
        return self._session


def joined_clips(
    tracks: Sequence[Path],
    fps: float,
    sounds: Sequence[Sound | None] = (),
    lengths: Sequence[int | None] = (),
) -> Iterator[Clip]:
    """Clips of tracks in order, with their sound at `SOUND_RATE` on the samples of their frames.

    Parameters
    ----------
    lengths
        Frames of each track, after which its last words may sound on; empty or None: all of its frames.
    """
    from tts2face.serving.batch.audio_track import open_track

    rate, sounding = exact_rate(fps), np.zeros(0, np.float32)
    at = 0
    parts = zip(tracks, sounds or [None] * len(tracks), lengths or [None] * len(tracks), strict=True)
    for path, sound, length in parts:
        until, later = None if length is None else at + length, [np.zeros(0, np.float32)]
        for piece in read_track(path):
            own = piece.clip.speech.waveform.resampled(SOUND_RATE)
            if at == until:
                later.append(own.samples)
                continue
            begin = first_sample(at, SOUND_RATE, rate)
            at += len(piece.clip.motion)
            end = first_sample(at, SOUND_RATE, rate)
            if sound is None:
                made, sounding = _mixed(own, sounding, end - begin)
            else:
                origin = first_sample(sound.offset, SOUND_RATE, rate)
                found = open_track(Path(sound.path)).read(origin + begin, origin + end)
                made = Waveform(found / 32767.0, SOUND_RATE)
            yield _with_sound(piece.clip, made, is_recorded=sound is not None or piece.clip.speech.is_recorded)
        sounding = _sum(sounding, np.concatenate(later))


def _mixed(own: Waveform, sounding: NDArray[np.float32], n_samples: int) -> tuple[Waveform, NDArray[np.float32]]:
    """Sound of a piece with what still sounds of the track before it, and what sounds on after it."""
    samples = own.part(0, n_samples).padded(n_samples).samples
    mixed = np.clip(_sum(samples, sounding[:n_samples]), -1.0, 1.0)
    return Waveform(mixed, own.rate), sounding[n_samples:]


def _sum(values: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sum of two sounds from the same instant."""
    total = np.zeros(max(len(values), len(other)), np.float32)
    total[: len(values)] += values
    total[: len(other)] += other
    return total


def _with_sound(clip: Clip, sound: Waveform, *, is_recorded: bool) -> Clip:
    """A clip with other sound, whose phones end with them; they last as long to half a sample of the former rate."""
    phones = clip.speech.phones
    seconds = sound.duration
    edges = np.minimum(phones.edges, seconds)
    edges[-1] = seconds
    # phones beyond the new end would last no time: all shrink alike
    if (np.diff(edges) <= 0).any():
        edges = phones.edges * (seconds / phones.end)
    speech = Speech(sound, PhoneSequence(phones.phones, edges), clip.speech.words, is_recorded)
    return replace(clip, speech=speech)


def _text_of(output: Output) -> str:
    return " ".join(cue.text for cue in output.cues if cue.segment is not None)


def _face_of(segment: Segment) -> tuple[str, ...]:
    models, gestures = segment.models, str(segment.request.get("gestures", ""))
    names = (models.face, models.identity, models.palette, models.hair, models.hair_color)
    return (*(name or "" for name in names), "without gestures" if gestures == "none" else "")
