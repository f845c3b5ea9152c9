"""A batch of three cues with a voice of known durations, in small pictures."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.tones import LetterVoice
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.output import Plan
from tts2face.serving.batch.plan import plan_batch
from tts2face.session.named_models import Models
from tts2face.sound import voice_pool

FPS = 10
SRT = (
    "1\n00:00:00,500 --> 00:00:02,000\nANN: Hello there.\n\n"
    "2\n00:00:02,500 --> 00:00:04,000\n[door slams] Good morning to you all.\n\n"
    "3\n00:00:10,000 --> 00:00:11,500\nBob may move.\n"
)
SMALL = Picture(size="64x64", supersampling=1)
Planner = Callable[..., Plan]


@pytest.fixture
def voices(monkeypatch: pytest.MonkeyPatch) -> list[LetterVoice]:
    """Voices that were loaded; each speaks with `LetterVoice`."""
    loaded: list[LetterVoice] = []

    def load(*_: object) -> LetterVoice:
        loaded.append(LetterVoice())
        return loaded[-1]

    monkeypatch.setattr(voice_pool, "load_voice", load)
    return loaded


@pytest.fixture
def plan_of(tmp_path: Path) -> Planner:
    """Plan of subtitles in ``one.srt`` with batch options by name."""

    def plan(
        content: str = SRT,
        *,
        name: str = "one.srt",
        cast: object = None,
        models: Models | None = None,
        **options: object,
    ) -> Plan:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(content, encoding="utf-8")
        request = Request(fps=FPS)
        return plan_batch([path], BatchOptions(**options), request=request, picture=SMALL, models=models, cast=cast)

    return plan
