"""Projects whose text, voice or recording has changed: corrections that no longer belong to it are removed."""

from collections.abc import Collection
from dataclasses import replace

from lexicon.errors import InputError
from tts2face.project.project import Project


def without_edges(project: Project, sentences: Collection[tuple[str, int]]) -> Project:
    """The project without the corrected edges of some sentences, each a text and its occurrence."""
    return replace(
        project, edges=tuple(one for one in project.edges if (one.text, one.occurrence) not in set(sentences))
    )


def is_too_long(project: Project, duration: float) -> bool:
    """Whether the timeline of a project names times beyond its clip of `duration` seconds."""
    try:
        project.timeline.check_duration(duration)
    except InputError:
        return True
    return False


def cut_timeline(project: Project, duration: float) -> Project:
    """The project with its timeline cut to `duration` seconds."""
    return replace(project, timeline=project.timeline.restrict(0.0, duration))
