"""Reading of subtitle files, with warnings in place of refusals.

How the next format is made:

1. Write a function from the lines of a file to `WrittenCue` objects and `SubtitleWarning` objects in a module of its
   own here, as `tts2face.interchange.subtitles.substation` does; a DataError only where nothing can be read.
2. Name the format in `tts2face.interchange.subtitles.formats`, with its endings in `SUFFIXES`, recognise its content
   in `subtitle_format`, and call the function in `read_format`; order, missing ends, repeats and speakers are the same
   for all formats.
3. Say in docs/subtitles.md what is read of it, and add its file and its defects to tests/interchange/subtitles.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path

from lexicon.errors import DataError
from lexicon.values.files import check_regular_file
from tts2face.interchange.subtitles.bilingual import in_one_language
from tts2face.interchange.subtitles.binary import HEAD_BYTES, check_text, is_ebu, is_film
from tts2face.interchange.subtitles.cues import Cue, Subtitles, SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.decoding import MAX_BYTES, decode_file
from tts2face.interchange.subtitles.ebu import read_ebu
from tts2face.interchange.subtitles.encodings import Decoded
from tts2face.interchange.subtitles.formats import NAMES, read_format
from tts2face.interchange.subtitles.labels import find_speakers
from tts2face.interchange.subtitles.markup import plain_text
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.interchange.subtitles.repeats import without_carried, without_copies
from tts2face.interchange.subtitles.spoken_text import SpokenText, spoken_lines, spoken_text
from tts2face.interchange.subtitles.timing import MAX_S, estimated_end, latest_ends, placed
from tts2face.interchange.subtitles.unspoken import LYRICS, REPEATS, SIGNS, notes_of, with_credits

DEFAULTS = SubtitleOptions()
MAX_NAMED = 12  # speakers in a note
OVERLAP_S = 1e-6  # an end that is the next start differs by rounding at most


@dataclass(slots=True)
class _File:
    """A file while it is read: its cues as they are written, its film, and what is worth saying."""

    written: list[WrittenCue] = field(default_factory=list)
    warnings: list[SubtitleWarning] = field(default_factory=list)
    film_s: float | None = None


def read_subtitles(path: Path | str, encoding: str | None = None, options: SubtitleOptions = DEFAULTS) -> Subtitles:
    """Cues of a subtitle file, or of a film's track of subtitles, in order of time, and warnings of its defects.

    The content decides the format where it is unmistakable, else the suffix. Defects are read as players do and
    reported with their lines: missing blank lines and numbers, unreadable times, cues out of order, ends before begins,
    overlaps, duplicates, missing headers. What is shown twice is spoken once, and what nobody says has no words; notes
    say how much.

    Parameters
    ----------
    encoding
        Encoding of text that is neither UTF-8 nor marked; None: it is guessed, with a warning.
    options
        Other choices, as the language, speakers, and what is spoken of what is only shown.

    Raises
    ------
    InputError
        There is no such encoding or track.
    DataError
        The file cannot be read, contains no cue, or its times cannot be meant.
    """
    path = Path(path)
    try:
        file = _read(path, encoding, options)
        cues = placed(file.written, file.warnings, shift=options.shift, film_s=file.film_s)
    except DataError as wrong:
        raise wrong if str(path) in str(wrong) else DataError(f"{path}, {wrong}") from wrong
    if not cues:
        raise DataError(_nothing(path, file.warnings))
    notes: list[SubtitleWarning] = []
    if REPEATS not in options.keep:
        cues = in_one_language(cues, options.language, notes)
        cues = without_carried(without_copies(cues, file.warnings), notes)
    cues = _without_styles_of_all(with_credits(cues))
    timed = _timed(cues, options, file.warnings, notes)
    by_line = sorted(file.warnings, key=lambda warning: warning.line)
    return Subtitles(path, timed, tuple(by_line), tuple(notes))


def _read(path: Path, encoding: str | None, options: SubtitleOptions) -> _File:
    """Cues of a file as they are written, in its order."""
    check_regular_file(path)
    try:
        with path.open("rb") as opened:
            head = opened.read(HEAD_BYTES)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    check_text(head, str(path))
    if is_ebu(head):
        if path.stat().st_size > MAX_BYTES:
            raise DataError(f"{path} is larger than {MAX_BYTES >> 20} MiB; divide it")
        return _File(*read_ebu(path.read_bytes(), str(path)), options.film_s)
    if is_film(head):
        from tts2face.interchange.subtitles.film_track import read_film

        written, warnings, film_s = read_film(path, options.language, options.track)
        return _File(written, warnings, options.film_s or film_s)
    decoded = decode_file(path, encoding, options.language)
    text = decoded.text.replace("\r\n", "\n").replace("\r", "\n")
    written, warnings = read_format(text, path.suffix, options)
    return _File(written, [*_encoding_warnings(decoded), *warnings], options.film_s)


def _encoding_warnings(decoded: Decoded) -> list[SubtitleWarning]:
    if decoded.n_damaged:
        message = f"{decoded.n_damaged} bytes are no UTF-8, as the rest is; --encoding names another encoding"
        return [SubtitleWarning(1, message)]
    if not decoded.is_guess:
        return []
    message = f"the encoding is not stated and was guessed as {decoded.encoding}; --encoding names another"
    return [SubtitleWarning(1, message)]


def _nothing(path: Path, warnings: Sequence[SubtitleWarning]) -> str:
    """Why a file has no cue."""
    if warnings:
        first = warnings[0]
        return f"{path} contains no subtitles that can be read (line {first.line}: {first.message}); correct its times"
    return f"{path} contains no subtitles of a format that is read ({', '.join(NAMES)}); convert it to .srt"


def _without_styles_of_all(cues: Sequence[WrittenCue]) -> list[WrittenCue]:
    """Cues, of which those of signs and songs are dialogue where the file has nothing else."""
    has_dialogue = any(not cue.kind and cue.text.strip() for cue in cues)
    if has_dialogue:
        return list(cues)
    return [replace(cue, kind="") if cue.kind in {SIGNS, LYRICS} else cue for cue in cues]


def _timed(
    written: Sequence[WrittenCue],
    options: SubtitleOptions,
    warnings: list[SubtitleWarning],
    notes: list[SubtitleWarning],
) -> tuple[Cue, ...]:
    """Cues with their ends, words and speakers."""
    said = [not cue.kind or cue.kind in options.keep for cue in written]
    plain = [plain_text(cue.text, cue.markup) for cue, is_said in zip(written, said, strict=True) if is_said]
    # Only a text with a colon is divided, as most have none.
    labels = find_speakers(["\n".join(spoken_lines(text)) if ":" in text or "：" in text else text for text in plain])
    speakers: Collection[str] = labels.keys() if options.speakers else ()
    latest = _latest_ends(written, said)
    cues: list[Cue] = []
    left_out: list[tuple[str, int, str]] = []
    rules = options.mark_rules
    for number, (cue, is_said) in enumerate(zip(written, said, strict=True)):
        text = spoken_text(
            cue.text,
            cue.markup,
            keep=options.keep,
            speakers=speakers,
            is_document=options.markup == "ssml",
            rules=rules,
        )
        if is_said:
            left_out += [(kind, cue.line, words) for kind, words in text.left_out]
        else:
            left_out.append((cue.kind, cue.line, text.shown))
            text = SpokenText("", text.shown, ())
        made = _cue(number, cue, text, latest[number])
        cues.append(made if is_said else replace(made, kind=cue.kind))
    warnings += _defects(written, cues, said)
    notes += notes_of(left_out)
    notes += _note_of_speakers(cues, labels if options.speakers else {})
    return tuple(cues)


def _latest_ends(written: Sequence[WrittenCue], said: Sequence[bool]) -> list[float]:
    """For each cue the latest end of an estimate; what nobody says takes no time from what is said."""
    latest = latest_ends(written)
    places = [number for number, is_said in enumerate(said) if is_said]
    for number, end in zip(places, latest_ends([written[number] for number in places]), strict=True):
        latest[number] = end
    return latest


def _defects(written: Sequence[WrittenCue], cues: Sequence[Cue], said: Sequence[bool]) -> Iterator[SubtitleWarning]:
    """Warnings of the times of cues that are said: ends that are estimated, and overlaps of words with words."""
    following = inf
    for cue, made, is_said in reversed(list(zip(written, cues, said, strict=True))):
        if is_said and made.has_estimated_end and cue.end_s is not None:
            reason = "has no length" if cue.end_s == cue.begin_s else "ends before it begins"
            yield SubtitleWarning(cue.line, f"the cue {reason}; its end is estimated")
        elif is_said and made.text and made.end_s > following + OVERLAP_S and not made.has_estimated_end:
            yield SubtitleWarning(cue.line, f"this cue overlaps the next one by {made.end_s - following:.2f} s")
        following = made.begin_s if is_said and made.text else following


def _cue(number: int, cue: WrittenCue, text: SpokenText, latest: float) -> Cue:
    end = cue.end_s
    is_estimated = end is None or end <= cue.begin_s or end > MAX_S
    if is_estimated:
        end = estimated_end(cue.begin_s, latest, text.spoken or text.shown)
    parts = text.parts if len(text.parts) > 1 else ()
    if parts and not parts[0].speaker:
        parts = (replace(parts[0], speaker=cue.speaker), *parts[1:])
    return Cue(
        number + 1,
        cue.begin_s,
        end or 0.0,
        text.spoken,
        cue.line,
        text.shown,
        text.speaker or cue.speaker,
        cue.style,
        cue.language,
        is_estimated,
        parts,
    )


def _note_of_speakers(cues: Sequence[Cue], labels: Mapping[str, str]) -> list[SubtitleWarning]:
    """A note of the speakers who were found by their labels, with their numbers of cues."""
    counts: dict[str, int] = {}
    first = 0
    for cue in cues:
        named = {part.speaker for part in cue.parts} if cue.parts else {cue.speaker}
        for name in sorted(named):
            if name and " ".join(name.split()).casefold() in labels:
                counts[name] = counts.get(name, 0) + 1
                first = first or cue.line
    if not counts:
        return []
    ordered = sorted(counts.items(), key=lambda count: -count[1])
    shown = ", ".join(f"{name} ({n})" for name, n in ordered[:MAX_NAMED])
    more = f" and {len(counts) - MAX_NAMED} more" if len(counts) > MAX_NAMED else ""
    message = f"speakers by names before a colon: {shown}{more}; --no-speakers makes the names words"
    return [SubtitleWarning(first, message)]
