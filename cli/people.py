"""``tts2face corpus evaluate --people``: a finished talker on landmark tracks of other people."""

from pathlib import Path

from cli.evaluation_flags import ComparisonFlags
from cli.process import write_message
from lexicon.errors import InputError
from tts2face.storage.output_paths import check_file_name

PEOPLE_SUFFIXES = (".json", ".csv")
DEFAULT_TALKER = "grid_s1"
DEFAULT_METHOD = "exemplar"
SHOWN_METHODS = (DEFAULT_METHOD, "networks alone")  # in the table by phone


def run_people_evaluation(talker: str, people: list[Path], comparison: ComparisonFlags, out: Path | None) -> None:
    """Evaluate every method of a talker on the people's tracks; print the tables, and write them to `out`."""
    if out is not None:
        check_file_name(out, "an evaluation of people", PEOPLE_SUFFIXES)
    if len({folder.resolve() for folder in people}) < len(people):
        raise InputError("--people names a folder twice; remove one")
    from corpus_tools.studies.evaluation.heard import find_sounds, with_hand_edges
    from corpus_tools.studies.evaluation.people import evaluate_people
    from corpus_tools.studies.evaluation.people_tables import difference_table, people_table, phone_table
    from corpus_tools.studies.evaluation.person_tracks import read_person
    from corpus_tools.studies.evaluation.tracks import read_tracks
    from corpus_tools.training.pose_correction import correct_pose
    from tts2face.models.talker_file import load_talker

    tests = [correct_pose(read_person(folder)) for folder in people]
    external = read_tracks(comparison.tracks) if comparison.tracks is not None else None
    sounds = None
    if comparison.sounds is not None:
        sounds = find_sounds(comparison.sounds, [observation for person in tests for observation in person])
        tests = [with_hand_edges(person, sounds) for person in tests]
    found = evaluate_people(load_talker(talker), tests, external, sounds)
    for warning in found.warnings:
        write_message(f"warning: {warning}")
    methods = [name for name in SHOWN_METHODS if name in found.figures]
    tables = (people_table(found), difference_table(found, DEFAULT_METHOD), phone_table(found, methods))
    print("\n\n".join(tables))  # noqa: T201 - the result
    if out is not None:
        from corpus_tools.studies.evaluation.people_tables import REPORT
        from tts2face.storage.files import write_atomically

        write_atomically(out, REPORT.formats[out.suffix](found))
        write_message(f"wrote {out}: {found.n_utterances} utterances of {found.n_people} people")
