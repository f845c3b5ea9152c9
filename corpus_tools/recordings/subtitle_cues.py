"""Subtitles of videos as cues with margins."""

from collections.abc import Sequence
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.subtitles.cues import Cue, Subtitles, without_options
from tts2face.interchange.subtitles.film_track import Film, film_facts
from tts2face.interchange.subtitles.formats import FILM_SUFFIXES
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.interchange.subtitles.reader import read_subtitles
from tts2face.interchange.transcripts.beside import SUBTITLE_SUFFIXES
from tts2face.interchange.transcripts.reader import TEXT_SUFFIX
from tts2face.interchange.transcripts.spoken import SpokenCue
from tts2face.interchange.transcripts.written_words import is_subtitle_file, subtitle_notes_of

OTHER_FILM_SUFFIXES = (".avi", ".mpg", ".mpeg", ".ts")  # beside which subtitles lie
MAX_JOINED_S = 1.0  # between a word without a length and the next one
CUE_MARGIN_S = 0.3  # before and after a cue; subtitles are rarely closer to the speech


def find_subtitles(video: Path) -> Path | None:
    """The subtitle file of a video, also a text that holds subtitles, or None."""
    named = (*((suffix, True) for suffix in SUBTITLE_SUFFIXES), (TEXT_SUFFIX, False), (TEXT_SUFFIX.upper(), False))
    return next(
        (
            path
            for suffix, is_sure in named
            if (path := video.with_suffix(suffix)).is_file() and (is_sure or is_subtitle_file(path))
        ),
        None,
    )


def read_cues(path: Path) -> tuple[SpokenCue, ...]:
    """Spoken cues in temporal order, each extended by `CUE_MARGIN_S` but not beyond the middle to its neighbour.

    Cues without words and cues whose end is only estimated are left out; words without a length, as recognisers of
    speech write them, belong to the cue after them.
    """
    spoken = _joined(read_beside(path).cues)
    if not spoken:
        raise DataError(f"{path} contains no subtitles; export them again")
    cues = []
    for number, (start, end, text) in enumerate(spoken):
        before = spoken[number - 1][1] if number else 0.0
        behind = spoken[number + 1][0] if number + 1 < len(spoken) else end + 2 * CUE_MARGIN_S
        earliest, latest = min((before + start) / 2, start), max((end + behind) / 2, end)
        cues.append(SpokenCue(max(start - CUE_MARGIN_S, earliest, 0.0), min(end + CUE_MARGIN_S, latest), text))
    return tuple(cues)


def read_beside(path: Path) -> Subtitles:
    """Subtitles of the video of the same name, which gives its length and its frames a second."""
    film = next((film_facts(video) for suffix in (*FILM_SUFFIXES, *OTHER_FILM_SUFFIXES)
                 if (video := path.with_suffix(suffix)).is_file()), Film())  # fmt: skip
    return read_subtitles(path, options=SubtitleOptions(fps=film.fps, film_s=film.seconds))


def subtitle_notes(video: Path, *, has_track: bool = False) -> tuple[str, ...]:
    """Guesses and defects of the subtitles of a video, and what of them is not spoken; none without subtitles.

    With `has_track` they are a track of the video itself, where none lie beside it.
    """
    path = find_subtitles(video) or (video if has_track else None)
    if path is None:
        return ()
    try:
        read = read_beside(path)
    except DataError as wrong:
        return (f"{without_options(str(wrong))}; the subtitles are not used",)
    stated = (f"the subtitles of {video.name} are those of its own track",) if path == video else ()
    return (*stated, *subtitle_notes_of(read))


def _joined(cues: Sequence[Cue]) -> list[tuple[float, float, str]]:
    """Start, end and text of cues that have them; what has no length comes to the next cue."""
    spoken: list[tuple[float, float, str]] = []
    waiting: list[Cue] = []
    for cue in cues:
        if not cue.text:
            continue
        waiting = [earlier for earlier in waiting if cue.begin_s - earlier.begin_s <= MAX_JOINED_S]
        if cue.has_estimated_end:
            waiting.append(cue)
            continue
        start = min(cue.begin_s, *(earlier.begin_s for earlier in waiting)) if waiting else cue.begin_s
        spoken.append((start, cue.end_s, " ".join(part.text for part in (*waiting, cue))))
        waiting = []
    return spoken
