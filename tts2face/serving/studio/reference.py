"""The other side of a comparison: the project as it was kept, or with other settings, or recorded motion (pure)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from lexicon.errors import InputError
from lexicon.values.fields import check_fields
from lexicon.values.records import checked
from tts2face.request import OPTIONS, Recorded, Request, Spoken
from tts2face.session.named_models import Models
from tts2face.session.project import Project
from tts2face.session.project_file import parse_project, project_json

KEPT = "kept"
SETTINGS = "settings"
RECORDING = "recording"
TAKE = "take"
KINDS = (KEPT, SETTINGS, RECORDING, TAKE)
NOT_SETTINGS = frozenset(
    {"text", "audio", "idle", "listen", "partner", "timeline", "dictionary", "text_marks"}
)  # what is said stays the same
MAX_LABEL = 100
MAX_OFFSET_S = 3600.0


@dataclass(frozen=True, slots=True)
class Reference:
    """The A of a comparison.

    Parameters
    ----------
    kind
        ``kept``: `project`. ``settings``: the project with other `request` and `models`. ``recording``: motion of the
        talker's `recording`. ``take``: motion of an imported Live Link take.
    label
        What it is, for people.
    offset
        Second of the recorded motion at which the project's sound begins.
    """

    kind: str
    label: str = ""
    project: Project | None = None
    request: Mapping[str, Any] = field(default_factory=dict)
    models: Mapping[str, Any] = field(default_factory=dict)
    recording: str = ""
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values of other types, and what is incomplete."""
        check_fields(self)
        if self.kind not in KINDS:
            raise InputError(f"a project is compared with {', '.join(KINDS)}, not {self.kind[:20]!r}")
        if self.kind == KEPT and self.project is None:
            raise InputError("a comparison with a kept project needs that project; keep it again")
        if self.kind == SETTINGS:
            _check_settings(self.request, self.models)
        if self.kind == RECORDING and not self.recording:
            raise InputError("a comparison with a recording needs its name; choose one from the list")
        if len(self.label) > MAX_LABEL or abs(self.offset) > MAX_OFFSET_S:
            raise InputError(f"a label has at most {MAX_LABEL} characters, an offset {MAX_OFFSET_S:g} s; change it")

    @property
    def is_recorded(self) -> bool:
        """Whether its motion is recorded and not synthesised."""
        return self.kind in {RECORDING, TAKE}


@dataclass(frozen=True, slots=True)
class _Written:
    kind: str
    label: str = ""
    project: Any = None
    request: Mapping[str, Any] = field(default_factory=dict)
    models: Mapping[str, Any] = field(default_factory=dict)
    recording: str = ""
    offset: float = 0.0


def reference_project(reference: Reference, project: Project) -> Project:
    """The project whose clip is the A, given the project as it is now; for recorded motion, what that depends on."""
    if reference.kind == KEPT:
        assert reference.project is not None
        return reference.project
    if reference.is_recorded:
        kept = project.request
        source = Recorded(kept.source.audio) if isinstance(kept.source, Recorded) else Spoken("")
        request = Request(source=source, fps=kept.fps, gestures=kept.gestures)
        return Project(request=request, models=project.models)
    options = dict(reference.request)
    gestures = options.get("gestures", project.request.gestures)
    if gestures == "none":
        options |= {"style": None, "gain": None, "expression": None, "pitch": False}
    elif gestures == "noise":
        options["pitch"] = False
    return replace(
        project, request=replace(project.request, **options), models=replace(project.models, **reference.models)
    )


def reference_json(reference: Reference, folder: Path) -> dict[str, Any]:
    """JSON object of a reference; paths of its project are relative to a folder."""
    kept = None if reference.project is None else project_json(reference.project, folder)
    values = {option.name: getattr(reference, option.name) for option in fields(Reference)}
    return {**values, "request": dict(reference.request), "models": dict(reference.models), "project": kept}


def parse_reference(content: Any, folder: Path) -> Reference:
    """Reference of `reference_json`."""
    given = checked(_Written, content, "the comparison", InputError)
    kept = None if given.project is None else parse_project(given.project, "the kept project", folder)
    return Reference(given.kind, given.label, kept, given.request, given.models, given.recording, given.offset)


def _check_settings(request: Mapping[str, Any], models: Mapping[str, Any]) -> None:
    if not request and not models:
        raise InputError("a comparison with other settings needs at least one; give request or models")
    known = OPTIONS.keys() - NOT_SETTINGS
    for name in request:
        if name not in known:
            raise InputError(f"a comparison cannot change {name[:40]!r} of the request; choose one of {sorted(known)}")
    for name in models:
        if name not in {option.name for option in fields(Models)}:
            raise InputError(
                f"there is no model {name[:40]!r}; choose one of {[option.name for option in fields(Models)]}"
            )
