"""Every class of options and settings refuses values of other types where it is made, by one mechanism."""

import importlib
import pkgutil
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cli
import corpus_tools
import lexicon
import tts2face
from corpus_tools.build_palette import StyleSource
from corpus_tools.decomposition.capture_files import MarkerOptions
from corpus_tools.dense.person_look import LookChoices
from corpus_tools.run_options import RunOptions
from corpus_tools.studies.gestures.analysis import StudyOptions
from corpus_tools.studies.gestures.moods import MoodOptions
from corpus_tools.studies.similarity.analysis import SimilarityOptions
from corpus_tools.training.network_audio_map import NetworkMapOptions
from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.gestures.elements import (
    ChannelEdit,
    ExpressionCurve,
    ExpressionSpan,
    Gains,
    GazeTarget,
    Gesture,
    ListeningSpan,
    StrengthCurve,
    StyleSpan,
)
from tts2face.gestures.field import FieldOptions
from tts2face.gestures.timeline import Timeline
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.lips.options import ExcludedToken, SynthesisOptions
from tts2face.models.palette_editing import StyleMix
from tts2face.picture.options import Picture
from tts2face.request import FromPhones, FromSound, Idle, Listening, Recorded, Request, Spoken
from tts2face.serving.batch.cast import Cast, Role
from tts2face.serving.batch.lines import LineSettings
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.studio.reference import KEPT, Reference
from tts2face.session.corrections import SentenceEdges
from tts2face.session.encoded_stream import StreamFormat
from tts2face.session.named_models import Models
from tts2face.session.performance import Performance
from tts2face.session.project import Project
from tts2face.source_options import SourceOptions
from tts2face.storage.signing import Credentials
from tts2face.types import Clip, Speech, Trajectory, Waveform, resting_head

SPEECH = Speech(Waveform(np.zeros(800), 8000), PhoneSequence(["a"], [0.0, 0.1]), (WordSpan("a", 0, 1),))
MADE: tuple[Any, ...] = (
    Request(), SourceOptions(), Spoken("a"), FromPhones(), FromSound("network"), Recorded(Path("a.wav")), Idle(1.0),
    Listening(1.0), Models(), Picture(), Project(), Timeline(), BatchOptions(), Cast(), Role({}, {}), LineSettings(),
    SubtitleOptions(), ServiceSettings(), Performance(take=Path("a.mp4")), StreamFormat("mp3", Picture()),
    SynthesisOptions(), FieldOptions(), ExcludedToken("a", 0.0), SentenceEdges("a", 0, ("a",), (0.0, 0.1)),
    StyleMix("neutral"), Reference(KEPT, project=Project()),
    StyleSpan("head", "sad", 0.0), ExpressionSpan("happy", 0.5), GazeTarget(0.0, 0.0), ListeningSpan(), Gesture(0.0),
    StrengthCurve("head", ((0.0, 1.0),)), ExpressionCurve("happy", ((0.0, 1.0),)),
    ChannelEdit("jawOpen", ((0.0, 1.0),)), Gains(),
    WordSpan("a", 0, 1), SPEECH, Clip(Trajectory(["a"], np.zeros((3, 1)), 30.0), resting_head(3, 30.0), SPEECH),
    RunOptions(), MarkerOptions(), StyleSource(recordings=Path("a")), LookChoices(), StudyOptions(), MoodOptions(),
    SimilarityOptions(), NetworkMapOptions(), Credentials(Path("a.pem"), Path("b.pem")),
)  # fmt: skip
OF_READERS = "made by the package, which reads or computes it"
ARRAYS = "arrays, which a constructor or a table of their types and ranges checks"
LEFT_OUT = {
    "BatchResult": OF_READERS, "Chunk": OF_READERS, "Cue": OF_READERS, "ImportReport": OF_READERS,
    "FileMarks": OF_READERS, "Frame": OF_READERS, "ImportedFace": OF_READERS, "LiveEvent": OF_READERS,
    "Piece": OF_READERS,
    "Plan": OF_READERS, "Subtitles": OF_READERS,
    "WrittenCharacter": OF_READERS, "WrittenClip": OF_READERS,
    "Face": ARRAYS, "Palette": ARRAYS, "PhoneSequence": ARRAYS, "Talker": ARRAYS, "Trajectory": ARRAYS,
    "Waveform": ARRAYS,
    "SpeakOptions": "made by the command line, whose flags have these types",
    "PoolSettings": "made by the service of its settings",
    "TrainingOptions": "constants of the package",
}  # fmt: skip


def option_classes() -> Iterator[type]:
    """Dataclasses that users are told of, and those that are named as options or settings."""
    yield from (one for one in (getattr(tts2face, name) for name in tts2face.__all__) if is_dataclass(one))
    for package in (cli, corpus_tools, lexicon, tts2face):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            file = Path(found.module_finder.path, f"{found.name.rpartition('.')[2]}.py")  # type: ignore[union-attr]
            names = re.findall(r"^class (\w+(?:Options|Settings))\b", file.read_text(), re.M) if file.is_file() else ()
            yield from (
                one for name in names if is_dataclass(one := getattr(importlib.import_module(found.name), name))
            )


@pytest.mark.parametrize("made", MADE, ids=lambda made: type(made).__name__)
def test_each_field_refuses_a_value_of_another_type(made: Any, subtests: pytest.Subtests) -> None:
    for one in fields(made):
        with subtests.test(one.name), pytest.raises(InputError, match=rf"^{one.name} must be .*, not "):
            replace(made, **{one.name: object()})


def test_no_class_of_options_is_forgotten() -> None:
    known = {type(made).__name__ for made in MADE}
    assert not known & LEFT_OUT.keys()
    assert {one.__name__ for one in option_classes()} - known == LEFT_OUT.keys()


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"data": 7}, "^data must be a path, not 7"),
        ({"data": True}, "^data must be a path, not true"),
        ({"port": "80"}, '^port must be a whole number, not "80"'),
        ({"port": True}, "^port must be a whole number, not true"),
        ({"port": 80.0}, r"^port must be a whole number, not 80\.0"),
        ({"log_text": 1}, "^log_text must be true or false, not 1"),
        ({"body_s": "9"}, '^body_s must be a number, not "9"'),
        ({"talker": None}, "^talker must be a text in quotes, not null"),
        ({"hosts": "a.example"}, '^hosts must be a list in square brackets, not "a.example"'),
        ({"hosts": ("a.example", 7)}, "^each value of hosts must be a text in quotes, not 7"),
    ],
)
def test_settings_of_the_service_say_what_is_wrong(given: dict[str, Any], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        ServiceSettings(**given)


def test_settings_of_python_users_become_those_of_a_file() -> None:
    given = ServiceSettings(data="a/b", hosts=["a.example"], body_mb=2)  # type: ignore[arg-type]
    assert given == ServiceSettings(data=Path("a/b"), hosts=("a.example",), body_mb=2.0)
    assert given.data_folder == Path("a/b")
