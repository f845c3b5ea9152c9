"""Undo and redo of a project."""

from dataclasses import replace

import pytest

from lexicon.errors import InputError
from tts2face.serving.studio.history import MAX_STEPS, History
from tts2face.session.project import Project

BEGIN = History(Project(name="0"))


def named(history: History, *names: str, topic: str = "", continues: bool = False) -> History:
    for name in names:
        history = history.add(replace(history.present, name=name), topic, continues=continues)
    return history


def test_every_step_is_taken_back_and_made_again() -> None:
    history = named(BEGIN, "1", "2", "3")
    seen = [history.present.name]
    while history.past:
        history = history.undo()
        seen.append(history.present.name)
    while history.future:
        history = history.redo()
        seen.append(history.present.name)
    assert seen == ["3", "2", "1", "0", "1", "2", "3"]


def test_an_edit_after_undo_ends_the_undone_branch() -> None:
    history = named(named(BEGIN, "1", "2").undo(), "other")
    assert (history.present.name, history.future) == ("other", ())
    assert history.undo().present.name == "1"


def test_nothing_to_undo_or_redo_is_said() -> None:
    with pytest.raises(InputError, match="nothing to undo"):
        BEGIN.undo()
    with pytest.raises(InputError, match="nothing to redo"):
        BEGIN.redo()


def test_edits_that_continue_each_other_are_one_step() -> None:
    history = named(BEGIN, "a", "ab", "abc", topic="name", continues=True)
    assert history.undo().present.name == "0"
    other = named(history, "x", topic="paint", continues=True)
    assert other.undo().present.name == "abc"


def test_what_follows_from_an_edit_is_no_step() -> None:
    history = named(BEGIN, "1")
    amended = history.amend(replace(history.present, name="1 cut"))
    assert (amended.present.name, amended.undo().present.name) == ("1 cut", "0")


def test_an_edit_without_effect_is_no_step() -> None:
    assert named(BEGIN, "0") is BEGIN


def test_old_steps_are_dropped() -> None:
    history = named(BEGIN, *map(str, range(1, MAX_STEPS + 6)))
    assert len(history.past) == MAX_STEPS
    assert history.past[0].project.name == "5"
