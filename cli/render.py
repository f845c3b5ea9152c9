"""``tts2face render``: the clip of a project."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cli.flags import Exports, Out, switch


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
    quiet: Annotated[bool, switch("Print neither progress nor summary.")] = False,
) -> None:
    """Render a project: the same motion as the studio shows."""
    from cli.speak import SpeakOptions, run_prepared
    from tts2face.project.project_file import load_project

    content = load_project(project)
    chosen: dict[str, Any] = {
        name: value for name, value in (("size", size), ("quality", quality)) if value is not None
    }
    options = SpeakOptions(
        out, content.models, explain, view=False, quiet=quiet, file=project, exports=tuple(export or ())
    )
    run_prepared(content.prepare(), replace(content.picture, **chosen), options.with_export_of_out())
