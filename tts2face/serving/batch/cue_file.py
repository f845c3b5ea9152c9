"""The subtitle file of a plan, read with the options of its batch, and the film of which it is known."""

from dataclasses import replace
from pathlib import Path

from tts2face.interchange.subtitles.cues import Cue, Subtitles
from tts2face.interchange.subtitles.film_track import film_facts
from tts2face.interchange.subtitles.reader import read_subtitles
from tts2face.request import Request
from tts2face.serving.batch.options import BatchOptions, non_defaults


def read_cue_file(path: Path, options: BatchOptions, request: Request, track: Path | None) -> Subtitles:
    """Cues of a file; a recording of the whole file (`track`) gives the length of the film and its frames a second."""
    film = None if track is None else film_facts(track)
    # the default language says nothing about a file
    choices = options.subtitle_options(non_defaults(request).get("language"), film, request)
    return read_subtitles(path, options.encoding, choices)


def left_out_cues(subtitles: Subtitles) -> list[Cue]:
    """Cues that nobody says, with the text that is shown: a role or the table of lines may ask for them."""
    return [replace(cue, text=cue.shown) for cue in subtitles.cues if cue.kind and any(map(str.isalnum, cue.shown))]
