"""The command line: ``tts2face "text" --out clip.mp4`` and the other commands."""

import gc
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, CycloptsError, Parameter

from cli.flags import (
    Exports,
    Face,
    Hair,
    HairColor,
    Out,
    Palette,
    Person,
    Sign,
    Talker,
    TimeStamp,
    add_option_flags,
    check_options,
    join_values,
    open_signer,
    options_from_flags,
    switch,
)
from cli.lists import LISTS
from cli.photo import (
    Consent,
    Fit,
    Photo,
    Smile,
    Yes,
    check_photo,
    face_of_photo,
    is_missing_model,
    refuse_beside,
    refuse_without,
    sets_up_model,
)
from cli.process import (
    BROKEN_PIPE_CODE,
    FIRST_BYTES,
    INTERRUPTED,
    INTERRUPTION,
    LARGE_BYTES,
    UNCHANGED,
    WhatRemains,
    discard_output,
    error_message,
    exit_code,
    release_frames,
    repair_streams,
    return_large_blocks,
    signal_exit_code,
    use_one_thread_of_blas,
    write_message,
)
from cli.render import convert, render
from cli.tool_flags import Tier
from cli.transcript import TextFile, note_transcript_beside
from lexicon.errors import BackendError, DataError, InputError, Tts2faceError
from lexicon.values.files import LARGEST_TEXT_BYTES, decode_utf8, read_bounded
from tts2face import __version__
from tts2face.picture.options import Picture
from tts2face.processes.collection import pause_collection
from tts2face.request import GESTURES, FromPhones, Recorded, Request
from tts2face.session.named_models import Models
from tts2face.storage.temporary import remove_held

MAKE_CLIPS = (["batch"], ["mimic"], ["render"])  # as a text does
Shell = Literal["bash", "zsh", "fish", "powershell"]
app = App(
    name="tts2face",
    help='Text to talking face: tts2face "Hello there." --out hello.mp4',
    version=__version__,
    help_flags=["--help", "-h"],
    help_format="plaintext",  # Markdown costs a fifth of the time that --help takes
    suppress_keyboard_interrupt=False,
)
app.command("cli.mimic:mimic")
app.command(convert)
app.command(render)
app.command("cli.batch:batch")
app.command("cli.jobs:worker")
app.command("cli.jobs:jobs")
app.command("cli.live:live")
app.command("cli.serve:serve")
app.command("cli.serve:keys")
app.command("cli.corpus:corpus")
app.command("cli.report:report")
app.command("cli.face:face")
app.command("cli.inspect:inspect")
app.command("cli.voices:voices")
for list_command in LISTS:
    app.command(list_command)


@app.command
def phones(
    text: Annotated[str, Parameter(help="Text to transcribe.")],
    /,
    *,
    format: Annotated[Literal["text", "json", "textgrid"], Parameter(help="Output format.")] = "text",
    language: Annotated[
        str, Parameter(help="Language of the text: a code, a BCP 47 tag or an English name.")
    ] = "en-us",
    markup: Annotated[Literal["auto", "plain", "ssml", "llm"], Parameter(help="How the text is read.")] = "auto",
    dictionary: Annotated[
        Path | None, Parameter(help="File of pronunciations that take precedence over the built-in ones.")
    ] = None,
) -> None:
    """Print the words of a text and their phones, in ARPABET and IPA, with stress and syllables."""
    from lexicon.dictionary import read_dictionary
    from lexicon.spoken_words import pronounce_marked
    from lexicon.text_marks import parse_marks
    from tts2face.interchange.exports.pronunciation import FORMATS

    pronunciation = pronounce_marked(
        parse_marks(text, language, markup), language, read_dictionary(dictionary) if dictionary else None
    )
    print(FORMATS[format](pronunciation), end="")  # noqa: T201 - the result


