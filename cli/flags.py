"""Flags made from the fields of option dataclasses, and the check for unknown options."""

import difflib
import inspect
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import App, Group, Parameter

from cli.process import write_message
from lexicon.errors import InputError
from tts2face.request import option_fields
from tts2face.storage.signing import PASSWORD, Credentials

if TYPE_CHECKING:
    from cyclopts import Token

    from tts2face.storage.signing import Signer

Number = TypeVar("Number", int, float)
END_OF_OPTIONS = "--"  # everything after it is text or a path
Out = Annotated[
    Path | None,
    Parameter(
        help="Output clip: .mp4, .webm, .mov, .gif, a folder for .png files, or an export format without a video.",
        alias="-o",
    ),
]
Talker = Annotated[str, Parameter(help="Talker whose articulation is used: a shipped talker or a .talker file.")]
Palette = Annotated[str, Parameter(help="Palette of gesture styles: a shipped palette or a .palette file.")]
Face = Annotated[
    str | None,
    Parameter(
        help="Face: one of `tts2face faces`, a .face file, or self for the talker's own face; by default ada, or head "
        "where an identity or one of head's haircuts is chosen."
    ),
]
Hair = Annotated[str | None, Parameter(help="Haircut: one of `tts2face haircuts` for the face, or a .hair file.")]
HairColor = Annotated[str | None, Parameter(help="Hair colour: one of `tts2face hair-colors`, or #rrggbb.")]
Person = Annotated[
    str | None,
    Parameter(
        help="Sex and age of the person shown, to whom the voice is fitted: woman, man 70, girl; by default what is "
        "known of the face."
    ),
]
Exports = Annotated[
    list[str] | None,
    Parameter(
        help="File for another program, by suffix (`tts2face formats`) or as FORMAT:PATH; beside --out or alone, "
        "several times if wanted.",
        negative="",
    ),
]
Sign = Annotated[
    tuple[Path, Path] | None,
    Parameter(
        help="Sign the files (C2PA, extra [c2pa]) with this certificate and its key, both PEM; the password of an "
        f"encrypted key stands in {PASSWORD}."
    ),
]
TimeStamp = Annotated[
    str | None, Parameter(help="With --sign: address of a time-stamp authority, which confirms the time of signing.")
]
_SHORT_OPTION = re.compile(r"-[A-Za-z]")
Cache = Annotated[Path | None, Parameter(help="Folder for intermediate results; by default the user's cache folder.")]
Model = Annotated[Path | None, Parameter(help="Path of face_landmarker.task; by default found or set up.")]


def switch(help_text: str) -> Parameter:
    """A flag without a value and without a negative form."""
    return Parameter(help=help_text, negative="")


def whole_number(help_text: str) -> Parameter:
    """A flag with a whole number."""
    return Parameter(help=help_text, converter=parse_whole_number)


def parse_whole_number(_: Any, tokens: "Sequence[Token]") -> int:
    """Value of an integer flag; cyclopts itself rounds 2.5 to 2."""
    try:
        return int(tokens[0].value)
    except ValueError as wrong:
        raise ValueError(f'"{tokens[0].value}" is not a whole number') from wrong


Jobs = Annotated[int | None, whole_number("Number of processes; by default one per core.")]


def parse_numbers(flag: str, given: str, kind: Callable[[str], Number], expected: str) -> tuple[Number, ...]:
    """Numbers of a flag that are separated by commas; an `InputError` says what is expected of it."""
    try:
        return tuple(kind(number) for number in given.split(","))
    except ValueError as wrong:
        raise InputError(f"{flag} must be {expected}, not {given!r}") from wrong


