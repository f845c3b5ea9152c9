"""``tts2face mimic``: a video of a person, or a capture of her face, drives any face."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from cli.progress import progress_bar, say
from lexicon.errors import InputError

if TYPE_CHECKING:
    from tts2face.render.draw import AnyStage
    from tts2face.render.picture import Picture
    from tts2face.synthesis.performance import Motion
    from tts2face.types import Waveform
    from tts2face.video.take import Take

OWN, CAPTURE = "self", ".csv"
SOUND_RATE = 48000  # Hz
MOST_FPS = 30.0  # captures run faster than films need

Progress = Callable[[int, int], None]


def mimic(  # noqa: PLR0913 - one parameter a flag
    take: Annotated[Path | None, Parameter(help="A video of one person, or a .csv file of Live Link Face.")] = None,
    /,
    *,
    out: Annotated[
        Path | None, Parameter(help="The clip: .mp4, .webm, .gif, or a folder for .png files.", alias="-o")
    ] = None,
    camera: Annotated[
        str | None,
        Parameter(help="Instead of a take: a camera's number (0 is the first) or address, live in a window."),
    ] = None,
    face: Annotated[
        str, Parameter(help="What is shown: head, cartoon, a .face file, or self (with --talker).")
    ] = "head",
    identity: Annotated[str | None, Parameter(help="A preset of the face's age, sex and ancestry.")] = None,
    talker: Annotated[Path | None, Parameter(help="With --face self: the talker whose own face is shown.")] = None,
    gain: Annotated[float, Parameter(help="Factor on the motion of lips and brows.")] = 1.0,
    append_missing: Annotated[
        bool, Parameter(help="With --face self: add the motion that she never made.", negative="")
    ] = False,
    fps: Annotated[float | None, Parameter(help="Frames per second; the take's own, at most 30 of a capture.")] = None,
    audio: Annotated[Path | None, Parameter(help="The sound that belongs to a capture.")] = None,
    size: Annotated[
        str, Parameter(help="Width x height in pixels; auto: 512x512, or the talker's own video.")
    ] = "auto",
    background: Annotated[str, Parameter(help="studio, transparent, a colour, or an image file.")] = "studio",
    model: Annotated[Path | None, Parameter(help="face_landmarker.task; found or set up without it.")] = None,
    quiet: Annotated[bool, Parameter(help="No progress bar and no last line.", negative="")] = False,
) -> None:
    """Let a recorded person drive a face: lips, eyes, brows and head; her sound is kept."""
    began = time.perf_counter()
    from tts2face.render.picture import Picture

    if camera is not None:
        if take is not None or out is not None or face == OWN:
            raise InputError("--camera is shown live in a window: give neither a take nor --out, and a head as --face")
        from cli.live import live

        return live(camera, face, identity, Picture(size=size, background=background), model)
    if take is None or out is None:
        raise InputError("give a take and --out, or --camera to be seen live")
    wanted = Wanted(take, face, identity, talker, gain, append_missing, Picture(size=size, background=background))
    _check(wanted, out, audio)
    with progress_bar("watching", quiet) as on_progress:
        motion, stage = _capture(wanted) if take.suffix.lower() == CAPTURE else _film(wanted, model, on_progress)
    if fps is not None or take.suffix.lower() == CAPTURE:
        from tts2face.synthesis.performance import at_rate

        motion = at_rate(motion, fps or min(motion.face.fps, MOST_FPS))
    seconds = len(motion.face) / motion.face.fps
    _write(motion, _sound(take, audio, quiet), stage, out, quiet)
    if not quiet:
        took = time.perf_counter() - began
        say(f"wrote {out}: {seconds:.1f} s, made in {took:.1f} s ({seconds / took:.1f} x real time)")


@dataclass(frozen=True, slots=True)
class Wanted:
    """Who drives what, and how it is drawn."""

    take: Path
    face: str
    identity: str | None
    talker: Path | None
    gain: float
    append_missing: bool
    picture: "Picture"


def _check(wanted: Wanted, out: Path, audio: Path | None) -> None:
    """Refuse what makes no sense before anything is watched."""
    from tts2face.render.output_path import checked_output

    checked_output(out)
    if not 0.0 <= wanted.gain <= 4.0:
        raise InputError(f"the gain must lie from 0 to 4, not {wanted.gain:g}; 1 leaves the motion as it is")
    if (wanted.face == OWN) != (wanted.talker is not None):
        raise InputError("--face self shows a talker's own face: give both --face self and --talker FILE")
    if audio is not None and wanted.take.suffix.lower() != CAPTURE:
        raise InputError("--audio belongs to a capture; a film brings its own sound")
    if wanted.append_missing and wanted.talker is None:
        raise InputError("--append-missing belongs to --face self: a face file has the shapes that it has")


def _capture(wanted: Wanted) -> "tuple[Motion, AnyStage]":
    from tts2face.models.face_file import load_face
    from tts2face.render.draw import staged
    from tts2face.synthesis.performance import motion_of_capture
    from tts2face.video.livelink import read_livelink

    if wanted.talker is not None:
        raise InputError("a capture has no landmarks to clone; choose --face head, cartoon or a .face file")
    shown = load_face(wanted.face, wanted.identity)
    return motion_of_capture(read_livelink(wanted.take), shown, gain=wanted.gain), staged(shown, wanted.picture)


def _film(wanted: Wanted, model: Path | None, on_progress: "Progress | None") -> "tuple[Motion, AnyStage]":
    from tts2face.models.face_file import load_face
    from tts2face.models.talker import read_talker
    from tts2face.render.draw import staged
    from tts2face.render.own_face import plate_staged
    from tts2face.synthesis.performance import able_to_follow, motion_of_own, motion_of_take

    if wanted.talker is None:
        shown = load_face(wanted.face, wanted.identity)
        return motion_of_take(_watched(wanted, model, on_progress), shown, gain=wanted.gain), staged(
            shown, wanted.picture
        )
    hers = read_talker(wanted.talker)
    stage = plate_staged(hers, wanted.picture)  # before the take is watched: it refuses what cannot be shown
    seen = _watched(wanted, model, on_progress)
    if wanted.append_missing:
        hers = able_to_follow(seen, hers)
        stage = plate_staged(hers, wanted.picture)
    return motion_of_own(seen, hers, gain=wanted.gain), stage


def _watched(wanted: Wanted, model: Path | None, on_progress: "Progress | None") -> "Take":
    from tts2face.video.blendshapes import BlendshapeReader
    from tts2face.video.streaming_tracker import FilmReader
    from tts2face.video.take import read_take

    return read_take(wanted.take, FilmReader(model), BlendshapeReader(model), on_progress=on_progress)


def _sound(take: Path, audio: Path | None, quiet: bool) -> "Waveform":
    """The sound of a take; silence, and a word about it, where there is none."""
    import numpy as np

    from tts2face.types import Waveform
    from tts2face.video.media import media_facts, read_sound

    if audio is not None:
        return read_sound(audio, SOUND_RATE)
    if take.suffix.lower() != CAPTURE and media_facts(take).rate:
        return read_sound(take, SOUND_RATE)
    if not quiet:
        say(f"{take} holds no sound; the clip is silent")
    return Waveform(np.zeros(0, np.float32), SOUND_RATE)


def _write(motion: "Motion", sound: "Waveform", stage: "AnyStage", out: Path, quiet: bool) -> None:
    from tts2face.render.encode import ClipWriter
    from tts2face.synthesis.performance import clips_of

    n_frames = len(motion.face)
    with progress_bar("drawing", quiet) as on_progress:
        tell = on_progress and (lambda done, _: on_progress(done, n_frames))
        with ClipWriter(out, stage, on_progress=tell) as writer:
            for clip in clips_of(motion, sound):
                writer.add(clip)
