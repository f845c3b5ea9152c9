"""Reports of a talker or a palette as one HTML page."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from corpus_tools.recordings.observation import Observation, Quality
from lexicon.errors import InputError
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker
from tts2face.processes.child import Call
from tts2face.storage.files import write_atomically
from tts2face.types import Progress

LEAST_UTTERANCES = 10  # of an accuracy report: two are held out
SEED = 0


@dataclass(frozen=True, slots=True)
class ReportOrder:
    """Order of a report.

    Parameters
    ----------
    kind
        One of `REPORTS`.
    model
        Name of a shipped talker or palette, or the path of a file.
    name
        Name of the model in the report.
    out
        The page.
    """

    kind: str
    model: str
    name: str
    out: str


def similarity_report(model: str, name: str, on_progress: Progress) -> str:
    """Page of the visual similarity of a talker's phones."""
    from corpus_tools.studies.similarity.analysis import NamedTalker, SimilarityOptions, analyse
    from corpus_tools.studies.similarity.page import similarity_page

    return similarity_page(
        analyse(NamedTalker(name, load_talker(model)), SimilarityOptions(), None, on_progress), "both"
    )


def gesture_report(model: str, name: str, on_progress: Progress) -> str:
    """Page that compares a palette's gestures with motion from its fields, noise and published fields."""
    from corpus_tools.studies.gestures.analysis import StudyOptions, study_gestures
    from corpus_tools.studies.gestures.page import gestures_page
    from tts2face.models.palette_file import load_palette

    return gestures_page(study_gestures(name, load_palette(model), StudyOptions(), on_progress))


def accuracy_report(model: str, name: str, on_progress: Progress) -> str:
    """Page of the accuracy of lips for a fifth of a talker's recordings, made by what the others teach."""
    from corpus_tools.measures.splits import split_randomly
    from corpus_tools.studies.evaluation.evaluate import evaluate
    from corpus_tools.studies.evaluation.page import evaluation_page

    talker = load_talker(model)
    if len(talker.utterances) < LEAST_UTTERANCES:
        raise InputError(
            f"the talker {name} has {len(talker.utterances)} recordings; an accuracy report holds some out and needs "
            f"{LEAST_UTTERANCES}"
        )
    found, runs = evaluate([split_randomly(talker_observations(talker), seed=SEED)], on_progress=on_progress)
    return evaluation_page(found, runs)


def talker_observations(talker: Talker) -> tuple[Observation, ...]:
    """The recordings of a talker as observations: landmarks as its shape model holds them, without what it leaves out.

    Phones, words and levels are those of the recordings; the pictures are gone.
    """
    return tuple(
        Observation(
            utterance.name,
            talker.fps,
            talker.model.shapes(utterance.shape),
            utterance.head,
            utterance.phones,
            utterance.words,
            utterance.intensity,
            Quality(0.0, 1.0, 0, 0.0),
            Path(utterance.name),
        )
        for utterance in talker.utterances
    )


REPORTS: Mapping[str, tuple[str, Callable[[str, str, Progress], str]]] = MappingProxyType(
    {
        "similarity": ("comparing halves", similarity_report),
        "gestures": ("analysing styles", gesture_report),
        "accuracy": ("evaluating methods", accuracy_report),
    }
)


def report(call: Call) -> dict[str, Any]:
    """Write the page of a `ReportOrder`.

    Raises
    ------
    InputError, DataError, BackendError
        There is no such report, or it cannot be made of this model.
    """
    order = ReportOrder(**call.content)
    call.hide(order.model, order.name)
    if order.kind not in REPORTS:
        raise InputError(f"there is no report {order.kind!r}; choose one of {', '.join(REPORTS)}")
    stage, make = REPORTS[order.kind]
    page = make(order.model, order.name, call.stage(stage))
    write_atomically(Path(order.out), page.encode())
    return {}
