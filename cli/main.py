"""The command line: ``tts2face "text" --out clip.mp4`` and the commands beside it."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter

import cli.gestures  # noqa: F401 - adds its command to `corpus`
from cli.completion import add_completion
from cli.corpus import corpus
from cli.exits import error_message, exit_code
from cli.flags import add_option_flags, options_from_flags
from cli.lists import LISTS
from cli.memory import return_large_blocks
from cli.mimic import mimic
from cli.options import check_options
from cli.phones import phones
from cli.report import report
from cli.stopping import raise_on_signals, stop_code
from cli.streams import discard_output, repair_streams, write_error
from lexicon.errors import DataError, InputError, Tts2faceError
from lexicon.inputs import LARGEST_TEXT_BYTES, decoded, read_bounded, read_text
from tts2face import __version__
from tts2face.render.picture import Picture
from tts2face.request import GESTURES, Request

app = App(
    name="tts2face",
    help='Text becomes a talking face: tts2face "Hello there." --out hello.mp4',
    version=__version__,
    help_flags=["--help", "-h"],
    help_format="plaintext",  # Markdown costs a fifth of the time that --help takes
    suppress_keyboard_interrupt=False,
)
app.command(phones)
app.command(mimic)
app.command(corpus)
app.command(report)
for listed in LISTS:
    app.command(listed)
add_completion(app)


@app.default
@add_option_flags(
    ("What is said and how the face moves", Request), ("How it is drawn", Picture), without=frozenset({"text"})
)  # fmt: skip
def speak(  # noqa: PLR0913 - one parameter a flag
    text: Annotated[
        str | None, Parameter(help="What to say; without it, --file or standard input.", allow_leading_hyphen=True)
    ] = None,
    /,
    *,
    out: Annotated[
        Path | None, Parameter(help="The clip: .mp4, .webm, .gif, or a folder for .png files.", alias="-o")
    ] = None,
    file: Annotated[
        Path | None, Parameter(help="Read the text from a UTF-8 file.", name=["--file", "--transcript"])
    ] = None,
    said: Annotated[str | None, Parameter(help="The text as an option: what --audio says.", name="--text")] = None,
    talker: Annotated[str, Parameter(help="Whose lips move: a shipped talker or a .talker file.")] = "grid_s1",
    face: Annotated[
        str, Parameter(help="What is shown: head, cartoon, a .face file, or self (the talker's own).")
    ] = "head",
    identity: Annotated[str | None, Parameter(help="A preset of the face's age, sex and ancestry.")] = None,
    palette: Annotated[
        str, Parameter(help="The styles of the gestures: a shipped palette, or a .palette file.")
    ] = "starter",
    explain: Annotated[
        Path | None, Parameter(help="Write, for each phone, which recorded phones were used (.json or .txt).")
    ] = None,
    view: Annotated[bool, Parameter(help="Show the head in a window (extra [view]).", negative="")] = False,
    quiet: Annotated[bool, Parameter(help="No progress bar and no last line.", negative="")] = False,
    noise: Annotated[bool, Parameter(help="Short for --gestures noise.", negative="")] = False,
    no_gestures: Annotated[bool, Parameter(help="Short for --gestures none.", negative="")] = False,
    **options: Any,
) -> None:
    """Turn text into a talking face."""
    if text is not None and said is not None:
        raise InputError("give the text once, with or without --text")
    options["gestures"] = _gestures(options.get("gestures"), noise=noise, none=no_gestures)
    needs_text = options.get("audio") is None and options.get("idle") is None
    from cli.speak import SpeakOptions, run_request

    request = options_from_flags(
        Request, options, text=_read_text(text if said is None else said, file, is_needed=needs_text)
    )
    speak_options = SpeakOptions(out, talker, face, identity, palette, explain, view, quiet, file)
    run_request(request, options_from_flags(Picture, options), speak_options)


def _gestures(method: str | None, *, noise: bool, none: bool) -> str:
    """The method of gestures from the flag and its two short forms."""
    flags = {"--gestures " + (method or ""): method, "--noise": "noise" if noise else None}
    flags["--no-gestures"] = "none" if none else None
    given = {flag: value for flag, value in flags.items() if value is not None}
    if len(set(given.values())) > 1:
        first, second, *_ = given
        raise InputError(f"{first} cannot be combined with {second}; remove one of them")
    return next(iter(given.values()), GESTURES[0])


def _read_text(text: str | None, file: Path | None, *, is_needed: bool) -> str:
    if text is None and file is None and not is_needed:
        return ""
    if text is not None and file is not None:
        raise InputError("give the text itself or --file, not both")
    if text is not None and text != "-":
        return text
    try:
        if file is not None:
            return read_text(file)
        if text is None and sys.stdin.isatty():
            raise InputError('there is nothing to say; give a text: tts2face "Hello there." --out hello.mp4')
        source = "standard input"
        return decoded(read_bounded(sys.stdin.buffer, source, LARGEST_TEXT_BYTES), source)
    except OSError as refused:
        raise InputError(f"cannot read the text from {file}: {refused.strerror}; check the path") from refused
    except DataError as wrong:  # the text is the request itself
        raise InputError(str(wrong)) from wrong


def run(arguments: Sequence[str]) -> int:
    """Exit code of one command line; says in one sentence what was wrong."""
    try:
        check_options(app, arguments)
        app(list(arguments), exit_on_error=False, print_error=False, result_action="return_none")
        sys.stdout.flush()
    except BrokenPipeError:
        discard_output()
        return 141
    except (Tts2faceError, CycloptsError, OSError) as refused:
        if isinstance(refused, OSError) and refused.filename is None:
            discard_output()
        write_error(f"tts2face: {error_message(refused)}")
        return exit_code(refused)
    except KeyboardInterrupt as stopped:
        write_error("\ntts2face: stopped; nothing was written")
        return stop_code(stopped)
    return 0


def main() -> None:
    """Entry point of the ``tts2face`` command."""
    repair_streams()
    raise_on_signals()
    return_large_blocks()
    sys.exit(run(sys.argv[1:]))
