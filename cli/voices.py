"""``tts2face voices``: the list of voices, samples of them, and voices that are added and removed."""

import re
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from cli.flags import switch
from cli.lists import AsJson, languages_text, print_entries
from cli.process import write_message
from cli.progress import progress_bar
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.named_models import Models
from tts2face.storage.output_paths import check_file_name

SAMPLE = "Hello, this is my voice. How does it sound to you? I can read whatever you write."
SAMPLES = {"ja": "こんにちは。これが私の声です。"}  # of voices that speak no English
_NO_LETTERS = re.compile(r"[^\w.-]+|\.onnx$")
Quiet = Annotated[bool, switch("Print no progress bar and no summary.")]
Name = Annotated[str, Parameter(help="Name of the voice.")]
voices = App(name="voices", help="Voices: their list, samples, and those that are added.")


@voices.default
def list_voices(*, as_json: AsJson = False) -> None:
    """List the voices (`--voice`): sex, engine, languages, whether they are installed, and licence."""
    from tts2face.session.catalogue import voices as listed

    entries = listed()
    rows = (
        (
            entry.name,
            entry.sex,
            entry.engine,
            languages_text(entry.languages),
            "yes" if entry.is_installed else "no",
            entry.licence,
            entry.summary,
        )
        for entry in entries
    )
    titles = ("voice", "sex", "engine", "languages", "installed", "licence", "summary")
    print_entries(entries, titles, rows, as_json)


@voices.command
def add(
    name: Annotated[str, Parameter(help="Voice of the package hibari-tts: fenrir, emma, fable or kore.")],
    /,
    *,
    file: Annotated[
        Path | None, Parameter(help="The model's file, without a network; by default it is downloaded.", name="--from")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Add a voice of 8 MB to those that are installed; the network is used for this command alone."""
    from tts2face.sound.hibari_voices import add_voice

    with progress_bar("downloading", quiet or file is not None) as on_progress:
        path = add_voice(name, file, on_progress)
    if not quiet:
        write_message(f"the voice {name} is installed: {path}")


@voices.command
def remove(name: Name, /, *, quiet: Quiet = False) -> None:
    """Remove a voice that was added."""
    from tts2face.sound.hibari_voices import remove_voice

    path = remove_voice(name)
    if not quiet:
        write_message(f"removed {path}")


@voices.command
def sample(
    name: Annotated[str, Parameter(help="Name of the voice, path of a Piper voice, or a server's URL.")],
    /,
    *,
    out: Annotated[Path | None, Parameter(help="Output sound (.wav); by default NAME.wav.", alias="-o")] = None,
    language: Annotated[str | None, Parameter(help="Language of the text; by default the voice's first.")] = None,
    text: Annotated[str | None, Parameter(help="Text to speak, in place of some sentences.")] = None,
    quiet: Quiet = False,
) -> None:
    """Write a sound in which a voice speaks some sentences."""
    from cli.speak import SpeakOptions, run_request
    from tts2face.sound.voice_pool import find_voice, has_voice, require_installed

    if has_voice(name):
        require_installed(name)
        language = language or next(iter(find_voice(name).languages), None)
    language = language or Request(text=".").language
    place = out or Path(_NO_LETTERS.sub("-", name.rpartition("#")[2]).strip("-") + ".wav")
    check_file_name(place, "a sample", (".wav",))
    request = Request(text=text or SAMPLES.get(language, SAMPLE), voice=name, language=language)
    run_request(request, Picture(), SpeakOptions(place, Models(), None, view=False, quiet=quiet).with_export_of_out())
