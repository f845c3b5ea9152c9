"""``tts2face mimic``: transfer the motion of a person in a video, face capture or camera to a face."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from cli.flags import Exports, Face, Hair, HairColor, Model, Out, Sign, TimeStamp, open_signer, switch
from cli.photo import Yes
from cli.process import write_message
from cli.progress import stage_bar
from lexicon.errors import InputError
from tts2face.interchange.exports.table import is_export, split_format
from tts2face.request import OWN_FACE
from tts2face.storage.output_paths import refuse_overwriting

if TYPE_CHECKING:
    from tts2face.picture.options import Picture
    from tts2face.session.named_models import Models
    from tts2face.session.outputs import WrittenClip
    from tts2face.session.performance import Performance


def mimic(  # noqa: PLR0913 - one parameter a flag
    take: Annotated[
        Path | None,
        Parameter(
            help="Video of one person, a .csv, .tsv or .txt table of Live Link Face, .a2f.json or .curves.jsonl."
        ),
    ] = None,
    /,
    *,
    out: Out = None,
    export: Exports = None,
    camera: Annotated[
        str | None,
        Parameter(help="Camera number (0 is the first) or address, shown live in a window, instead of a take."),
    ] = None,
    face: Face = None,
    identity: Annotated[str | None, Parameter(help="Preset of the face's age, sex and ancestry.")] = None,
    hair: Hair = None,
    hair_color: HairColor = None,
    talker: Annotated[Path | None, Parameter(help="With --face self: talker whose own face is shown.")] = None,
    gain: Annotated[float, Parameter(help="Factor on the motion of lips and brows.")] = 1.0,
    append_missing: Annotated[
        bool, switch("With --face self: append modes for motion outside the talker's shape basis.")
    ] = False,
    fps: Annotated[
        float | None, Parameter(help="Frames per second; by default the take's own rate, at most 30 for a capture.")
    ] = None,
    audio: Annotated[Path | None, Parameter(help="Sound of a capture, which has none of its own.")] = None,
    take_fps: Annotated[
        float | None,
        Parameter(help="Frames that a capture counts to a second, where it has frame numbers or less than a second."),
    ] = None,
    size: Annotated[
        str, Parameter(help="Width x height in pixels; auto: 512x512, or the size of the talker's video.")
    ] = "auto",
    background: Annotated[str, Parameter(help="studio, transparent, blur, a colour, or an image file.")] = "studio",
    model: Model = None,
    sign: Sign = None,
    time_stamp: TimeStamp = None,
    yes: Yes = False,
    quiet: Annotated[bool, switch("Print no progress bar and no summary.")] = False,
) -> None:
    """Transfer recorded motion of lips, eyes, brows and head to a face; the sound is copied."""
    began = time.perf_counter()
    from tts2face.picture.options import Picture
    from tts2face.session.named_models import Models

    models = Models(str(talker or "grid_s1"), face or "", identity, None, hair, hair_color)
    if camera is not None:
        if take is not None or out is not None or export or face == OWN_FACE:
            raise InputError("--camera cannot be combined with a take, --out, --export or --face self; remove them")
        return _run_live_window(camera, models, Picture(size=size, background=background), model)
    out, exports = _divide_outputs(out, export)
    if take is None or (out is None and not exports):
        raise InputError("there is no input or no output; add a take and --out, or use --camera")
    inputs = {"the take": take, "--audio": audio, "--talker": talker, "--face": face, "--background": background}
    outputs = {"--out": out} | {f"--export {given}": split_format(given)[0] for given in exports}
    refuse_overwriting(outputs, inputs | {"--model": model})
    # a talker's own face lies in the talker
    if (face == OWN_FACE) != (talker is not None):
        raise InputError("--face self and --talker need each other; add the missing one, or remove both")
    if append_missing and talker is None:
        raise InputError("--append-missing needs --face self: a mesh face has a fixed set of shapes; remove it")
    from tts2face.session.performance import Performance

    performance = Performance(
        take=take, gain=gain, fps=fps, audio=audio, take_fps=take_fps, append_missing=append_missing, model=model
    )
    signer = open_signer(sign, time_stamp, quiet=quiet)
    session = models.open_session() if signer is None else models.open_session().signed_by(signer)
    picture = Picture(size=size, background=background)
    with stage_bar(quiet) as stages:
        written = session.write_performance(performance, out, picture=picture, exports=exports, stages=stages)
    if quiet:
        return
    _report(written, performance, time.perf_counter() - began)


def _report(written: "WrittenClip", performance: "Performance", took: float) -> None:
    """Say what is written, and what is missing or guessed about the take and its sound."""
    from tts2face.video.sound_survey import sound_notes

    for note in sound_notes([performance.audio or performance.take]):
        write_message(f"tts2face: note: {note}")
    for note in written.notes:
        write_message(f"tts2face: note: {performance.take.name}: {note}")
    if written.is_silent:
        write_message(f"{performance.take} contains no sound; the clip is silent")
    write_message(
        f"wrote {written.names}: {written.seconds:.1f} s, made in {took:.1f} s "
        f"({written.seconds / took:.1f} x real time)"
    )


def _divide_outputs(out: Path | None, export: list[str] | None) -> tuple[Path | None, list[str]]:
    """Output of a video, and the exports, to which an output in an export format belongs."""
    exports = list(export or ())
    return (None, [str(out), *exports]) if out is not None and is_export(out) else (out, exports)


def _run_live_window(source: str, models: "Models", picture: "Picture", model: Path | None) -> None:
    """Show a head that follows the person in front of a camera, until the window is closed."""
    from tts2face.models.face_loading import load_face
    from tts2face.picture.display import require_display
    from tts2face.picture.window import LiveWindow
    from tts2face.session.live_capture import CALIBRATION_S, LiveCapture
    from tts2face.video.camera import CaptureDevice

    require_display("--camera")
    head = load_face(models.face, models.identity, hair=models.hair, hair_color=models.hair_color)
    with CaptureDevice(source) as camera:
        write_message(
            f"calibration, {CALIBRATION_S:.0f} s: look into the camera, close your lips, speak, blink; "
            "then the head follows you"
        )
        with LiveCapture(camera.pictures(), head, camera.fps, model) as capture:
            window = LiveWindow(head, picture, capture.latest_pose)
            try:
                window.run()
            finally:
                window.close()
