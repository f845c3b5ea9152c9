"""One study for all tests of the room."""

import pytest

from corpus_tools.studies.gestures.analysis import GestureStudy, StudyOptions, study_gestures
from tests.corpus_tools.gesture_study.made_palette import made_palette
from tests.kept import kept


@pytest.fixture(scope="session")
def found() -> GestureStudy:
    return kept(made_study)


def made_study() -> GestureStudy:
    return study_gestures("made", made_palette(), StudyOptions(one_in=4, halves=10, clips=2))
