"""The kinds of jobs, by the names that clients send, and the OpenAPI description of them."""

import json
from collections.abc import Sequence
from typing import Any

from tts2face.serving.service.job_kinds.clip import CLIP_KIND
from tts2face.serving.service.job_kinds.order import JobKind
from tts2face.serving.service.job_kinds.subtitles import SUBTITLES_KIND
from tts2face.serving.service.job_kinds.talker import TALKER_KIND
from tts2face.serving.work.resource_check import TALKER

JOB_KINDS: dict[str, JobKind] = {"clip": CLIP_KIND, "subtitles": SUBTITLES_KIND, "talker": TALKER_KIND}


def new_job_schema(names: Sequence[str]) -> dict[str, Any]:
    """Body of a new job of some kinds for the OpenAPI description: as JSON, or as a form with files."""
    schemas = [_kind_schema(name) for name in names]
    parts: dict[str, Any] = {
        "job": {
            "type": "string",
            "description": "The job as JSON: kind, request, webhook.",
            "examples": [json.dumps({"kind": names[0], "request": {}})],
        }
    }
    asked = [(name, part) for kind in names for name, part in JOB_KINDS[kind].parts.items()]
    lists = {name for name, part in asked if part.is_list}
    file = {"type": "string", "format": "binary"}
    for name, part in asked:
        content = {"type": "array", "items": file} if name in lists else file
        parts.setdefault(name, {**content, "description": part.description})
    form = {"multipart/form-data": {"schema": {"type": "object", "required": ["job"], "properties": parts}}}
    if all(name == TALKER for name in names):  # nothing without files
        return {"description": "A form with a job and its files.", "required": True, "content": form}
    return {
        "description": "A job as JSON; or a form whose part `job` holds it, with files.",
        "required": True,
        "content": {
            "application/json": {
                "schema": {"oneOf": schemas},
                "example": {"kind": "clip", "request": {"text": "Hello there.", "format": "mp4"}},
            },
            **form,
        },
    }


def _kind_schema(name: str) -> dict[str, Any]:
    return {
        "type": "object",
        "title": f"Job of kind {name}",
        "required": ["kind"],
        "additionalProperties": False,
        "properties": {
            "kind": {"const": name, "description": "Kind of the job."},
            "request": JOB_KINDS[name].model.model_json_schema(),
            "webhook": {
                "type": ["string", "null"],
                "maxLength": 2000,
                "description": "URL, of a host in the setting webhook_hosts, that learns of the end of the job.",
                "examples": ["https://example.org/done"],
            },
        },
    }
