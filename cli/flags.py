"""Flags made from the fields of option dataclasses, so that every option is named and explained once."""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, fields
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

from cyclopts import Group, Parameter

if TYPE_CHECKING:
    from cyclopts import Token


def parse_whole_number(_: Any, tokens: "Sequence[Token]") -> int:
    """The number of a flag that counts; cyclopts itself rounds 2.5 to 2."""
    try:
        return int(tokens[0].value)
    except ValueError as wrong:
        raise ValueError(f'"{tokens[0].value}" is no whole number') from wrong


def add_option_flags(*groups: tuple[str, type], without: frozenset[str] = frozenset()) -> Callable[..., Any]:
    """Give a command one keyword flag for each field of the option dataclasses, under a heading for each class.

    The command takes them as ``**options``; `options_from_flags` turns them back into an instance.
    """
    headed = [(Group.create_ordered(heading), options) for heading, options in groups]

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        own = [
            parameter
            for parameter in inspect.signature(command).parameters.values()
            if parameter.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        added = [
            _parameter(option, get_type_hints(options)[option.name], heading)
            for heading, options in headed
            for option in fields(options)
            if option.name not in without
        ]
        command.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
        command.__annotations__ = {parameter.name: parameter.annotation for parameter in [*own, *added]}
        return command

    return decorate


def _parameter(option: "Field[Any]", kind: Any, group: Group) -> inspect.Parameter:
    default = inspect.Parameter.empty if option.default is MISSING else option.default
    converter = parse_whole_number if kind in (int, int | None) else None
    negative = f"--no-{option.name}" if default is True else ""
    annotation = Annotated[
        kind, Parameter(help=option.metadata["help"], group=group, negative=negative, converter=converter)
    ]
    return inspect.Parameter(option.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def options_from_flags(options: type, flags: dict[str, Any], **more: Any) -> Any:
    """An instance of an option dataclass from the flags that belong to it."""
    names = {option.name for option in fields(options)}
    return options(**{name: value for name, value in flags.items() if name in names}, **more)
