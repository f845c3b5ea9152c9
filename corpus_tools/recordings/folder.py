"""Folders of recordings: their videos and transcripts."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from corpus_tools.recordings.subtitle_cues import find_subtitles, read_cues, subtitle_notes
from corpus_tools.recordings.transcripts import passed_over, read_transcript
from lexicon.dictionary import cmudict_lookup
from lexicon.errors import DataError, InputError
from lexicon.function_words import fitting_forms
from lexicon.normalize import normalize
from lexicon.values.tables import read_table
from tts2face.interchange.subtitles.film_track import has_text_track
from tts2face.interchange.transcripts.beside import find_transcript
from tts2face.interchange.transcripts.written_words import WrittenWords
from tts2face.sound.word_lattice import PronouncedWords, Pronunciations

VIDEO_SUFFIXES = frozenset({".mkv", ".mp4", ".mov", ".webm", ".avi", ".mpg", ".mpeg", ".m4v", ".ts", ".mts"})
MANIFEST = "manifest.csv"
MAX_NOTES = 12  # about transcripts of a folder
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
    ``span`` are the seconds of the video, None for all. ``words`` are its pronounced words if already known. ``tier``
    names the tier of the words in files that have several, None: the likely one.
    """

    name: str
    video: Path
    transcript: str | Path | None
    is_spelling: bool = False
    span: tuple[float, float] | None = None
    words: PronouncedWords | None = None
    tier: str | None = None


def find_recordings(folder: Path, tier: str | None = None) -> tuple[Recording, ...]:
    """Recordings of a folder sorted by name, or those of one video.

    Two layouts are supported: ``manifest.csv`` (columns clip, transcript) beside a folder ``clips``, as for the GRID
    corpus, where single letters are names of letters; and videos with subtitles (.srt, .vtt; each cue is a recording)
    or a transcript (`tts2face.interchange.transcripts.beside.SUFFIXES`) of the same name.

    Parameters
    ----------
    tier
        Name of the tier of the words in TextGrids and other files of tiers; None: the likely one of each.

    Raises
    ------
    InputError
        There is no such folder, or no video in it.
    DataError
        The manifest cannot be read.
    """
    if folder.is_file() and folder.suffix.lower() in VIDEO_SUFFIXES:
        return tuple(_recordings_in_video(folder, tier))
    if not folder.is_dir():
        raise InputError(f"there is no folder {folder}; give the folder of recordings")
    manifest = folder / MANIFEST
    found = (
        _recordings_from_manifest(folder, manifest)
        if manifest.is_file()
        else tuple(recording for video in _list_videos(folder) for recording in _recordings_in_video(video, tier))
    )
    if not found:
        raise InputError(
            f"{folder} contains no video ({', '.join(sorted(VIDEO_SUFFIXES))}); give a folder of recordings"
        )
    return found


def pronounce_recording(recording: Recording) -> PronouncedWords | None:
    """The words of a transcript with their pronunciations; None without a transcript."""
    if recording.words is not None or recording.transcript is None:
        return recording.words
    content = _written(recording).text
    text = content if recording.is_spelling else normalize(content)
    words = re.findall(r"[^\W_]+(?:['’][^\W_]+)*", text)
    if not words:
        raise DataError(f"the transcript of {recording.name} contains no word; write the spoken words into it")
    return fitting_forms(
        [(word, look_up_pronunciations(word, is_letter=recording.is_spelling and len(word) == 1)) for word in words]
    )


def recording_notes(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Sentences about what is read of the recordings' transcripts, and about files beside them that are not read."""
    # a text in place of a file has no span
    with_files = {
        recording.video: None
        for recording in recordings
        if not isinstance(recording.transcript, str) or recording.span is not None
    }
    # recordings with times but no file have those of the video's own track
    tracks = {recording.video for recording in recordings if recording.span is not None}
    notes: dict[str, None] = dict.fromkeys(
        note for video in with_files for note in subtitle_notes(video, has_track=video in tracks)
    )
    for recording in recordings:
        try:
            notes.update(dict.fromkeys(_written(recording).notes))
        except DataError:
            continue  # said where the recording is read
    read: set[Path | None] = {
        recording.transcript for recording in recordings if isinstance(recording.transcript, Path)
    }
    read |= {find_subtitles(recording.video) for recording in recordings if recording.span is not None}
    over = passed_over({recording.video for recording in recordings}, [path for path in read if path])
    left = len(notes) - MAX_NOTES
    more = (f"the same of {left} more",) if left > 0 else ()
    return (*[*notes][:MAX_NOTES], *more, *([over] if over else []))


def _written(recording: Recording) -> WrittenWords:
    if isinstance(recording.transcript, Path):
        return read_transcript(recording.transcript, recording.tier)
    return WrittenWords(recording.transcript or "")


def look_up_pronunciations(word: str, *, is_letter: bool) -> Pronunciations:
    """All pronunciations of a word as phones of the phone table; with `is_letter`, the names of the letter.

    Words outside the dictionary are pronounced by rule.
    """
    from lexicon.dictionary import arpabet_segments

    if is_letter and word.lower() in LETTER_NAMES:
        found = [arpabet_segments(names) for names in LETTER_NAMES[word.lower()]]
    else:
        found = []
        # CMUdict numbers further pronunciations: read, read(2), read(3)
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


def _recordings_in_video(video: Path, tier: str | None) -> Iterator[Recording]:
    """Recordings of a video: one for each cue of its subtitles, or the whole; damaged files are reported on reading."""
    subtitles = find_subtitles(video)
    transcript = None if subtitles else find_transcript(video)
    has_track = subtitles is None and transcript is None and has_text_track(video)
    source = video if has_track else subtitles
    try:
        cues = read_cues(source) if source else ()
    except DataError:
        cues = ()
    for number, cue in enumerate(cues, start=1):
        yield Recording(f"{video.stem}-{number:04d}", video, cue.text, span=(cue.start, cue.end))
    if not cues:
        yield Recording(video.stem, video, subtitles or transcript, tier=tier)


def _list_videos(folder: Path) -> list[Path]:
    # sorted: folders list their files in any order
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in VIDEO_SUFFIXES)