def add_option_flags(
    *groups: tuple[str, type], without: frozenset[str] = frozenset(), has_defaults: bool = True
) -> Callable[..., Any]:
    """Give a command one keyword flag for each field of the option dataclasses, under a heading for each class.

    The command takes them as ``**options``; `options_from_flags` turns them back into an instance. Without
    `has_defaults`, those that are not given are None.
    """
    headed = [(Group.create_ordered(heading), options) for heading, options in groups]

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        own = [
            parameter
            for parameter in inspect.signature(command).parameters.values()
            if parameter.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        added = [
            _option_parameter(option, option.type, heading, has_defaults=has_defaults)
            for heading, options in headed
            for option in option_fields(options)
            if option.name not in without
        ]
        # cyclopts reads the flags of a command from both
        command.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
        command.__annotations__ = {parameter.name: parameter.annotation for parameter in [*own, *added]}
        return command

    return decorate


def _option_parameter(option: "Field[Any]", kind: Any, group: Group, *, has_defaults: bool) -> inspect.Parameter:
    default = inspect.Parameter.empty if option.default is MISSING else option.default
    converter = parse_whole_number if kind in (int, int | None) else None
    # only a switch that is on by default needs one
    negative = f"--no-{option.name.replace('_', '-')}" if default is True else ""
    if not has_defaults:
        kind, default = kind | None, None
    annotation = Annotated[
        kind, Parameter(help=option.metadata["help"], group=group, negative=negative, converter=converter)
    ]
    return inspect.Parameter(option.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def options_from_flags(options: type, flags: dict[str, Any], **more: Any) -> Any:
    """An instance of an option dataclass from the flags that belong to it."""
    names = {option.name for option in option_fields(options)}
    return options(**{name: value for name, value in flags.items() if name in names}, **more)


def check_options(app: App, arguments: Sequence[str]) -> None:
    """Refuse unknown options: arguments that begin with ``--``, and a hyphen with one letter.

    Raises
    ------
    InputError
        The command has no such option; the message names the closest one.
    """
    before_end = list(arguments[: arguments.index(END_OF_OPTIONS)] if END_OF_OPTIONS in arguments else arguments)
    names = [argument.partition("=")[0] for argument in before_end if is_option(argument)]
    flags = {*app.help_flags, *app.version_flags}
    # --help and --version answer whatever stands beside them
    if not names or flags & set(before_end):
        return
    command = app.parse_commands(before_end)[1][-1]
    if command.default_command is None:  # a group of commands, without the command itself
        return
    known = [*flags, *option_names(command)]
    for name in names:
        if name not in known:
            # a name with a space is a text that begins with a hyphen
            close = difflib.get_close_matches(name, known, n=1, cutoff=0.6) if " " not in name else []
            hint = f"did you mean {close[0]}? " if close else ""
            raise InputError(
                f"there is no option {name[:40]}; {hint}Put text that begins with a hyphen after {END_OF_OPTIONS}"
            )


def sign_credentials(sign: tuple[Path, Path] | None, time_stamp: str | None) -> Credentials | None:
    """Files with which a command signs; None where it does not."""
    if sign is None:
        if time_stamp is not None:
            raise InputError("--time-stamp belongs to a signature; add --sign CERTIFICATE KEY, or remove it")
        return None
    certificate, key = (path.absolute() for path in sign)
    return Credentials(certificate, key, os.environ.get(PASSWORD, ""), time_stamp or "")


def open_signer(sign: tuple[Path, Path] | None, time_stamp: str | None, *, quiet: bool) -> "Signer | None":
    """Who signs the files of a command, after a note on what happens when the certificate ends; None for nobody."""
    credentials = sign_credentials(sign, time_stamp)
    if credentials is None:
        return None
    signer = credentials.open()
    if signer.note and not quiet:
        write_message(f"tts2face: note: {signer.note}")
    return signer


def join_values(app: App, arguments: Sequence[str]) -> list[str]:
    """Arguments in which a value that begins with a hyphen, such as -60,20,400, is joined to its option by ``=``."""
    end = arguments.index(END_OF_OPTIONS) if END_OF_OPTIONS in arguments else len(arguments)
    joined, names = list(arguments[:1]), None
    for at in range(1, len(arguments)):
        option, value = arguments[at - 1], arguments[at]
        # a hyphen alone is standard input
        if at < end and value[:1] == "-" != value and not is_option(value) and is_option(option):
            names = _options_with_values(app, arguments[:end]) if names is None else names
            if option in names:
                joined[-1] = f"{option}={value}"
                continue
        joined.append(value)
    return joined


def _options_with_values(app: App, arguments: Sequence[str]) -> set[str]:
    command = app.parse_commands(list(arguments))[1][-1]
    if command.default_command is None:
        return set()
    takes_value = [argument for argument in command.assemble_argument_collection() if argument.token_count()[0]]
    return {name for argument in takes_value for name in argument.names if not name.startswith("--empty-")}


def is_option(argument: str) -> bool:
    """Whether an argument has the form of an option."""
    return argument.startswith(END_OF_OPTIONS) or _SHORT_OPTION.fullmatch(argument) is not None


def option_names(command: App) -> list[str]:
    """All options of a command as they are written on the command line."""
    arguments = command.assemble_argument_collection()
    names = [name for argument in arguments for name in (*argument.names, *argument.negatives)]
    return [name for name in names if name.startswith("-")]
