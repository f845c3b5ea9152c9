"""The command line: ``tts2face "text" --out clip.mp4`` and the commands beside it."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter

import cli.gestures  # noqa: F401 - adds its command to `corpus`
from cli.corpus import corpus
from cli.exits import exit_code, sentence
from cli.flags import chosen, flags_from
from cli.mimic import mimic
from cli.phones import phones
from cli.report import report
from lexicon.errors import InputError, Tts2faceError
from tts2face import __version__
from tts2face.render.picture import Picture
from tts2face.request import Request

app = App(
    name="tts2face",
    help='Text becomes a talking face: tts2face "Hello there." --out hello.mp4',
    version=__version__,
    help_flags=["--help", "-h"],
    suppress_keyboard_interrupt=False,
)
app.command(phones)
app.command(mimic)
app.command(corpus)
app.command(report)


@app.default
@flags_from(
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
    **options: Any,
) -> None:
    """Turn text into a talking face."""
    from cli.speak import SpeakOptions, run

    if text is not None and said is not None:
        raise InputError("give the text once, with or without --text")
    needs_text = options.get("audio") is None and options.get("idle") is None
    request = chosen(Request, options, text=_text(text if said is None else said, file, is_needed=needs_text))
    speak_options = SpeakOptions(out, talker, face, identity, palette, explain, view, quiet)
    run(request, chosen(Picture, options), speak_options)


def _text(text: str | None, file: Path | None, *, is_needed: bool) -> str:
    if text is None and file is None and not is_needed:
        return ""
    if text is not None and file is not None:
        raise InputError("give the text itself or --file, not both")
    if text is not None and text != "-":
        return text
    if file is not None:
        return _decoded(_bytes_of(file), str(file))
    if text is None and sys.stdin.isatty():
        raise InputError('there is nothing to say; give a text: tts2face "Hello there." --out hello.mp4')
    return _decoded(sys.stdin.buffer.read(), "standard input")


def _bytes_of(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as refused:
        raise InputError(f"cannot read the text from {file}: {refused.strerror}; check the path") from refused


def _decoded(content: bytes, source: str) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as broken:
        raise InputError(f"{source} is not UTF-8 text (byte {broken.start}); save it as UTF-8") from broken


def run(arguments: Sequence[str]) -> int:
    """Exit code of one command line; says in one sentence what was wrong."""
    try:
        app(list(arguments), exit_on_error=False, print_error=False, result_action="return_none")
    except (Tts2faceError, CycloptsError) as refused:
        sys.stderr.write(f"tts2face: {sentence(refused)}\n")
        return exit_code(refused)
    except KeyboardInterrupt:
        sys.stderr.write("\ntts2face: stopped; nothing was written\n")
        return 130
    except BrokenPipeError:
        return 141
    return 0


def main() -> None:
    """Entry point of the ``tts2face`` command."""
    sys.exit(run(sys.argv[1:]))