@app.command
def completion(shell: Annotated[Shell, Parameter(help="Shell that runs the script.")], /) -> None:
    """Print a script that completes commands and options in a shell."""
    print(app.generate_completion(shell=shell))  # noqa: T201 - the result


@app.default
@add_option_flags(("Speech and motion", Request), ("Picture", Picture), without=frozenset({"text"}))
def speak(  # noqa: PLR0913 - one parameter a flag
    text: Annotated[
        str | None,
        Parameter(help="Text to speak; by default read from --file or standard input.", allow_leading_hyphen=True),
    ] = None,
    /,
    *,
    out: Out = None,
    export: Exports = None,
    file: Annotated[
        Path | None,
        Parameter(
            help="Read the text from a UTF-8 file, or the words of a TextGrid, a table of labels or subtitles.",
            name=["--file", "--transcript"],
        ),
    ] = None,
    tier: Tier = None,
    text_option: Annotated[
        str | None, Parameter(help="The text as an option, for example the words of --audio.", name="--text")
    ] = None,
    talker: Talker = "grid_s1",
    face: Face = None,
    identity: Annotated[str | None, Parameter(help="Preset of the face's age, sex and ancestry.")] = None,
    hair: Hair = None,
    hair_color: HairColor = None,
    person: Person = None,
    photo: Photo = None,
    consent: Consent = None,
    fit: Fit = None,
    smile: Smile = None,
    yes: Yes = False,
    palette: Palette = "starter",
    explain: Annotated[
        Path | None, Parameter(help="Write the recorded phones used for each phone (.json or .txt).")
    ] = None,
    view: Annotated[bool, switch("Show the head in a window (extra [view]).")] = False,
    sign: Sign = None,
    time_stamp: TimeStamp = None,
    quiet: Annotated[bool, switch("Print no progress bar and no summary.")] = False,
    noise: Annotated[bool, switch("Short for --gestures noise.")] = False,
    no_gestures: Annotated[bool, switch("Short for --gestures none.")] = False,
    **options: Any,
) -> None:
    """Synthesise a talking face from text."""
    if text is not None and text_option is not None:
        raise InputError("the text is given twice, as an argument and as --text; remove one of them")
    options["gestures"] = _gesture_method(options.get("gestures"), noise=noise, none=no_gestures)
    needs_text = all(options.get(name) is None for name in ("audio", "idle", "listen"))
    files = {"--fit": fit, "--smile": smile}
    if photo is None:
        refuse_without({"--consent": consent, **files})
    else:
        refuse_beside({"--face": face, "--identity": identity, "--hair": hair, "--hair-color": hair_color})
    picture = options_from_flags(Picture, options)
    if photo is not None:  # before a text is read: a command that has to set up the landmark model is run again
        check_photo(photo, files, {"--out": out, "--explain": explain, **{path: path for path in export or ()}})
        face = face_of_photo(photo, consent, fit=fit, smile=smile, quiet=quiet)
    # a wrong option is refused before the modules of a session are loaded
    from cli.speak import SpeakOptions, run_request

    words = None if file is None else TextFile(file, tier, quiet)
    if tier is not None and file is None:
        raise InputError("--tier belongs to a file of words; give it with --file, or remove --tier")
    request = options_from_flags(
        Request, options, text=_read_text(text if text_option is None else text_option, words, is_needed=needs_text)
    )
    match request.source:
        case Recorded(audio=audio, lips=FromPhones(text="")) if not quiet:
            note_transcript_beside(audio)
    speak_options = SpeakOptions(
        out,
        Models(talker, face or "", identity, palette, hair, hair_color, person),
        explain,
        view,
        quiet,
        file,
        tuple(export or ()),
        signer=open_signer(sign, time_stamp, quiet=quiet),
    ).with_export_of_out()
    run_request(request, picture, speak_options)


