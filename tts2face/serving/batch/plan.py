"""The plan of a batch: which outputs are made of which segments.

Recordings in a folder: one for each cue, or one for a whole subtitle file, found by name.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from tts2face.interchange.exports.table import batch_format
from tts2face.interchange.subtitles.cues import Cue, Subtitles, SubtitleWarning
from tts2face.interchange.subtitles.reader import read_subtitles
from tts2face.picture.options import Picture
from tts2face.request import DRAWN_FACE, IDLE_LIMITS_S, Request
from tts2face.serving.batch.cast import MODEL_NAMES, REQUEST_NAMES, Cast, check_names
from tts2face.serving.batch.export import check_faces
from tts2face.serving.batch.options import BatchOptions, non_defaults
from tts2face.serving.batch.output import Output, Plan, PlannedCue, PlanWarning, Sound, join_outputs, output_names
from tts2face.serving.batch.segment import ALPHA_MOVIE, MOVIE, Segment, file_hash
from tts2face.serving.batch.windows import Window, cue_windows, scenes
from tts2face.session.named_models import Models
from tts2face.session.prepared import prepare
from tts2face.types import SOUND_RATE, exact_rate, first_sample

SOUND_SUFFIXES = frozenset({".wav", ".flac", ".mp3", ".m4a", ".ogg", ".opus", ".aac", ".aif", ".aiff", ".mp4", ".mov",
                            ".mkv", ".webm"})  # fmt: skip
_NUMBERED = re.compile(r"(?:(?P<name>.*)[-_ .])?0*(?P<number>\d{1,9})")


@dataclass(frozen=True, slots=True)
class Recordings:
    """Recordings of one subtitle file: `track` is one of the whole file, else `cues` are those of cues by number."""

    track: Path | None = None
    cues: Mapping[int, Path] = field(default_factory=dict)


def find_recordings(folder: Path, subtitles: Path, names: Sequence[str]) -> Recordings:
    """Recordings of a subtitle file.

    Parameters
    ----------
    names
        Names under which its recordings may be stored, the best one first; the empty name is that of files that are
        only a number.

    Raises
    ------
    InputError
        Several recordings of the whole file, or recordings of the file and of its cues.
    """
    files = [path for path in sorted(folder.rglob("*")) if path.suffix.lower() in SOUND_SUFFIXES]
    named = {name.lower() for name in names if name}
    tracks = [path for path in files if path.stem.lower() in named]
    beside = [path for path in tracks if path.parent.name == subtitles.resolve().parent.name]
    tracks = beside if len(tracks) > 1 and beside else tracks
    if len(tracks) > 1:
        raise InputError(f"{tracks[0]} and {tracks[1]} are both recordings of {subtitles}; keep one of them")
    found: dict[str, Path] = {}
    for path in files:
        match = _NUMBERED.fullmatch(path.stem)
        if match is not None and path not in tracks:
            name = match["name"] or ("" if path.parent == folder else path.parent.name)
            found.setdefault(f"{name.lower()}/{int(match['number'])}", path)
    cues: dict[int, Path] = {}
    for name in names:
        prefix = f"{name.lower()}/"
        for key, path in found.items():
            if key.startswith(prefix):
                cues.setdefault(int(key.removeprefix(prefix)), path)
    if tracks and cues:
        raise InputError(
            f"{tracks[0]} is a recording of the whole of {subtitles}, and {min(cues.values())} one of a cue; keep one "
            "kind"
        )
    return Recordings(tracks[0] if tracks else None, cues)


MAX_IDLE_S = 20.0  # of one segment of silence
MARGIN_S = 0.5  # around a cue, for speech of a dubbing track that begins early or ends late; half of shorter gaps
NOT_WHEN_SILENT = ("text", "audio", "audio_map", "voice", "rate", "volume", "plain_delivery", "lead", "dictionary",
                   "language")  # fmt: skip
NOT_WITH_AUDIO = ("voice", "rate", "plain_delivery", "lead")


def plan_batch(
    files: Sequence[Path],
    options: BatchOptions,
    *,
    request: Request | None = None,
    picture: Picture | None = None,
    models: Models | None = None,
    cast: Cast | None = None,
) -> Plan:
    """Plan the clips of subtitle files; nothing is loaded or rendered.

    Parameters
    ----------
    request, picture, models
        Settings of all cues; those of the cast take precedence.

    Raises
    ------
    InputError
        There is no file, an option is invalid, or a model does not exist.
    DataError
        A subtitle file has no cue or cannot be read.
    """
    if not files:
        raise InputError("there are no subtitles; give .srt, .vtt, .ass, .ssa or .ttml files")
    if picture is not None and picture.is_transparent and options.format in ("mp4", "mov"):
        raise InputError(f".{options.format} has no transparency; choose --format webm, or another background")
    base = _Base(
        options,
        request or Request(),
        non_defaults(picture or Picture()),
        models or Models(),
        cast or Cast(),
        len(files),
    )
    planned = [_FilePlan(base, path, name) for path, name in zip(files, output_names(files), strict=True)]
    outputs = [output for one in planned for output in one.outputs()]
    if options.per == "film" and outputs:
        outputs = [join_outputs("film", outputs)]
        check_faces(outputs[0])
    warnings = [warning for one in planned for warning in one.warnings]
    warnings += [PlanWarning("the cast", 0, text) for text in base.cast.unused(base.used)]
    n_cues, n_silent = sum(one.n_cues for one in planned), sum(one.n_silent for one in planned)
    return Plan(tuple(outputs), tuple(warnings), n_cues, n_silent)


@dataclass(frozen=True, slots=True)
class _Base:
    """Settings of all files."""

    options: BatchOptions
    request: Request
    picture: Mapping[str, Any]
    models: Models
    cast: Cast
    n_files: int
    used: set[int] = field(default_factory=set)  # roles of the cast


@dataclass(slots=True)
class _FilePlan:
    """Plan of one subtitle file."""

    base: _Base
    path: Path
    name: str
    warnings: list[PlanWarning] = field(default_factory=list)
    recordings: Recordings = field(default_factory=Recordings)
    n_cues: int = 0
    n_silent: int = 0
    _hashes: dict[str, Mapping[str, str]] = field(default_factory=dict)

    def outputs(self) -> Iterator[Output]:
        """Outputs of the file."""
        read = read_subtitles(self.path, self.base.options.encoding)
        self._add_warnings(read)
        spoken = [cue for cue in read.cues if cue.text]
        self.n_cues, self.n_silent = len(read.cues), len(read.cues) - len(spoken)
        if not spoken:
            self._warn(1, "no cue has words; there is no clip of this file")
            return
        fps = exact_rate(self.base.request.fps)
        if self.base.options.audio is not None:
            names = (self.name, self.path.stem, *([""] if self.base.n_files == 1 else []))
            self.recordings = find_recordings(self.base.options.audio, self.path, names)
        spoken = [self._divide(cue) for cue in spoken]
        margins = (MARGIN_S, MARGIN_S) if self.recordings.track else (self.base.request.lead or 0.0, 0.0)
        before, after = (round(margin * fps) for margin in margins)
        windows = cue_windows(spoken, fps, (before, after))
        per = self.base.options.per
        if per == "cue":
            for window in windows:
                segment = self._speech(window, fills=False)
                if segment is not None:
                    part = f"-{window.part}" if window.part > 1 else ""
                    name = f"{self.name}-{window.cue.number:04d}{part}"
                    yield self._output(name, window.begin, [(window, segment)])
        elif per == "scene":
            gap = round(self.base.options.scene_gap * float(fps))
            for number, group in enumerate(scenes(windows, gap), start=1):
                yield self._joined_output(f"{self.name}-scene-{number:03d}", group, group[0].begin)
        else:
            yield self._joined_output(self.name, windows, 0)

    def _divide(self, cue: Cue) -> Cue:
        """A cue with its parts by speaker, or without them if it has one recording of all; both with a warning."""
        if not cue.parts:
            return cue
        named = " and ".join(part.speaker or "somebody" for part in cue.parts)
        if cue.number in self.recordings.cues:
            self._warn(cue.line, f"{named} speak in cue {cue.number}, which has one recording; one face is shown")
            return replace(cue, parts=())
        self._warn(cue.line, f"{named} speak in cue {cue.number}; its time is divided by their letters")
        return cue

    def _joined_output(self, name: str, windows: Sequence[Window], begin: int) -> Output:
        """Clip of consecutive windows with the silences between them."""
        parts: list[tuple[Window | None, Segment]] = []
        at = begin
        for window in windows:
            parts += [(None, silence) for silence in self._silences(window, window.begin - at)]
            speech = self._speech(window, fills=True)
            if speech is None:
                parts += [(None, silence) for silence in self._silences(window, window.slot_end - window.begin)]
            else:
                parts.append((window, speech))
            at = window.slot_end
        output = self._output(name, begin, parts)
        if self.recordings.track is None:
            return output
        sound = Sound(str(self.recordings.track), file_hash(self.recordings.track), begin)
        return replace(output, sounds=(sound,) * len(parts))

    def _output(self, name: str, begin: int, parts: Sequence[tuple[Window | None, Segment]]) -> Output:
        fps = exact_rate(self.base.request.fps)
        cues = tuple(
            PlannedCue(
                window.cue.number,
                window.cue.line,
                window.cue.speaker,
                window.cue.text,
                float(window.cue_begin / fps),
                float(window.cue_end / fps),
                index,
            )
            for index, (window, _) in enumerate(parts)
            if window is not None
        )
        segments = tuple(segment for _, segment in parts)
        options = self.base.options
        suffix = "" if options.format == "none" else f".{options.format}"
        exports = tuple(batch_format(one)[0] for one in options.exports)
        source = (str(self.path),)
        output = Output(name, source, float(begin / fps), float(fps), cues, segments, suffix=suffix, exports=exports)
        check_faces(output)
        return output

    def _speech(self, window: Window, *, fills: bool) -> Segment | None:
        """Segment of a cue; None with a warning if it cannot be spoken."""
        settings = self._settings(window)
        request: dict[str, Any] = {**settings, "text": window.cue.text}
        if self.base.options.audio is not None:
            found = self.recordings.track or self.recordings.cues.get(window.cue.number)
            if found is None:
                self._warn(window.cue.line, f"cue {window.cue.number} has no recording; it is silent")
                return None
            request = {name: value for name, value in request.items() if name not in NOT_WITH_AUDIO}
            request["audio"] = str(found)
        slot_end = window.slot_end if fills else window.next_begin
        segment = self._segment(window, request, None if slot_end is None else slot_end - window.begin, fills=fills)
        try:
            prepare(Request(**request))
        except (InputError, DataError) as wrong:
            self.n_silent += 1
            self._warn(window.cue.line, f"cue {window.cue.number} is silent: {wrong}")
            return None
        return segment

    def _silences(self, window: Window, n_frames: int) -> Iterator[Segment]:
        """Segments of idle animation of the speaker of a window."""
        fps = float(exact_rate(self.base.request.fps))
        longest = max(1, int(MAX_IDLE_S * fps))
        settings = {name: value for name, value in self._settings(window).items() if name not in NOT_WHEN_SILENT}
        while n_frames > 0:
            part = min(n_frames, longest)
            seed = int(settings.get("seed", 0)) + n_frames  # other motion in each part, and for other lengths
            request = {**settings, "idle": max(part / fps, IDLE_LIMITS_S[0]), "seed": seed}
            yield self._segment(window, request, part, fills=True, window_frames=part)
            n_frames -= part

    def _segment(
        self,
        window: Window,
        request: Mapping[str, Any],
        slot: int | None,
        *,
        fills: bool,
        window_frames: int | None = None,
    ) -> Segment:
        models = self._models(window)
        n_frames = window.end - window.begin if window_frames is None else window_frames
        is_excerpt = self.recordings.track is not None and "audio" in request
        fps = exact_rate(self.base.request.fps)
        segment = Segment(
            request,
            self.base.picture,
            models,
            n_frames,
            slot,
            fills,
            self.base.options.overflow,
            self.base.options.max_rate,
            audio_begin=first_sample(window.begin, SOUND_RATE, fps) if is_excerpt else None,
            lead_frames=None if is_excerpt or "idle" in request else window.margin_begin,
            medium=ALPHA_MOVIE if self.base.options.format == "webm" else MOVIE,
        )
        return replace(segment, file_hashes=self._file_hashes(segment))

    def _settings(self, window: Window) -> dict[str, Any]:
        """Request fields of a cue: of the command, its language, and its role in the cast."""
        settings = non_defaults(self.base.request)
        if window.cue.language and "language" not in settings:
            settings["language"] = self._language(window)
        self.base.used.add(id(self.base.cast.role_of(window.cue, self.path.name)))
        cast = self.base.cast.settings(window.cue, self.path.name)
        settings |= {name: value for name, value in cast.items() if name in REQUEST_NAMES}
        return {name: value for name, value in settings.items() if value is not None}

    def _language(self, window: Window) -> str | None:
        from lexicon.languages import language_code

        try:
            return language_code(str(window.cue.language))
        except InputError:
            self._warn(window.cue.line, f"the language {window.cue.language} is not known; it is not used")
            return None

    def _models(self, window: Window) -> Models:
        models, role = self.base.models, self.base.cast.role_of(window.cue, self.path.name)
        for settings in (self.base.cast.default, role.settings if role else {}):
            chosen = {name: settings[name] for name in MODEL_NAMES if name in settings}
            if chosen.get("face", models.face) != models.face:
                chosen = dict.fromkeys(("identity", "hair", "hair_color")) | chosen  # they belong to a face
            elif models.face == DRAWN_FACE:
                chosen = {"face": ""} | chosen  # the one that the other settings belong to
            models = replace(models, **chosen)
        return models

    def _file_hashes(self, segment: Segment) -> Mapping[str, str]:
        if segment.audio_begin is not None:
            return segment.input_hashes()
        names = ("audio", "dictionary", "voice", "style")
        key = repr((segment.models, [segment.request.get(name) for name in names]))
        if key not in self._hashes:
            check_names(segment.models, segment.request)
            self._hashes[key] = segment.input_hashes()
        return self._hashes[key]

    def _add_warnings(self, read: Subtitles) -> None:
        for warning in read.warnings:
            self._warn(warning.line, warning.message)

    def _warn(self, line: int, message: str) -> None:
        warning = SubtitleWarning(line, message)
        planned = PlanWarning(str(self.path), warning.line, warning.message)
        if planned not in self.warnings[-8:]:
            self.warnings.append(planned)
