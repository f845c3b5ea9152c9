"""Kinds of jobs: each that clients may ask for is executed, and has places in a worker."""

import pytest

from tests.docs.blocks import DOCS
from tts2face.serving.service.job_kinds.table import JOB_KINDS
from tts2face.serving.work.kinds import KINDS
from tts2face.serving.work.queues import PLACES
from tts2face.serving.work.run import find_runner


@pytest.mark.parametrize("kind", sorted({*KINDS, *JOB_KINDS}))
def test_a_kind_is_asked_for_executed_and_has_places(kind: str) -> None:
    assert kind in JOB_KINDS, f"add {kind} to JOB_KINDS of tts2face.serving.service.job_kinds.table"
    assert kind in KINDS, f"add {kind} to KINDS of tts2face.serving.work.kinds"
    page = (DOCS / "http.md").read_text(encoding="utf-8")
    assert f"`{kind}`" in page, f"docs/http.md: say what `{kind}` makes"
    assert callable(find_runner(kind))
    assert PLACES[KINDS[kind].queue] > 0
