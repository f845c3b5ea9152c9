"""The history of a project: its earlier and its undone states (pure)."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

from lexicon.errors import InputError
from tts2face.session.project import Project

MAX_STEPS = 100  # that can be undone


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A state of a project beside its present one; `topic` is that of the edit between it and the next later state."""

    project: Project
    topic: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """A project with its earlier and its undone states.

    Parameters
    ----------
    past
        Earlier states, the oldest first, at most `MAX_STEPS`.
    future
        Undone states, the one that `redo` returns to last.
    """

    present: Project
    past: tuple[Step, ...] = ()
    future: tuple[Step, ...] = ()

    def add(self, project: Project, topic: str = "", *, continues: bool = False) -> "History":
        """The history with a new state.

        Parameters
        ----------
        topic
            What the edit changed: its kind, and in which part.
        continues
            Whether the edit continues the last one if both have the same topic, so that one undo takes both back.
        """
        if _is_equal(project, self.present):
            return self
        # one drag of a slider is one step of the history
        if continues and self.past and not self.future and topic and self.past[-1].topic == topic:
            return replace(self, present=project)
        return History(project, (*self.past, Step(self.present, topic))[-MAX_STEPS:])

    def amend(self, project: Project) -> "History":
        """The history with another present state, which undo does not know: for what follows from an edit."""
        return replace(self, present=project)

    def revise(self, change: Callable[[Project], Project]) -> "History":
        """The history with every state changed alike: for what holds of the past, too, as the name of a style."""
        past, future = (
            tuple(Step(change(step.project), step.topic) for step in part) for part in (self.past, self.future)
        )
        return History(change(self.present), past, future)

    def undo(self) -> "History":
        """The state before the last edit."""
        if not self.past:
            raise InputError("there is nothing to undo")
        last = self.past[-1]
        return History(last.project, self.past[:-1], (*self.future, Step(self.present, last.topic)))

    def redo(self) -> "History":
        """The state that was undone last."""
        if not self.future:
            raise InputError("there is nothing to redo")
        last = self.future[-1]
        return History(last.project, (*self.past, Step(self.present, last.topic)), self.future[:-1])


def _is_equal(a: Project, b: Project) -> bool:
    return all(getattr(a, field.name) == getattr(b, field.name) for field in fields(Project))
