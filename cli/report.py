"""``tts2face report``: what recordings tell about visual speech and gestures, as pages, tables and pictures."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from cli.flags import parse_whole_number
from cli.progress import progress_bar, write_message
from lexicon.errors import InputError
from tts2face.storage.overwrite import refuse_overwriting

report = App(name="report", help="Study what recordings tell: which phones look alike, how a person gestures.")


@report.command
def similarity(  # noqa: PLR0913 - one parameter a flag
    talker: Annotated[str, Parameter(help="A shipped talker or a .talker file.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="What to write: .html, .csv, .json or .png.", alias="-o")],
    classes: Annotated[
        str | None,
        Parameter(help="Numbers of viseme classes to list; without it those of 4,6,8,10,12 that the phones allow."),
    ] = None,
    halves: Annotated[
        int, Parameter(help="Random halves of the corpus to compare (.html, .json).", converter=parse_whole_number)
    ] = 20,
    seed: Annotated[
        int, Parameter(help="Which halves and permutations are drawn (.html, .json).", converter=parse_whole_number)
    ] = 0,
    compare: Annotated[
        str | None, Parameter(help="Another talker to compare with; .csv and .png then hold the difference.")
    ] = None,
    labels: Annotated[str, Parameter(help="How phones are labelled: both, ipa or arpabet (.json has both).")] = "both",
) -> None:
    """Analyse which phones look alike: matrix, neighbours, viseme classes, reliability, articulation."""
    refuse_overwriting({"--out": out}, {"the talker": talker, "--compare": compare})
    from corpus_tools.similarity.analysis import Options
    from corpus_tools.similarity.write import write_similarity

    options = Options(_parse_numbers(classes), halves, seed)
    with progress_bar("comparing halves") as on_progress:
        found = write_similarity(talker, out, options, other=compare, labels=labels, on_progress=on_progress)
    write_message(
        f"wrote {out}: {len(found.table.phones)} phones, best in {found.best.n_classes} classes, "
        f"reliability {found.by_utterances.corrected:.3f}"
    )


@report.command
def gestures(
    palette: Annotated[str, Parameter(help="A shipped palette or a .palette file.")] = "starter",
    /,
    *,
    out: Annotated[Path, Parameter(help="What to write: .html, .csv, .json or .png.", alias="-o")],
    held_out: Annotated[
        int, Parameter(help="One in so many recordings is held out, to compare with.", converter=parse_whole_number)
    ] = 5,
    halves: Annotated[
        int, Parameter(help="Random halves of the held-out recordings to compare.", converter=parse_whole_number)
    ] = 50,
    clips: Annotated[
        int, Parameter(help="Clips of different seeds that fields and noise make.", converter=parse_whole_number)
    ] = 3,
    seed: Annotated[
        int, Parameter(help="Which recordings, halves and clips are drawn.", converter=parse_whole_number)
    ] = 0,
) -> None:
    """Compare each style's gestures with motion from its fields, noise and published fields for the same sound."""
    refuse_overwriting({"--out": out}, {"the palette": palette})
    from corpus_tools.gesture_study.analysis import Options
    from corpus_tools.gesture_study.write import write_gestures

    options = Options(held_out, halves, clips, seed)
    with progress_bar("studying styles") as on_progress:
        found = write_gestures(palette, out, options, on_progress=on_progress)
    n_met, n_targets = found.targets
    write_message(f"wrote {out}: {len(found.styles)} styles, {n_met} of {n_targets} targets met")


def _parse_numbers(classes: str | None) -> tuple[int, ...] | None:
    if classes is None:
        return None
    try:
        return tuple(int(number) for number in classes.split(","))
    except ValueError as wrong:
        raise InputError(f"--classes takes whole numbers with commas between, like 4,8,12, not {classes!r}") from wrong
