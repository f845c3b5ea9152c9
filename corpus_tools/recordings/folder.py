"""Folders of recordings: their videos and transcripts.

Transcripts of videos: Praat TextGrids, word alignments of the GRID corpus, subtitles and plain text.

Subtitles of videos as cues with margins.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lexicon.dictionary import cmudict_lookup
from lexicon.errors import DataError, InputError
from lexicon.normalize import normalize
from lexicon.values.tables import read_table
from tts2face.interchange.subtitles.decoding import read_text
from tts2face.interchange.subtitles.reader import read_subtitles
from tts2face.sound.word_lattice import PronouncedWords, Pronunciations

SUBTITLE_SUFFIXES = (".srt", ".vtt", ".ass", ".ssa", ".ttml")  # in order of preference
CUE_MARGIN_S = 0.3  # before and after a cue; subtitles are rarely closer to the speech


@dataclass(frozen=True, slots=True)
class SpokenCue:
    """Words spoken between two instants in seconds."""

    begin: float
    end: float
    text: str


def find_subtitles(video: Path) -> Path | None:
    """The subtitle file of a video, or None."""
    return next((path for suffix in SUBTITLE_SUFFIXES if (path := video.with_suffix(suffix)).is_file()), None)


def read_cues(path: Path) -> tuple[SpokenCue, ...]:
    """Spoken cues in temporal order, each extended by `CUE_MARGIN_S` but not beyond the middle to its neighbour.

    Cues without words and cues whose end is only estimated are left out.

    Raises
    ------
    DataError
        The file is not a subtitle file, or contains no spoken cue.
    """
    read = read_subtitles(path).cues
    spoken = [(cue.begin_s, cue.end_s, cue.text) for cue in read if cue.text and not cue.has_estimated_end]
    if not spoken:
        raise DataError(f"{path} contains no subtitles; export them again")
    cues = []
    for number, (begin, end, text) in enumerate(spoken):
        before = spoken[number - 1][1] if number else 0.0
        behind = spoken[number + 1][0] if number + 1 < len(spoken) else end + 2 * CUE_MARGIN_S
        earliest, latest = min((before + begin) / 2, begin), max((end + behind) / 2, end)
        cues.append(SpokenCue(max(begin - CUE_MARGIN_S, earliest, 0.0), min(end + CUE_MARGIN_S, latest), text))
    return tuple(cues)


SILENT_LABELS = frozenset({"", "sil", "sp", "spn", "<p:>", "<sil>", "pau", "#"})
# Outside quotes only numbers have a meaning (Praat manual, "TextGrid file format").
_TOKEN = re.compile(r'"(?P<label>(?:[^"]|"")*)"|\[[^\]\n]*\]|!.*|(?<![\w.])(?P<number>-?\d+(?:\.\d+)?)(?![\w.])')
_TIER_ENTRY_SIZES = {"IntervalTier": 3, "TextTier": 2}  # entries of one interval or point


def read_textgrid(path: Path) -> tuple[SpokenCue, ...]:
    """The intervals of the first tier whose name contains "word", or else of the first interval tier.

    Raises
    ------
    DataError
        The file is not a TextGrid, is truncated, or contains no word.
    """
    items = _split_items(read_text(path))
    if list(items[:2]) != ["ooTextFile", "TextGrid"]:
        raise DataError(f"{path} is not a TextGrid; save it with Praat as text")
    try:
        tiers = list(_read_tiers(iter(items[5:])))
    except (StopIteration, RuntimeError, TypeError, ValueError, OverflowError, KeyError) as broken:
        raise DataError(f"{path} is a damaged TextGrid; save it with Praat again") from broken
    named = [cues for name, cues in tiers if "word" in name.lower()]
    spoken = next(iter(named or [cues for _, cues in tiers]), ())
    found = tuple(cue for cue in spoken if cue.text.lower() not in SILENT_LABELS)
    if not found:
        raise DataError(f"{path} has no interval with a word; check the file")
    return found


def _split_items(text: str) -> list[str | float]:
    """Labels and numbers in order."""
    items: list[str | float] = []
    for match in _TOKEN.finditer(text):
        if match["label"] is not None:
            items.append(match["label"].replace('""', '"'))
        elif match["number"] is not None:
            items.append(float(match["number"]))
    return items


def _read_tiers(items: Iterator[str | float]) -> Iterator[tuple[str, tuple[SpokenCue, ...]]]:
    """Name and cues of each interval tier; point tiers are skipped."""
    for kind in items:
        name, _, _, size = (next(items) for _ in range(4))
        rows = [[next(items) for _ in range(_TIER_ENTRY_SIZES[str(kind)])] for _ in range(int(size))]
        if kind == "IntervalTier":
            yield str(name), tuple(_parse_cue(*row) for row in rows)


def _parse_cue(start: str | float, end: str | float, label: str | float) -> SpokenCue:
    if not isinstance(label, str) or not 0 <= float(start) < float(end):
        raise ValueError(label)
    return SpokenCue(float(start), float(end), label.strip())


UNITS_PER_S = 25_000  # Cooke et al. 2006: samples of the 25 kHz sound


def read_word_times(path: Path) -> tuple[SpokenCue, ...]:
    """Words and times of an .align file (start, end and word per line, in units of 1/25000 s), without silences.

    Raises
    ------
    DataError
        A line is malformed, or there is no word.
    """
    cues = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        fields = line.split()
        if not fields:
            continue
        if len(fields) != 3 or not (fields[0].isdecimal() and fields[1].isdecimal()):
            raise DataError(f"{path}, line {number}: {line[:60]!r} is not start, end and word; correct it")
        if fields[2].lower() not in SILENT_LABELS:
            cues.append(SpokenCue(int(fields[0]) / UNITS_PER_S, int(fields[1]) / UNITS_PER_S, fields[2]))
    if not cues:
        raise DataError(f"{path} contains no word; check the file")
    return tuple(cues)


TEXT_SUFFIX = ".txt"
READERS = {".textgrid": read_textgrid, ".align": read_word_times, **dict.fromkeys(SUBTITLE_SUFFIXES, read_cues)}


def find_transcript(video: Path) -> Path | None:
    """The transcript beside a video, in order of preference text, TextGrid, word times, subtitles; None without one."""
    beside = {path.suffix.lower(): path for path in sorted(video.parent.iterdir()) if path.stem == video.stem}
    return next((beside[suffix] for suffix in (TEXT_SUFFIX, *READERS) if suffix in beside), None)


def read_transcript(transcript: Path) -> str:
    """All words of a transcript, in order.

    Raises
    ------
    DataError
        It cannot be read or contains no word.
    BackendError
        A package for its format is missing.
    """
    suffix = transcript.suffix.lower()
    if suffix == TEXT_SUFFIX:
        return read_text(transcript)
    return " ".join(cue.text for cue in READERS[suffix](transcript))


VIDEO_SUFFIXES = frozenset({".mkv", ".mp4", ".mov", ".webm", ".avi", ".mpg", ".mpeg", ".m4v"})
MANIFEST = "manifest.csv"
# Names of letters in ARPABET, in southern British and in American English.
LETTER_NAMES = {
    "a": ("EY1",), "b": ("B IY1",), "c": ("S IY1",), "d": ("D IY1",), "e": ("IY1",), "f": ("EH1 F",),
    "g": ("JH IY1",), "h": ("EY1 CH",), "i": ("AY1",), "j": ("JH EY1",), "k": ("K EY1",), "l": ("EH1 L",),
    "m": ("EH1 M",), "n": ("EH1 N",), "o": ("OW1",), "p": ("P IY1",), "q": ("K Y UW1",), "r": ("AA1", "AA1 R"),
    "s": ("EH1 S",), "t": ("T IY1",), "u": ("Y UW1",), "v": ("V IY1",), "w": ("D AH1 B AH0 L Y UW0",),
    "x": ("EH1 K S",), "y": ("W AY1",), "z": ("Z EH1 D", "Z IY1"),
}  # fmt: skip
# The older "hw" of "white" (Wells 1982, "glide cluster reduction"); alignment would label the rounded lips of w as h.
HW_CLUSTER = ("h", "w")


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording: a video, or a part of one, and its transcript.

    If `is_spelling`, words of one letter are names of letters. ``transcript`` is a text or its file, None without one.
    ``span`` are the seconds of the video, None for all. ``words`` are its pronounced words if already known.
    """

    name: str
    video: Path
    transcript: str | Path | None
    is_spelling: bool = False
    span: tuple[float, float] | None = None
    words: PronouncedWords | None = None


