"""``tts2face corpus gestures``: build a gesture style from recordings."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cli.corpus import Provenance, check_suffix
from cli.flags import switch
from cli.process import write_message
from cli.progress import stage_bar
from cli.tool_flags import DEFAULTS, ToolFlags
from tts2face.storage.output_paths import refuse_overwriting


def gestures(  # noqa: PLR0913 - one parameter a flag
    recordings: Annotated[Path, Parameter(help="Videos, Live Link tables or marker captures: a folder or one file.")],
    /,
    *,
    style: Annotated[str, Parameter(help="Name of the new style.")],
    out: Annotated[Path, Parameter(help="Output palette (.palette).", alias="-o")],
    palette: Annotated[
        str, Parameter(help="Palette to which the style is added: a shipped palette or a .palette file.")
    ] = "starter",
    alone: Annotated[bool, switch("Write a palette of this style only, with the six derived moods.")] = False,
    stills: Annotated[
        Path | None, Parameter(help="Folder of stills of the person: neutral.png, sad.png, happy.png, ...")
    ] = None,
    still: Annotated[
        list[str] | None, Parameter(help="Still of one expression, as sad=FILE or sad=VIDEO@SECONDS; can be repeated.")
    ] = None,
    markers: Annotated[
        Path | None, Parameter(help="Table of the marker set (.tsv); by default 68 + 7 markers.")
    ] = None,
    neutral: Annotated[Path | None, Parameter(help="Marker capture of the person at rest.")] = None,
    marker_rate: Annotated[float | None, Parameter(help="Frames per second of tables with frame numbers.")] = None,
    estimator: Annotated[
        str, Parameter(help="Estimator of expression weights: least-squares, or samples (as published).")
    ] = "least-squares",
    epsilon: Annotated[
        float, Parameter(help="Slack of the expression weights beyond [0, 1], from 0 to 1; 0 is the most stable.")
    ] = 0.0,
    provenance: Provenance = None,
    tool: ToolFlags = DEFAULTS,
) -> None:
    """Build a gesture style for `--palette` from recordings of a person; transcripts are not needed."""
    check_suffix(out, "palette")
    from corpus_tools.build_palette import StyleSource, build_style
    from corpus_tools.decomposition.capture_files import MarkerOptions
    from corpus_tools.decomposition.marker_sets import DEFAULT_MARKER_TABLE
    from corpus_tools.decomposition.stills import find_stills, parse_stills
    from tts2face.models.palette_file import load_palette

    named_stills = parse_stills(still or [])
    inputs = {"the recordings": recordings, "--stills": stills, "--markers": markers, "--neutral": neutral}
    inputs |= {f"--still {name}": expression.path for name, expression in named_stills.items()}
    refuse_overwriting(
        {"--out": out}, inputs | {"--palette": palette, "--provenance": provenance, "--model": tool.model}
    )
    still_files = (find_stills(stills) if stills is not None else {}) | named_stills
    marker_options = MarkerOptions(markers or DEFAULT_MARKER_TABLE, neutral, marker_rate)
    source = StyleSource(
        recordings=recordings, stills=still_files, marker_options=marker_options, provenance=provenance
    )
    base = None if alone else load_palette(palette)
    with stage_bar() as stages:
        result = build_style(
            source,
            style,
            out,
            base=base,
            estimator=estimator,
            epsilon=epsilon,
            run_options=tool.run_options(),
            stages=stages,
        )
    for refusal in result.refused:
        write_message(f"rejected {refusal.name}: {refusal.reason}")
    for note in result.notes:
        write_message(note)
    shares = ", ".join(f"{share:.0%} of the motion of {feature}" for feature, share in result.kept.items())
    write_message(
        f"wrote {out}: style {style} from {result.n_kept} recordings, {result.minutes:.1f} minutes; modes keep {shares}"
    )
