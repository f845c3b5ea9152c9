"""``tts2face convert``: write a lossless track to files of other formats."""

import time
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cli.flags import Face, Hair, HairColor, switch
from cli.process import write_message


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
    from tts2face.api import convert as convert_track

    began = time.perf_counter()
    written = convert_track(
        track, outs, face=face, identity=identity, hair=hair, hair_color=hair_color, palette=palette, fps=fps
    )
    if not quiet:
        names = ", ".join(str(path) for path in written)
        write_message(f"wrote {names} in {time.perf_counter() - began:.1f} s")