def find_recordings(folder: Path) -> tuple[Recording, ...]:
    """Recordings of a folder sorted by name, or those of one video.

    Two layouts are supported: ``manifest.csv`` (columns clip, transcript) beside a folder ``clips``, as for the GRID
    corpus, where single letters are names of letters; and videos with subtitles (.srt, .vtt; each cue is a recording)
    or a transcript (.txt, .TextGrid, .align) of the same name.

    Raises
    ------
    InputError
        There is no such folder, or no video in it.
    DataError
        The manifest cannot be read.
    """
    if folder.is_file() and folder.suffix.lower() in VIDEO_SUFFIXES:
        return tuple(_recordings_in_video(folder))
    if not folder.is_dir():
        raise InputError(f"there is no folder {folder}; give the folder of recordings")
    manifest = folder / MANIFEST
    found = _recordings_from_manifest(folder, manifest) if manifest.is_file() else _recordings_without_manifest(folder)
    if not found:
        raise InputError(
            f"{folder} contains no video ({', '.join(sorted(VIDEO_SUFFIXES))}); give a folder of recordings"
        )
    return found


def pronounce_recording(recording: Recording) -> PronouncedWords | None:
    """The words of a transcript with their pronunciations; None without a transcript.

    Raises
    ------
    DataError
        The transcript cannot be read, contains no word, or one without a pronunciation.
    """
    if recording.words is not None or recording.transcript is None:
        return recording.words
    content = read_transcript(recording.transcript) if isinstance(recording.transcript, Path) else recording.transcript
    text = content if recording.is_spelling else normalize(content)
    words = re.findall(r"[^\W_]+(?:['’][^\W_]+)*", text)
    if not words:
        raise DataError(f"the transcript of {recording.name} contains no word; write the spoken words into it")
    return tuple(
        (word, look_up_pronunciations(word, is_letter=recording.is_spelling and len(word) == 1)) for word in words
    )


