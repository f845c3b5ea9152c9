"""Options of a batch besides those of speech and picture; a module without heavy imports."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lexicon.errors import BackendError, InputError
from lexicon.marked_text import RATE_LIMITS
from lexicon.values.fields import check_fields
from tts2face.interchange.exports.table import batch_format
from tts2face.interchange.subtitles.film_track import Film
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.option import option
from tts2face.request import Request, option_fields
from tts2face.source_options import AUTO_MARKUP

MOVIE_FORMATS = ("mp4", "webm", "mov", "none")
CLIP_UNITS = ("cue", "scene", "file", "film")
MAX_OVERLAP_S = 2.0  # more is no overlap but two lines at once
EXTEND = "extend"
CUT_PAUSES = "cut-pauses"
REPORT = "report"
OVERFLOW_POLICIES = (EXTEND, CUT_PAUSES, REPORT)


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchOptions:
    """How subtitles become clips.

    Raises
    ------
    InputError
        An option has a value of another type, is unknown or out of range.
    BackendError
        A package of an export format is missing.
    """

    per: str = option("cue", "One clip for each cue, scene or file, or one film of all files.")
    overflow: str = option(
        "extend",
        "For speech that is longer than its cue: extend (half a second into the silence after the cue, then faster, "
        "then further into the silence), cut-pauses (within the speech, then as extend), or report (only say so).",
    )
    max_rate: float = option(1.4, "Largest speaking rate by which speech is fitted to its cue, 1 to 2.")
    min_rate: float = option(
        1.0, "Smallest speaking rate to which speech that is shorter than its cue is slowed, 0.5 to 1."
    )
    max_overlap: float = option(
        0.3, "Seconds by which the last words of a cue may sound on after the next one has begun, 0 to 2."
    )
    scene_gap: float = option(4.0, "Seconds without a cue that divide two scenes.")
    audio: Path | None = option(
        None,
        "Folder of recordings in place of a voice: STEM-0001.wav or STEM/0001.wav for cue 1 of STEM.srt, or STEM.wav "
        "for all of it (any sound or video file).",
    )
    format: str = option(
        "mp4", "Videos: mp4, webm (also transparent), mov (uncompressed sound), or none (only the files of --export)."
    )
    exports: tuple[str, ...] = ()
    encoding: str | None = option(
        None, "Encoding of subtitles that are not UTF-8, such as cp1250; by default guessed, by the language if given."
    )
    keep: tuple[str, ...] = option(
        (),
        "Kinds of what subtitles show and nobody says, to be spoken nevertheless: annotations ([door slams]), lyrics "
        "(between notes), signs (styles such as Sign, placed text), effects, credits, repeats (rolling captions, "
        "layers); several times if wanted.",
    )
    speakers: bool = option(True, "Names before a colon (ANNA: Hello.) are speakers; else they are words.")
    subtitle_fps: float | None = option(
        None, "Frames a second of subtitles whose times are frames (MicroDVD, 00:00:01:12)."
    )
    track: str | None = option(
        None, "Subtitle track of a film (.mp4, .mkv, .mov), by number from 1 or language; or class of a .smi file."
    )
    shift: float = option(0.0, "Seconds that are added to all times of the subtitles, negative for earlier.")

    def __post_init__(self) -> None:
        """Reject values of other types, unknown names and numbers out of range."""
        check_fields(self)
        if self.per not in CLIP_UNITS:
            raise InputError(f"--per must be {', '.join(CLIP_UNITS[:-1])} or {CLIP_UNITS[-1]}, not {self.per!r}")
        self._check_formats()
        self.subtitle_options()
        if self.overflow not in OVERFLOW_POLICIES:
            raise InputError(f"--overflow must be extend, cut-pauses or report, not {self.overflow!r}")
        if not 1.0 <= self.max_rate <= RATE_LIMITS[1]:
            raise InputError(f"--max-rate must lie between 1 and {RATE_LIMITS[1]:g}, not {self.max_rate:g}")
        if not RATE_LIMITS[0] <= self.min_rate <= 1.0:
            raise InputError(f"--min-rate must lie between {RATE_LIMITS[0]:g} and 1, not {self.min_rate:g}")
        if not 0.0 <= self.max_overlap <= MAX_OVERLAP_S:
            raise InputError(f"--max-overlap must lie between 0 and {MAX_OVERLAP_S:g} s, not {self.max_overlap:g}")
        if not 0.0 < self.scene_gap <= 3600.0:
            raise InputError(f"--scene-gap must lie between 0 and 3600 s, not {self.scene_gap:g}")
        if self.audio is not None and not self.audio.is_dir():
            raise InputError(f"there is no folder of recordings {self.audio}; check the path")

    def subtitle_options(
        self, language: str | None = None, film: Film | None = None, request: Request | None = None
    ) -> SubtitleOptions:
        """Choices of the reader of subtitles, with what is known besides: their request, and their film."""
        markup = AUTO_MARKUP if request is None else request.markup
        if self.audio is not None and markup != "ssml":
            markup = "plain"  # a recording cannot follow [pause], which is an annotation there
        return SubtitleOptions(
            language=language,
            keep=self.keep,
            speakers=self.speakers,
            markup=markup,
            text_marks=None if request is None else request.text_marks,
            fps=self.subtitle_fps or (None if film is None else film.fps),
            track=self.track,
            shift=self.shift,
            film_s=None if film is None else film.seconds,
        )

    def _check_formats(self) -> None:
        if self.format not in MOVIE_FORMATS:
            raise InputError(f"--format must be mp4, webm, mov or none, not {self.format!r}")
        if self.format == "none" and not self.exports:
            raise InputError("--format none writes only exports; add --export, or choose another format")
        named = [batch_format(name)[0] for name in self.exports]
        if len(set(named)) < len(named):
            raise InputError("an export format is given twice; remove one of them")
        for suffix, info in map(batch_format, self.exports):
            if not info.is_installed:
                raise BackendError(f"{suffix} needs the package {info.package}; pip install 'tts2face[usd]'")


def non_defaults(options: Any) -> dict[str, Any]:
    """Fields of an option dataclass that differ from their defaults, as JSON values."""
    return {
        option.name: str(value) if isinstance(value, Path) else value
        for option in option_fields(type(options))
        if option.name != "text" and (value := getattr(options, option.name)) != option.default
    }
