"""``tts2face render`` and ``tts2face convert``: files of a project's clip, and of a lossless track."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cli.flags import Exports, Face, Hair, HairColor, Out, Sign, TimeStamp, open_signer, switch
from cli.process import write_message
from cli.speak import SpeakOptions, run_prepared


def render(  # noqa: PLR0913 - one parameter a flag
    project: Annotated[Path, Parameter(help="Project (.json), as the studio and tts2face.save_project write it.")],
    /,
    *,
    out: Out = None,
    export: Exports = None,
    size: Annotated[str | None, Parameter(help="Width x height in pixels in place of the project's.")] = None,
    quality: Annotated[str | None, Parameter(help="draft, standard or high in place of the project's.")] = None,
    explain: Annotated[
        Path | None, Parameter(help="File (.json or .txt) that lists the recorded tokens used for each phone.")
    ] = None,
    sign: Sign = None,
    time_stamp: TimeStamp = None,
    quiet: Annotated[bool, switch("Print neither progress nor summary.")] = False,
) -> None:
    """Render a project: the same motion as the studio shows."""
    from tts2face.session.project_file import load_project

    content = load_project(project)
    chosen: dict[str, Any] = {
        name: value for name, value in (("size", size), ("quality", quality)) if value is not None
    }
    options = SpeakOptions(
        out, content.models, explain, view=False, quiet=quiet, file=project, exports=tuple(export or ()),
        signer=open_signer(sign, time_stamp, quiet=quiet),
    )  # fmt: skip
    run_prepared(content.prepare(), replace(content.picture, **chosen), options.with_export_of_out())


def convert(  # noqa: PLR0913 - one parameter a flag
    track: Annotated[Path, Parameter(help="Track written by --export clip.track.json.")],
    outs: Annotated[
        list[str], Parameter(help="Outputs; the suffix selects the format (`tts2face formats`), or FORMAT:PATH.")
    ],
    /,
    *,
    face: Face = None,
    identity: Annotated[str | None, Parameter(help="Preset of the face's age, sex and ancestry.")] = None,
    hair: Hair = None,
    hair_color: HairColor = None,
    palette: Annotated[str, Parameter(help="Palette of the track: a shipped palette or a .palette file.")] = "starter",
    fps: Annotated[
        float | None, Parameter(help="Frames per second of formats with frames; by default those of the track.")
    ] = None,
    quiet: Annotated[bool, switch("Print no summary.")] = False,
) -> None:
    """Write a track to files of other programs."""
    from tts2face.session.clip_files import convert as convert_track

    began = time.perf_counter()
    written = convert_track(
        track, outs, face=face, identity=identity, hair=hair, hair_color=hair_color, palette=palette, fps=fps
    )
    if not quiet:
        names = ", ".join(str(path) for path in written)
        write_message(f"wrote {names} in {time.perf_counter() - began:.1f} s")