def look_up_pronunciations(word: str, *, is_letter: bool) -> Pronunciations:
    """All pronunciations of a word as phones of the phone table; with `is_letter`, the names of the letter.

    Words outside the dictionary are pronounced by rule.

    Raises
    ------
    DataError
        No pronunciation is known.
    """
    from lexicon.dictionary import arpabet_segments

    if is_letter and word.lower() in LETTER_NAMES:
        found = [arpabet_segments(names) for names in LETTER_NAMES[word.lower()]]
    else:
        found = []
        while variant := cmudict_lookup(word if not found else f"{word}({len(found) + 1})"):
            found.append(variant)
    if not found:
        return (_pronounce_by_rule(word),)
    pronunciations = dict.fromkeys(tuple(segment.phone for segment in segments) for segments in found)
    plain = [phones for phones in pronunciations if phones[:2] != HW_CLUSTER]
    return tuple(plain or pronunciations)


def _pronounce_by_rule(word: str) -> tuple[str, ...]:
    from lexicon.pronounce import pronounce

    try:
        spoken = pronounce(word)
    except InputError as unsayable:
        raise DataError(f"no pronunciation is known for {word!r}; check the transcript's spelling") from unsayable
    return tuple(phone for part in spoken.words for phone in part.phones)


def _recordings_from_manifest(folder: Path, manifest: Path) -> tuple[Recording, ...]:
    head, *lines = read_table(manifest) or [[]]
    if not {"clip", "transcript"} <= set(head):
        raise DataError(f"{manifest} needs the columns clip and transcript in UTF-8; correct it")
    rows = [dict(zip(head, line, strict=False)) for line in lines]
    transcripts = {row["clip"]: row.get("transcript") for row in rows if "clip" in row}
    clips = folder / "clips"
    videos = _list_videos(clips if clips.is_dir() else folder)
    return tuple(
        Recording(video.stem, video, transcripts.get(video.name, transcripts.get(video.stem)), is_spelling=True)
        for video in videos
    )


def _recordings_without_manifest(folder: Path) -> tuple[Recording, ...]:
    return tuple(recording for video in _list_videos(folder) for recording in _recordings_in_video(video))


def _recordings_in_video(video: Path) -> Iterator[Recording]:
    """Recordings of a video: one for each cue of its subtitles, or the whole; damaged files are reported on reading."""
    subtitles = find_subtitles(video)
    try:
        cues = read_cues(subtitles) if subtitles else ()
    except DataError:
        cues = ()
    for number, cue in enumerate(cues, start=1):
        yield Recording(f"{video.stem}-{number:04d}", video, cue.text, span=(cue.begin, cue.end))
    if not cues:
        yield Recording(video.stem, video, subtitles or find_transcript(video))


def _list_videos(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in VIDEO_SUFFIXES)
