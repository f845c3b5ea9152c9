"""Every option of clips is taken by each door, or left out with a reason; limits and choices are the same."""

from collections.abc import Mapping
from dataclasses import fields

import pytest
from pydantic import BaseModel, ValidationError

from tts2face.picture.options import Picture
from tts2face.request import Request, option_fields
from tts2face.serving.batch.cast import MODEL_NAMES, NOT_IN_CAST, REQUEST_NAMES
from tts2face.serving.service.clip_options import LIMITS, NOT_IN_CLIPS, RECORDS, ClipRequest
from tts2face.serving.service.job_kinds.subtitles import BATCH_FIELDS, NOT_IN_SUBTITLES, SubtitlesRequest
from tts2face.serving.service.routes.headtts import HeadTtsRequest
from tts2face.serving.service.routes.live import NOT_IN_LIVE_TEXT, TextOptions
from tts2face.serving.service.routes.openai import SAME_NAMES, Speech
from tts2face.session.named_models import Models

OPTIONS = {one.name for record in RECORDS for one in option_fields(record)}
DOORS: list[tuple[type[BaseModel], Mapping[str, str], set[str]]] = [
    (ClipRequest, NOT_IN_CLIPS, {"format"}),
    (SubtitlesRequest, NOT_IN_SUBTITLES, {*BATCH_FIELDS, "cast"}),
    (TextOptions, NOT_IN_LIVE_TEXT, {"type", "input", "with_idle", "targets"}),
]  # fmt: skip
# Fields of protocols of others, and the options that they are.
SAME: list[tuple[type[BaseModel], Mapping[str, str]]] = [
    (Speech, {name: name for name in SAME_NAMES}),
    (HeadTtsRequest, {"language": "language", "dictionary": "dictionary"}),
]  # fmt: skip


@pytest.mark.parametrize(("door", "left_out", "own"), DOORS, ids=lambda one: getattr(one, "__name__", ""))
def test_a_door_takes_every_option_or_says_why_not(
    door: type[BaseModel], left_out: Mapping[str, str], own: set[str]
) -> None:
    taken = set(door.model_fields) - own
    assert taken.isdisjoint(left_out)
    assert taken | set(left_out) == OPTIONS
    assert all(left_out.values())


@pytest.mark.parametrize(("door", "names"), SAME, ids=lambda one: getattr(one, "__name__", ""))
def test_other_protocols_take_options_as_clips_do(door: type[BaseModel], names: Mapping[str, str]) -> None:
    for name, option in names.items():
        field, other = door.model_fields[name], ClipRequest.model_fields[option]
        assert (field.annotation, field.default, field.metadata) == (other.annotation, other.default, other.metadata)


def test_casts_take_every_option_of_a_request_and_every_model() -> None:
    assert {*REQUEST_NAMES, *NOT_IN_CAST} == {one.name for one in option_fields(Request)}
    assert set(MODEL_NAMES) == {one.name for one in fields(Models)}
    assert all(NOT_IN_CAST.values())


@pytest.mark.parametrize("record", [Request, Picture])
def test_numbers_and_names_beyond_an_option_are_refused_by_http_as_by_python(record: type) -> None:
    for one in option_fields(record):
        limits, choices = LIMITS.get(one.name) or one.metadata["limits"], one.metadata["choices"]
        if one.name in NOT_IN_CLIPS or not (limits or choices):
            continue
        wrong = [limits[0] - 1, limits[1] + 1] if limits else ["nothing"]
        right = [limits[0] if one.default is None else type(one.default)(limits[0])] if limits else list(choices)
        for value in wrong:
            with pytest.raises(ValidationError):
                ClipRequest.model_validate({one.name: value})
        for value in right:
            assert getattr(ClipRequest.model_validate({one.name: value}), one.name) == value


def test_defaults_over_http_are_those_of_python() -> None:
    assert ClipRequest().model_dump(exclude={"format", *(one.name for one in fields(Models))}) == {
        one.name: one.default
        for record in (Request, Picture)
        for one in option_fields(record)
        if one.name not in NOT_IN_CLIPS
    }
