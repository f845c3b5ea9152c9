"""``tts2face report``: analyses of visual speech and gestures, as pages, tables and pictures."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from cli.flags import Face, parse_numbers, whole_number
from cli.photo import Yes
from cli.process import write_message
from cli.progress import progress_bar, stage_bar
from cli.tool_flags import DEFAULTS, ToolFlags
from tts2face.storage.output_paths import refuse_overwriting

report = App(
    name="report",
    help="Analyse recordings: visual similarity of phones, statistics of gestures, retargeting to a face.",
)


@report.command
def similarity(  # noqa: PLR0913 - one parameter a flag
    talker: Annotated[str, Parameter(help="Shipped talker or .talker file.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output: .html, .csv, .json or .png.", alias="-o")],
    classes: Annotated[
        str | None,
        Parameter(help="Numbers of viseme classes to list; by default those of 4,6,8,10,12 that the phones allow."),
    ] = None,
    halves: Annotated[int, whole_number("Number of random split halves of the corpus to compare (.html, .json).")] = 20,
    seed: Annotated[int, whole_number("Seed of the random halves and permutations (.html, .json).")] = 0,
    compare: Annotated[
        str | None, Parameter(help="Second talker to compare with; .csv and .png then contain the difference.")
    ] = None,
    labels: Annotated[str, Parameter(help="Phone labels: both, ipa or arpabet (.json always has both).")] = "both",
) -> None:
    """Analyse the visual similarity of phones: matrix, neighbours, viseme classes, reliability, articulation."""
    refuse_overwriting({"--out": out}, {"the talker": talker, "--compare": compare})
    from corpus_tools.studies.similarity.analysis import SimilarityOptions
    from corpus_tools.studies.similarity.write import write_similarity

    expected = "whole numbers separated by commas, such as 4,8,12"
    counts = None if classes is None else parse_numbers("--classes", classes, int, expected)
    options = SimilarityOptions(counts, halves, seed)
    with progress_bar("comparing halves") as on_progress:
        analysis = write_similarity(talker, out, options, other=compare, labels=labels, on_progress=on_progress)
    write_message(
        f"wrote {out}: {len(analysis.table.phones)} phones, best number of classes {analysis.best.n_classes}, "
        f"reliability {analysis.by_utterances.full_length_reliability:.3f}"
    )


@report.command
def gestures(  # noqa: PLR0913 - one parameter a flag
    palette: Annotated[str, Parameter(help="Shipped palette or .palette file.")] = "starter",
    /,
    *,
    out: Annotated[Path, Parameter(help="Output: .html, .csv, .json or .png.", alias="-o")],
    held_out: Annotated[int, whole_number("Hold out one in this many recordings for the comparison.")] = 5,
    halves: Annotated[int, whole_number("Number of random split halves of the held-out recordings to compare.")] = 50,
    clips: Annotated[int, whole_number("Number of clips, of different seeds, made by each method.")] = 3,
    seed: Annotated[int, whole_number("Seed of the random choice of recordings, halves and clips.")] = 0,
    people: Annotated[
        Path | None, Parameter(help="Folder of fixations of people in conversation, to compare the gaze with.")
    ] = None,
    speech: Annotated[
        bool, Parameter(negative="", help="Also speak sentences, and compare head, brows and blinks with people.")
    ] = False,
) -> None:
    """Compare each style's gestures with motion from its fields, noise and published fields for the same sound."""
    refuse_overwriting({"--out": out}, {"the palette": palette, "--people": people})
    from corpus_tools.studies.gestures.analysis import StudyOptions
    from corpus_tools.studies.gestures.write import write_gestures

    options = StudyOptions(held_out, halves, clips, seed, people, speech)
    with progress_bar("analysing styles") as on_progress:
        study = write_gestures(palette, out, options, on_progress=on_progress)
    n_met, n_targets = study.targets
    write_message(f"wrote {out}: {len(study.styles)} styles, {n_met} of {n_targets} targets met")


@report.command
def moods(  # noqa: PLR0913 - one parameter a flag
    palette: Annotated[str, Parameter(help="Shipped palette or .palette file.")] = "starter",
    /,
    *,
    out: Annotated[Path, Parameter(help="Output: .csv, .json or .png (contact sheet).", alias="-o")],
    face: Face = None,
    seeds: Annotated[int, whole_number("Number of clips of each mood; the first half trains the classifier.")] = 8,
    seed: Annotated[int, whole_number("Seed of the first clip.")] = 0,
    size: Annotated[int, whole_number("Width and height of the rendered pictures in pixels.")] = 256,
    yes: Yes = False,
) -> None:
    """Render the derived styles of a palette and tell them apart by the face tracker's scores."""
    refuse_overwriting({"--out": out}, {"the palette": palette, "--face": face})
    from corpus_tools.studies.gestures.moods import MoodOptions
    from corpus_tools.studies.gestures.write_moods import write_moods
    from tts2face.session.session import Session

    options = MoodOptions(seeds=seeds, first_seed=seed, size=size)
    with progress_bar("rendering moods") as on_progress:
        study = write_moods(Session(face=face, palette=palette), out, options, on_progress=on_progress)
    write_message(
        f"wrote {out}: of {int(study.confusion.sum())} clips of {len(study.moods)} moods {study.accuracy:.0%} are "
        f"recognised, of their single frames {study.frame_accuracy:.0%}"
    )


@report.command
def retarget(
    recordings: Annotated[Path, Parameter(help="Folder of recordings of a person, or one video.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output: .html, .csv, .json or .png.", alias="-o")],
    face: Face = None,
    identity: Annotated[str | None, Parameter(help="Preset of the face's age, sex and ancestry.")] = None,
    tool: ToolFlags = DEFAULTS,
) -> None:
    """Compare what the face tracker reads in recordings and in a face that mimics them, phone by phone."""
    refuse_overwriting({"--out": out}, {"the recordings": recordings, "--face": face, "--model": tool.model})
    from corpus_tools.studies.retargeting.write import write_retargeting
    from tts2face.models.face_names import default_face

    with stage_bar() as stages:
        study = write_retargeting(
            recordings,
            out,
            face=face or default_face(identity, None),
            identity=identity,
            run_options=tool.run_options(),
            stages=stages,
        )
    write_message(
        f"wrote {out}: {study.n_recordings} recordings, {study.n_missed} of {study.differences.size} scores differ by "
        "more than .06"
    )
