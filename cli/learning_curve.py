"""``tts2face corpus evaluate --learning-curve``: accuracy against the amount of a person's own material."""

from pathlib import Path

from cli.evaluation_flags import ComparisonFlags, SplitFlags
from cli.flags import parse_numbers
from cli.process import write_message
from cli.progress import progress_bar, stage_bar
from cli.tool_flags import ToolFlags

DEFAULT_BASE = "grid_s1"
AUTOMATIC = "auto"


def run_learning_curve(
    amounts: str, split_flags: SplitFlags, comparison: ComparisonFlags, base: str | None, out: Path | None,
    tool: ToolFlags,
) -> None:  # fmt: skip
    """Measure a learning curve on the recordings; print its tables, and write them or a picture to `out`."""
    folder = split_flags.curve_recordings(comparison)
    from corpus_tools.measures.splits import split_randomly
    from corpus_tools.studies.evaluation.curve_page import REPORT
    from corpus_tools.studies.evaluation.curve_tables import curve_tables
    from corpus_tools.studies.evaluation.learning_curve import DEFAULT_AMOUNTS_S, measure_learning_curve
    from corpus_tools.studies.evaluation.material import read_material
    from corpus_tools.training.adapt_talker import Base
    from corpus_tools.training.short_talker import NO_BASE
    from tts2face.models.talker_file import load_talker
    from tts2face.storage.files import write_atomically

    amounts_s = (
        DEFAULT_AMOUNTS_S
        if amounts == AUTOMATIC
        else parse_numbers(
            "--learning-curve", amounts, float, f"{AUTOMATIC} or seconds separated by commas, such as 10,20,40"
        )
    )
    writer = None if out is None else REPORT.writer(out)
    name = base or DEFAULT_BASE
    indexed = None if name == NO_BASE else Base.of(load_talker(name))
    with stage_bar() as stages:
        talker = None if indexed is None else indexed.talker
        observations = read_material(folder, talker, run_options=tool.run_options(), stages=stages)
    train, test = split_randomly(observations, hold_out=split_flags.hold_out, seed=split_flags.seed)
    with progress_bar("learning from parts of the material") as on_progress:
        curve = measure_learning_curve(
            train, test, indexed, amounts_s=amounts_s, seed=split_flags.seed, on_progress=on_progress
        )
    print(curve_tables(curve))  # noqa: T201 - the result
    if out is not None and writer is not None:
        write_atomically(out, writer(curve))
        write_message(f"wrote {out}: {len(curve.points)} amounts of material, {curve.n_test} utterances held out")
