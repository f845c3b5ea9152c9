"""``tts2face mimic``: a video of a person, or a capture of her face, drives any face."""

import time
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cli.progress import stage_bar, write_message
from lexicon.errors import InputError
from tts2face.storage.overwrite import refuse_overwriting

OWN_FACE = "self"


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
        if take is not None or out is not None or face == OWN_FACE:
            raise InputError("--camera is shown live in a window: give neither a take nor --out, and a head as --face")
        from cli.live import run_live_window

        return run_live_window(camera, face, identity, Picture(size=size, background=background), model)
    if take is None or out is None:
        raise InputError("give a take and --out, or --camera for a live camera")
    given = {"the take": take, "--audio": audio, "--talker": talker, "--face": face, "--background": background}
    refuse_overwriting({"--out": out}, given | {"--model": model})
    if (face == OWN_FACE) != (talker is not None):
        raise InputError("--face self shows a talker's own face: give both --face self and --talker FILE")
    if append_missing and talker is None:
        raise InputError("--append-missing needs --face self: a face file has a fixed set of shapes; remove it")
    from tts2face.session import Session
    from tts2face.synthesis.performance import Performance

    performance = Performance(take=take, gain=gain, fps=fps, audio=audio, append_missing=append_missing, model=model)
    session = Session(talker or "grid_s1", face, identity=identity, palette=None)
    picture = Picture(size=size, background=background)
    with stage_bar(quiet) as stages:
        written = session.write_performance(performance, out, picture=picture, stages=stages)
    if quiet:
        return
    if written.is_silent:
        write_message(f"{take} holds no sound; the clip is silent")
    took = time.perf_counter() - began
    write_message(
        f"wrote {out}: {written.seconds:.1f} s, made in {took:.1f} s ({written.seconds / took:.1f} x real time)"
    )
