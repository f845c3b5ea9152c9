"""``tts2face corpus gestures``: recordings become a style of a palette."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cli.corpus import Cache, Jobs, Model, check_suffix, corpus
from cli.progress import stage_bar, write_message
from tts2face.storage.overwrite import refuse_overwriting


@corpus.command
def gestures(  # noqa: PLR0913 - one parameter a flag
    recordings: Annotated[Path, Parameter(help="Videos, Live Link tables or marker captures; a folder or one file.")],
    /,
    *,
    style: Annotated[str, Parameter(help="Name of the new style.")],
    out: Annotated[Path, Parameter(help="The palette to write (.palette).", alias="-o")],
    palette: Annotated[str, Parameter(help="The palette that the style is added to: shipped, or a file.")] = "starter",
    alone: Annotated[
        bool, Parameter(help="Write this style alone, with the six moods derived from it.", negative="")
    ] = False,
    stills: Annotated[
        Path | None, Parameter(help="Folder with stills of the person: neutral.png, sad.png, happy.png, ...")
    ] = None,
    still: Annotated[
        list[str] | None, Parameter(help="One still, as sad=FILE or sad=VIDEO@SECONDS; give it for each expression.")
    ] = None,
    markers: Annotated[Path | None, Parameter(help="Table of a marker set (.tsv); 68 + 7 markers without it.")] = None,
    neutral: Annotated[Path | None, Parameter(help="A marker capture of the person at rest.")] = None,
    marker_rate: Annotated[float | None, Parameter(help="Frames a second of marker tables without times.")] = None,
    estimator: Annotated[
        str, Parameter(help="Of expressions: least-squares, or samples as published.")
    ] = "least-squares",
    epsilon: Annotated[
        float, Parameter(help="How far below 0 and above 1 weights of expressions may lie, 0 to 1; 0 is steadiest.")
    ] = 0.0,
    provenance: Annotated[
        Path | None,
        Parameter(help="JSON with name, language, sources, licence, attribution; provenance.json of the folder."),
    ] = None,
    jobs: Jobs = None,
    cache: Cache = None,
    model: Model = None,
) -> None:
    """Learn how a person moves beside the lips, from recordings without transcripts: a style for `--palette`."""
    check_suffix(out, "palette")
    given = {"the recordings": recordings, "--stills": stills, "--markers": markers, "--neutral": neutral}
    refuse_overwriting({"--out": out}, given | {"--palette": palette, "--provenance": provenance, "--model": model})
    from corpus_tools.build_palette import StyleSource, build_style
    from corpus_tools.decomposition.capture_files import MarkerOptions
    from corpus_tools.decomposition.marker_set import DEFAULT_MARKER_TABLE
    from corpus_tools.decomposition.stills import find_stills, parse_stills
    from corpus_tools.run_options import RunOptions, ignore_stage
    from tts2face.models.palette import load_palette

    shown = (find_stills(stills) if stills is not None else {}) | parse_stills(still or [])
    worn = MarkerOptions(markers or DEFAULT_MARKER_TABLE, neutral, marker_rate)
    recorded = StyleSource(recordings=recordings, stills=shown, marker_options=worn, provenance=provenance)
    base = None if alone else load_palette(palette)
    with stage_bar() as stages:
        made = build_style(
            recorded,
            style,
            out,
            base=base,
            estimator=estimator,
            epsilon=epsilon,
            effort=RunOptions(cache, jobs, model),
            stages=stages or ignore_stage,
        )
    for refusal in made.refused:
        write_message(f"refused {refusal.name}: {refusal.reason}")
    for note in made.notes:
        write_message(note)
    kept = ", ".join(f"{share:.0%} of the {feature}'s motion" for feature, share in made.kept.items())
    write_message(
        f"wrote {out}: the style {style} of {made.n_kept} recordings, {made.minutes:.1f} minutes; kept {kept}"
    )
