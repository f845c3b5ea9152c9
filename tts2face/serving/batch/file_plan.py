"""The plan of one subtitle file: windows, speakers and sentences of its cues, and the segments of its outputs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

from lexicon.capitals import is_in_capitals, sentence_case
from lexicon.errors import DataError, InputError
from tts2face.interchange.exports.table import batch_format
from tts2face.interchange.subtitles.cues import Cue
from tts2face.request import ONLY_SPOKEN, Request
from tts2face.serving.batch.cast import Cast
from tts2face.serving.batch.cast_checks import check_names
from tts2face.serving.batch.content_address import file_hash
from tts2face.serving.batch.cue_file import left_out_cues, read_cue_file
from tts2face.serving.batch.cue_sentences import (
    MAX_GAP_S,
    CueSentence,
    is_punctuated,
    letters_of_cues,
    sentence_groups,
    spoken_part,
    words_of_cue,
)
from tts2face.serving.batch.export import check_faces
from tts2face.serving.batch.lines import Lines
from tts2face.serving.batch.options import REPORT, BatchOptions, non_defaults
from tts2face.serving.batch.output import Output, PlannedCue, PlannedLine, PlanWarning, Sound
from tts2face.serving.batch.recordings import SubtitleRecordings, find_recordings
from tts2face.serving.batch.segment import ALPHA_MOVIE, MOVIE, CuePart, Segment
from tts2face.serving.batch.speakers import Speakers
from tts2face.serving.batch.windows import Window, cue_lines, cue_windows, scenes
from tts2face.session.named_models import Models
from tts2face.session.prepared import prepare
from tts2face.source_options import IDLE_LIMITS_S, SOURCE_OPTIONS
from tts2face.types import SOUND_RATE, exact_rate, first_sample

MAX_IDLE_S = 20.0  # of one segment of silence
MARGIN_S = 0.5  # around a cue, for speech of a dubbing track that begins early or ends late; half of shorter gaps
NOT_WHEN_SILENT = {*SOURCE_OPTIONS, "dictionary", "text_marks", "language"}


@dataclass(frozen=True, slots=True)
class PlanBase:
    """Settings of all files."""

    options: BatchOptions
    request: Request
    picture: Mapping[str, Any]
    models: Models
    cast: Cast
    n_files: int
    lines: Lines

    @property
    def lead(self) -> float:
        """Seconds before the first sound of a clip."""
        return 0.0 if self.request.spoken is None else self.request.spoken.lead or 0.0

    @property
    def is_joined(self) -> bool:
        """Whether outputs hold several cues."""
        return self.options.per != "cue"


@dataclass(slots=True)
class FilePlan:
    """Plan of one subtitle file."""

    base: PlanBase
    path: Path
    name: str
    warnings: list[PlanWarning] = field(default_factory=list)
    notes: list[PlanWarning] = field(default_factory=list)
    recordings: SubtitleRecordings = field(default_factory=SubtitleRecordings)
    n_cues: int = 0
    n_silent: int = 0
    segments: dict[tuple[int, int], Segment] = field(default_factory=dict)  # by cue and part
    speakers: Speakers = field(init=False)
    _is_in_capitals: bool = False
    _lines: list[tuple[Cue, int]] = field(default_factory=list)
    _windows: dict[tuple[int, int], Window] = field(default_factory=dict)
    _sentences: dict[tuple[int, int], CueSentence] = field(default_factory=dict)
    _following: dict[tuple[int, int], Window] = field(default_factory=dict)
    _hashes: dict[str, Mapping[str, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make the castings of its speakers."""
        self.speakers = Speakers(
            self.base.cast,
            self.base.lines,
            non_defaults(self.base.request),
            self.base.models,
            (self.path.name, self.name),
            keeps_face=self.base.is_joined and bool(self.base.options.exports),
            on_unknown=self._language_unknown,
        )

    def outputs(self) -> Iterator[Output]:
        """Outputs of the file."""
        windows = self._read()
        per = self.base.options.per
        if not windows:
            self._warn(1, "no cue has words that are spoken; there is no clip of this file")
        elif per == "cue":
            for window in windows:
                segment = self._speech(window)
                if segment is not None:
                    part = f"-{window.part}" if window.part > 1 else ""
                    name = f"{self.name}-{window.cue.number:04d}{part}"
                    yield self._output(name, window.begin, [(window, segment)])
        elif per == "scene":
            gap = round(self.base.options.scene_gap * float(exact_rate(self.base.request.fps)))
            for number, group in enumerate(scenes(windows, gap), start=1):
                yield self._joined_output(f"{self.name}-scene-{number:03d}", group, group[0].begin)
        else:
            yield self._joined_output(self.name, windows, 0)

    def lines(self) -> Iterator[PlannedLine]:
        """Lines of the file, after its outputs."""
        fps = exact_rate(self.base.request.fps)
        for cue, part in self._lines:
            window = self._windows.get((cue.number, part))
            times = (cue.begin_s, cue.end_s)
            if window is not None:
                times = float(window.cue_begin / fps), float(window.cue_end / fps)
            yield PlannedLine(
                self.name,
                cue.number,
                part,
                *times,
                cue.speaker,
                cue.text,
                self.speakers.settings(cue, part),
                self.speakers.casting(cue, part),
                self.segments.get((cue.number, part)),
            )

    def _read(self) -> tuple[Window, ...]:
        """Windows of the spoken lines."""
        if self.base.options.audio is not None:
            names = (self.name, self.path.stem, *([""] if self.base.n_files == 1 else []))
            self.recordings = find_recordings(self.base.options.audio, self.path, names)
        read = read_cue_file(self.path, self.base.options, self.base.request, self.recordings.track)
        for warning in read.warnings:
            self._warn(warning.line, warning.message)
        self.notes += [PlanWarning(str(self.path), note.line, note.message) for note in read.notes]
        self.notes += [PlanWarning(str(self.recordings.track), 0, note) for note in self.recordings.notes()]
        cues = [self._divide(cue) for cue in read.cues if cue.text]
        self.n_cues, self._is_in_capitals = len(read.cues), is_in_capitals(cue.text for cue in cues)
        cues = sorted(map(self._moved, [*cues, *left_out_cues(read)]), key=lambda cue: cue.begin_s)
        fps = exact_rate(self.base.request.fps)
        self._lines = [line for cue in cues for line in cue_lines(cue)]
        for _, group in groupby(self._lines, key=lambda line: round(line[0].begin_s * float(fps))):
            self.speakers.tell_apart(list(group))
        margins = (MARGIN_S, MARGIN_S) if self.recordings.track else (self.base.lead, 0.0)
        before, after = (round(margin * fps) for margin in margins)
        windows = cue_windows(cues, fps, (before, after), is_spoken=self.speakers.is_spoken, rate_of=self._rate_of)
        self._windows = {window.numbers: window for window in windows}
        self.n_silent = len(read.cues) - len({window.cue.number for window in windows})
        self._following = {window.numbers: later for window, later in pairwise(windows)}
        if self.base.options.audio is None:
            self._find_sentences(windows)
        return windows

    def _rate_of(self, cue: Cue, part: int) -> float:
        """Speaking rate of a line before it is fitted."""
        return float(self.speakers.casting(cue, part).request.get("rate", 1.0))

    def _moved(self, cue: Cue) -> Cue:
        """A cue at its time of the table; several speakers of one move with the first of them."""
        offset = self.speakers.settings(cue, 1 if cue.parts else 0).offset_s
        for part in range(2, len(cue.parts) + 1):
            if self.speakers.settings(cue, part).offset_s not in (0.0, offset):
                self._warn(
                    cue.line, f"the offset of part {part} of cue {cue.number} has no effect: it moves with part 1"
                )
        if cue.begin_s + offset < 0.0:
            self._warn(cue.line, f"cue {cue.number} begins at 0 s: an offset of {offset:g} s is before the start")
        begin = max(cue.begin_s + offset, 0.0)
        # a millisecond at least: a cue before 0 s has no other length
        return replace(cue, begin_s=begin, end_s=max(cue.end_s + offset, begin + 0.001)) if offset else cue

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

    def _find_sentences(self, windows: Sequence[Window]) -> None:
        """Note the sentences that run over several cues."""
        gap = round(MAX_GAP_S * float(exact_rate(self.base.request.fps)))
        words = [words_of_cue(window.cue.text, self._settings(window)) for window in windows]
        is_open = self._is_in_capitals and is_punctuated(words)
        keys = [None if window.part else self._who(window) for window in windows]
        languages = [self._language(window) for window in windows]
        for group in sentence_groups(windows, words, keys, gap, languages, is_in_capitals=is_open):
            inside, last = tuple(windows[at] for at in group), len(group) - 1
            texts = [
                spoken_part(window.cue.text, is_first=at == 0, is_last=at == last) for at, window in enumerate(inside)
            ]
            whole = self._written(" ".join(texts), inside[0])
            if last and (letters := letters_of_cues(texts, whole, self._settings(inside[0]))) is not None:
                sentence = CueSentence(inside, letters, whole)
                self._sentences |= {window.numbers: sentence for window in inside}

    def _settings(self, window: Window) -> Mapping[str, Any]:
        return self.speakers.casting(window.cue, window.part).request

    def _who(self, window: Window) -> object:
        """Equal for lines of one speaker with equal settings."""
        casting = self.speakers.casting(window.cue, window.part)
        return window.cue.speaker, casting.other, casting.models, repr(sorted(casting.request.items()))

    def _speaks_on(self, window: Window, following: Window) -> bool:
        """Whether one speaker has both lines, the first of which may use the time up to the second."""
        before, after = (self.speakers.casting(shown.cue, shown.part) for shown in (window, following))
        same = [
            (segment.cue.speaker, casting.other, casting.models, casting.request.get("voice"))
            for segment, casting in ((window, before), (following, after))
        ]
        return following.begin <= window.slot_end and same[0] == same[1]

    def _written(self, text: str, window: Window) -> str:
        """Words of a line, in small letters where the file has only capitals."""
        return sentence_case(text, self._language(window), is_shouted=True) if self._is_in_capitals else text

    def _language(self, window: Window) -> str:
        return str(self._settings(window).get("language", Request().language))

    def _joined_output(self, name: str, windows: Sequence[Window], begin: int) -> Output:
        """Clip of consecutive windows with the silences between them."""
        parts: list[tuple[Window | None, Segment]] = []
        at = begin
        for window in windows:
            parts += [(None, silence) for silence in self._silences(window, window.begin - at)]
            speech = self._speech(window, is_last=window is windows[-1])
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
        exports = tuple(batch_format(export)[0] for export in options.exports)
        source = (str(self.path),)
        output = Output(name, source, float(begin / fps), float(fps), cues, segments, suffix=suffix, exports=exports)
        check_faces(output)
        return output

    def _speech(self, window: Window, *, is_last: bool = False) -> Segment | None:
        """Segment of a cue, which may be the last one of its output; None with a warning if it cannot be spoken."""
        casting = self.speakers.casting(window.cue, window.part)
        sentence = self._sentences.get(window.numbers)
        text = self._written(window.cue.text, window) if sentence is None else sentence.text
        request: dict[str, Any] = {**casting.request, "text": text}
        if self.base.options.audio is not None:
            found = self.recordings.track or self.recordings.cues.get(window.cue.number)
            if found is None:
                self._warn(window.cue.line, f"cue {window.cue.number} has no recording; it is silent")
                return None
            request = {name: value for name, value in request.items() if name not in ONLY_SPOKEN}
            request["audio"] = str(found)
        segment = self._segment(window, request, self._slot(window))
        segment = self._fitted(segment, window, sentence, is_last=is_last)
        try:
            prepare(Request(**request))
        except (InputError, DataError) as wrong:
            self.n_silent += 1
            self._warn(window.cue.line, f"cue {window.cue.number} is silent: {wrong}")
            return None
        self.segments[window.numbers] = segment
        return segment

    def _fitted(self, segment: Segment, window: Window, sentence: CueSentence | None, *, is_last: bool) -> Segment:
        """A segment of speech with what its fit needs: rates, the next cue, and the sentence around it."""
        options, rate = self.base.options, self.speakers.settings(window.cue, window.part).rate
        windows = (window,) if sentence is None else sentence.windows
        following = self._following.get(windows[-1].numbers)
        overlap = 0.0 if is_last else options.max_overlap
        n_silent = max((window.next_begin or window.slot_end) - window.slot_end, 0)
        silence = float(n_silent / exact_rate(self.base.request.fps))
        segment = replace(
            segment,
            min_rate=options.min_rate,
            max_overlap=overlap,
            silence_s=min(silence, overlap) if segment.fills_slot else 0.0,
            is_shared=following is not None and self._speaks_on(windows[-1], following),
        )
        if rate is not None:
            segment = replace(segment, overflow=REPORT, min_rate=rate, max_rate=rate)
        if sentence is None:
            return segment
        parts = tuple(
            CuePart(letters, own.end - own.begin, self._slot(own), own.margin_begin)
            for own, letters in zip(sentence.windows, sentence.n_letters, strict=True)
        )
        return replace(segment, parts=parts, part=sentence.windows.index(window))

    def _silences(self, window: Window, n_frames: int) -> Iterator[Segment]:
        """Segments of idle animation of the speaker of a window."""
        fps = float(exact_rate(self.base.request.fps))
        longest = max(1, int(MAX_IDLE_S * fps))
        casting = self.speakers.casting(window.cue, window.part)
        settings = {name: value for name, value in casting.request.items() if name not in NOT_WHEN_SILENT}
        while n_frames > 0:
            part = min(n_frames, longest)
            seed = casting.seed + n_frames  # other motion in each part, and for other lengths
            request = {**settings, "idle": max(part / fps, IDLE_LIMITS_S[0]), "seed": seed}
            yield self._segment(window, request, part, part)
            n_frames -= part

    def _segment(
        self,
        window: Window,
        request: Mapping[str, Any],
        slot: int | None,
        window_frames: int | None = None,
    ) -> Segment:
        models = self.speakers.casting(window.cue, window.part).models
        n_frames = window.end - window.begin if window_frames is None else window_frames
        is_excerpt = self.recordings.track is not None and "audio" in request
        fps = exact_rate(self.base.request.fps)
        segment = Segment(
            request,
            self.base.picture,
            models,
            n_frames,
            slot,
            self.base.is_joined,
            self.base.options.overflow,
            self.base.options.max_rate,
            audio_begin=first_sample(window.begin, SOUND_RATE, fps) if is_excerpt else None,
            lead_frames=None if is_excerpt or "idle" in request else window.margin_begin,
            medium=ALPHA_MOVIE if self.base.options.format == "webm" else MOVIE,
        )
        return replace(segment, file_hashes=self._file_hashes(segment))

    def _slot(self, window: Window) -> int | None:
        """Frames up to the next cue, or of the segment that fills them in a joined output; None: no cue follows."""
        end = window.slot_end if self.base.is_joined else window.next_begin
        return None if end is None else end - window.begin

    def _file_hashes(self, segment: Segment) -> Mapping[str, str]:
        if segment.audio_begin is not None:
            return segment.input_hashes()
        names = ("audio", "dictionary", "text_marks", "voice", "style")
        key = repr((segment.models, [segment.request.get(name) for name in names]))
        if key not in self._hashes:
            check_names(segment.models, segment.request)
            self._hashes[key] = segment.input_hashes()
        return self._hashes[key]

    def _language_unknown(self, cue: Cue) -> None:
        self._warn(cue.line, f"the language {cue.language} is not known; it is not used")

    def _warn(self, line: int, message: str) -> None:
        planned = PlanWarning(str(self.path), line, message)
        if planned not in self.warnings[-8:]:
            self.warnings.append(planned)
