"""OpenAPI description of the body of a new job, made of the kinds of jobs."""

from typing import Any

from tts2face.service.job_kinds import JOB_KINDS


def new_job_schema() -> dict[str, Any]:
    """Body of `POST /v1/jobs` for the OpenAPI description: the kinds, as JSON or as a form with files."""
    schemas = [_kind_schema(name) for name in JOB_KINDS]
    parts: dict[str, Any] = {"job": {"type": "string", "description": "The job as JSON: kind, request, webhook."}}
    for kind in JOB_KINDS.values():
        for part, (text, _) in kind.parts.items():
            file = {"type": "string", "format": "binary"}
            several = {"type": "array", "items": file} if part in {"subtitles", "audio"} else file
            parts.setdefault(part, {**several, "description": text})
    return {
        "description": "A job as JSON; or a form whose part `job` holds it, with files.",
        "required": True,
        "content": {
            "application/json": {
                "schema": {"oneOf": schemas},
                "example": {"kind": "clip", "request": {"text": "Hello there.", "format": "mp4"}},
            },
            "multipart/form-data": {"schema": {"type": "object", "required": ["job"], "properties": parts}},
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
            },
        },
    }
