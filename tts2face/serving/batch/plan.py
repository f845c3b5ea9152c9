"""The plan of a batch: which outputs are made of which segments."""

from collections.abc import Sequence
from pathlib import Path

from lexicon.errors import InputError
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.serving.batch.cast import Cast
from tts2face.serving.batch.export import check_faces
from tts2face.serving.batch.file_plan import FilePlan, PlanBase
from tts2face.serving.batch.lines import Lines, read_lines
from tts2face.serving.batch.options import BatchOptions, non_defaults
from tts2face.serving.batch.output import Plan, PlannedLine, PlanWarning, join_outputs, output_names
from tts2face.serving.batch.speakers import shown_name
from tts2face.session.named_models import Models

MAX_NAMED = 8  # speakers in a warning


def plan_batch(  # noqa: PLR0913 - one parameter a kind of settings
    files: Sequence[Path],
    options: BatchOptions,
    *,
    request: Request | None = None,
    picture: Picture | None = None,
    models: Models | None = None,
    cast: Cast | None = None,
    lines: Path | None = None,
) -> Plan:
    """Plan the clips of subtitle files; nothing is loaded or rendered.

    Parameters
    ----------
    request, picture, models
        Settings of all cues; those of the cast take precedence.
    lines
        Table with the settings of single lines, which take precedence over the cast.

    Raises
    ------
    InputError
        There is no file, an option is invalid, or a model does not exist.
    DataError
        A subtitle file has no cue or cannot be read, or the table of lines cannot be used.
    """
    if not files:
        raise InputError("there are no subtitles; give files such as .srt, .vtt or .ass, or films with subtitles")
    if picture is not None and picture.is_transparent and options.format in ("mp4", "mov"):
        raise InputError(f".{options.format} has no transparency; choose --format webm, or another background")
    names = output_names(files)
    base = PlanBase(
        options,
        request or Request(),
        non_defaults(picture or Picture()),
        models or Models(),
        cast or Cast(),
        len(files),
        Lines() if lines is None else read_lines(lines, names),
    )
    planned = [FilePlan(base, path, name) for path, name in zip(files, names, strict=True)]
    outputs = [output for plan in planned for output in plan.outputs()]
    if options.per == "film" and outputs:
        outputs = [join_outputs("film", outputs)]
        check_faces(outputs[0])
    found = tuple(line for plan in planned for line in plan.lines())
    base.lines.check((line.file, line.number, line.part) for line in found)
    warnings = [warning for plan in planned for warning in plan.warnings]
    used = {role for plan in planned for role in plan.speakers.used}
    warnings += [
        PlanWarning("the cast", 0, text) for text in (*base.cast.unused(used), *_without_role(base.cast, found))
    ]
    n_cues, n_silent = sum(plan.n_cues for plan in planned), sum(plan.n_silent for plan in planned)
    notes = tuple(note for plan in planned for note in plan.notes)
    return Plan(tuple(outputs), tuple(warnings), n_cues, n_silent, found, notes)


def _without_role(cast: Cast, lines: Sequence[PlannedLine]) -> list[str]:
    """A warning about the speakers whom no role of a cast matches."""
    counts: dict[str, int] = {}
    for line in lines:
        if cast.roles and line.casting.role is None and not line.casting.other and line.segment is not None:
            name = shown_name(line.speaker, line.casting)
            counts[name] = counts.get(name, 0) + 1
    if not counts:
        return []
    shown = [f"{name} ({n} line{'s' * (n > 1)})" for name, n in sorted(counts.items(), key=lambda count: -count[1])]
    more = f" and {len(shown) - MAX_NAMED} more" if len(shown) > MAX_NAMED else ""
    return [f"no role applies to {', '.join(shown[:MAX_NAMED])}{more}; they have the default face and voice"]
