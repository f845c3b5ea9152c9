"""Options as they stand on a command line: one that no command knows is refused, and never spoken as text."""

import difflib
import re
from collections.abc import Sequence

from cyclopts import App

from lexicon.errors import InputError

END_OF_OPTIONS = "--"  # what follows is text or a path, whatever it begins with
_SHORT_OPTION = re.compile(r"-[A-Za-z]")


def check_options(app: App, arguments: Sequence[str]) -> None:
    """Refuse options that the command does not have: all that begins with ``--``, and a dash with one letter.

    Raises
    ------
    InputError
        There is such a one; the message names the nearest option.
    """
    given = list(arguments[: arguments.index(END_OF_OPTIONS)] if END_OF_OPTIONS in arguments else arguments)
    written = [argument.partition("=")[0] for argument in given if is_option(argument)]
    flags = {*app.help_flags, *app.version_flags}
    if not written or flags & set(given):
        return
    command = app.parse_commands(given)[1][-1]
    if command.default_command is None:  # a group of commands; which of them is meant is not known
        return
    known = [*flags, *option_names(command)]
    for name in written:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.6) if " " not in name else []
            hint = f"did you mean {near[0]}? " if near else ""
            raise InputError(
                f"there is no option {name[:40]}; {hint}Text that begins with a dash goes after {END_OF_OPTIONS}"
            )


def is_option(argument: str) -> bool:
    """Whether an argument can only be an option."""
    return argument.startswith(END_OF_OPTIONS) or _SHORT_OPTION.fullmatch(argument) is not None


def option_names(command: App) -> list[str]:
    """Every option of a command, as it is written."""
    arguments = command.assemble_argument_collection()
    names = [name for argument in arguments for name in (*argument.names, *argument.negatives)]
    return [name for name in names if name.startswith("-")]
