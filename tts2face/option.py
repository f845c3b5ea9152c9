"""Options of dataclasses: fields with a help text, limits and choices, from which flags and fields of HTTP are made."""

from dataclasses import field, fields
from typing import Any

from lexicon.errors import InputError
from lexicon.values.checks import check_limits


def option(default: Any, help_text: str, *, limits: tuple[float, float] | None = None, choices: Any = ()) -> Any:
    """Dataclass field with a default value, and in its metadata a help text, limits of a number and names to choose."""
    return field(default=default, metadata={"help": help_text, "limits": limits, "choices": tuple(choices)})


def check_option_limits(options: Any) -> None:
    """Refuse numbers of a dataclass of options that lie outside their limits (`InputError`)."""
    for declared in fields(options):
        value, limits = getattr(options, declared.name), declared.metadata.get("limits")
        if limits is not None and value is not None:
            check_limits(declared.name, value, limits)


def check_choices(options: Any, *names: str) -> None:
    """Refuse values of options, other than None, that are not among their choices (`InputError`)."""
    for declared in fields(options):
        value, choices = getattr(options, declared.name), declared.metadata.get("choices", ())
        if declared.name in names and value is not None and value not in choices:
            what = declared.name.replace("_", " ")
            raise InputError(f"there is no {what} {value!r}; choose {', '.join(choices[:-1])} or {choices[-1]}")