def _gesture_method(method: str | None, *, noise: bool, none: bool) -> str:
    """Gesture method selected by --gestures or one of its two short forms."""
    flags = {"--gestures " + (method or ""): method, "--noise": "noise" if noise else None}
    flags["--no-gestures"] = "none" if none else None
    used = {flag: value for flag, value in flags.items() if value is not None}
    if len(set(used.values())) > 1:
        first, second, *_ = used
        raise InputError(f"{first} cannot be combined with {second}; remove one of them")
    return next(iter(used.values()), GESTURES[0])


def _read_text(text: str | None, file: TextFile | None, *, is_needed: bool) -> str:
    if text is None and file is None and not is_needed:
        return ""
    if text is not None and file is not None:
        raise InputError("--file cannot be combined with a text on the command line; remove one of them")
    # "-" is standard input, by custom
    if text is not None and text != "-":
        return text
    try:
        if file is not None:
            return file.read()
        if text is None and sys.stdin.isatty():
            raise InputError('there is no text to speak; add one: tts2face "Hello there." --out hello.mp4')
        source = "standard input"
        return decode_utf8(read_bounded(sys.stdin.buffer, source, LARGEST_TEXT_BYTES), source)
    except OSError as refused:
        raise InputError(
            f"cannot read the text from {file and file.path}: {refused.strerror}; check the path"
        ) from refused
    except DataError as wrong:  # the text is part of the request
        raise InputError(str(wrong)) from wrong


def _call(arguments: Sequence[str]) -> None:
    check_options(app, arguments)
    arguments = join_values(app, arguments)
    _, called, _ = app.parse_commands(list(arguments))
    if called[-1].default_command is None or {*app.help_flags} & {*arguments}:
        for group in called:
            group.resolved_commands()  # a page of help has only what loaded commands say of themselves
    app(list(arguments), exit_on_error=False, print_error=False, result_action="return_none")
    sys.stdout.flush()


def run(arguments: Sequence[str]) -> int:
    """Run a command line; its exit code. An error is reported on one line of standard error."""
    try:
        try:
            _call(arguments)
        except BackendError as missing:
            if not is_missing_model(missing) or not sets_up_model(arguments):
                raise
            _call(arguments)
    except BaseException as ended:
        INTERRUPTION.end()
        release_frames(ended)
        if INTERRUPTION.number or isinstance(ended, KeyboardInterrupt):  # whatever the interruption has led to
            notes = [note for note in getattr(ended, "__notes__", ()) if isinstance(note, WhatRemains)]
            what_remains = "; ".join(notes) or UNCHANGED
            write_message(f"\n{INTERRUPTED.format(what_remains)}")
            return signal_exit_code(ended)
        if isinstance(ended, BrokenPipeError):
            discard_output()
            return BROKEN_PIPE_CODE
        # any other error is a bug, whose traceback is shown
        if isinstance(ended, (Tts2faceError, CycloptsError, OSError)):
            # no path: standard output, whose rest would fail again at the exit
            if isinstance(ended, OSError) and ended.filename is None:
                discard_output()
            write_message(f"tts2face: {error_message(ended)}")
            return exit_code(ended)
        raise
    INTERRUPTION.end()
    return 0


def main() -> None:
    """Entry point of the ``tts2face`` command."""
    repair_streams()
    INTERRUPTION.install()
    makes_clip = bool(sys.argv[1:2]) and sys.argv[1] not in {*app}  # a text or an option, which `speak` gets
    return_large_blocks(FIRST_BYTES if makes_clip else LARGE_BYTES)
    if makes_clip or sys.argv[1:2] in (*MAKE_CLIPS, ["live"]):
        use_one_thread_of_blas()
    if makes_clip or sys.argv[1:2] in (["live"], ["serve"]):  # all resume it
        pause_collection()
    code = run(sys.argv[1:])
    if INTERRUPTION.number:
        remove_held()  # what no context had taken over when the signal came
    gc.freeze()  # the last search for garbage takes a third of a second, and the system frees all memory anyway
    sys.exit(code)
