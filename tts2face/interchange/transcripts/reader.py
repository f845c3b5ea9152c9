"""Reading of transcripts with times: the words of one tier, without silences, in the order of time.

How the next format is made (the choice of the tier, silences, overlaps and times within utterances are shared):

1. A function from the path of a file to its `Tier` objects, with seconds, in a module of its own here, as
   `tts2face.interchange.transcripts.label_table` does; a DataError only where nothing can be read.
2. Its row in `READERS`, by its ending; beside videos, files are preferred in the order of the rows.
3. Its name in docs/recordings.md, its row in docs/compatibility.md, and its file in tests/interchange/transcripts.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

from lexicon.errors import DataError
from tts2face.interchange.transcripts.chat import read_cha
from tts2face.interchange.transcripts.ctm import read_ctm
from tts2face.interchange.transcripts.elan import read_eaf
from tts2face.interchange.transcripts.exmaralda import read_exb
from tts2face.interchange.transcripts.file_text import decode_text, read_text
from tts2face.interchange.transcripts.grid_align import read_align
from tts2face.interchange.transcripts.htk import is_label_file, is_unnamed_label_file, read_lab
from tts2face.interchange.transcripts.label_table import is_label_table, read_label_table
from tts2face.interchange.transcripts.recogniser_json import is_recogniser_json, read_recogniser_json
from tts2face.interchange.transcripts.silence import spoken_label
from tts2face.interchange.transcripts.speakers import without_speakers
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier, Transcript
from tts2face.interchange.transcripts.stm import read_stm
from tts2face.interchange.transcripts.textgrid import is_textgrid, read_textgrid
from tts2face.interchange.transcripts.tiers import choose_tier, has_words, name_tiers
from tts2face.interchange.transcripts.timit import is_timit_prompt, read_timit
from tts2face.interchange.transcripts.utterances import shared_words

TEXT_SUFFIX = ".txt"
BY_CONTENT = frozenset({".lab", ".rec", ".tsv", ".json"})  # also plain words, as the Montreal Forced Aligner reads .lab
PLAIN_SUFFIXES = frozenset({"", ".ssml", ".md", ".xml"})  # of texts to speak, whatever their lines look like
OVERLAP_S = 1e-3  # edges that differ by less are one edge, rounded twice
MAX_NAMED = 6  # labels in a note
ReadTiers = Callable[[Path], list[Tier]]
READERS: Mapping[str, ReadTiers] = MappingProxyType(
    {
        ".textgrid": read_textgrid,
        ".align": read_align,
        ".eaf": read_eaf,
        ".exb": read_exb,
        ".cha": read_cha,
        ".ctm": read_ctm,
        ".stm": read_stm,
        ".wrd": read_timit,
        ".lab": read_lab,
        ".rec": read_lab,
        ".tsv": read_label_table,
        ".json": read_recogniser_json,
    }
)
_MARKS: Mapping[str, ReadTiers] = MappingProxyType(
    {
        "<ANNOTATION_DOCUMENT": read_eaf,
        "<basic-transcription": read_exb,
        "@Begin\n": read_cha,
    }
)
HEAD_CHARACTERS = 2000  # within which a mark stands


def read_transcript(path: Path, tier: str | None = None) -> Transcript:
    """Words of a transcript with their times, by its content where that is unmistakable, else by its ending.

    Parameters
    ----------
    tier
        Name of the tier of the words; None: it is chosen by names and content, and a note says which.

    Raises
    ------
    InputError
        There is no such tier.
    DataError
        The file cannot be read, or has no word.
    """
    read = find_reader(path)
    if read is None:
        raise DataError(f"{path} is no transcript with times; give one of {', '.join(READERS)}")
    tiers = read(path)
    chosen, choice = choose_tier(path.name, tiers, tier)
    if chosen is None:
        raise DataError(_no_words(path, tiers))
    spoken, left_out = _spoken_labels(chosen)
    if not spoken:
        raise DataError(f"{path} contains no word; check the file")
    spoken, speakers = without_speakers(spoken)
    words, shared = shared_words(spoken)
    notes = (
        encoding_note(path),
        choice,
        *chosen.notes,
        _overlap_note(path, spoken),
        _left_out_note(path, left_out),
        speakers and f"{path.name}: {speakers}",
        shared and f"{path.name}: {shared}",
    )
    return Transcript(words, tuple(note for note in notes if note))


def encoding_note(path: Path) -> str:
    """A sentence about the encoding of a text, if it was guessed; empty if it was not."""
    try:
        decoded = decode_text(path)
    except DataError:
        return ""  # a binary TextGrid; what cannot be read is said where it is read
    if not decoded.is_guess:
        return ""
    return f"the encoding of {path.name} is not stated and was guessed as {decoded.encoding}; save it as UTF-8"


def find_reader(path: Path) -> ReadTiers | None:
    """The reader of a file, by its ending, in other texts by its content; None for plain text and other files."""
    suffix = path.suffix.lower()
    if suffix in PLAIN_SUFFIXES:
        return None
    if suffix in READERS and suffix not in BY_CONTENT:
        return READERS[suffix]
    text = read_text(path)
    if suffix in {".lab", ".rec"} and is_label_file(text):
        return read_lab
    return find_reader_of_text(text)


def find_reader_of_text(text: str) -> ReadTiers | None:
    """The reader of a file that shows what it is, whatever its name; None for plain text."""
    if is_textgrid(text):
        return read_textgrid
    head = text.lstrip("\ufeff \t\r\n")[:HEAD_CHARACTERS]
    for mark, read in _MARKS.items():
        if mark in head:
            return read
    if is_timit_prompt(text):
        return read_timit
    if is_recogniser_json(text):
        return read_recogniser_json
    if is_unnamed_label_file(text):
        return read_lab
    return read_label_table if is_label_table(text) else None


def _spoken_labels(tier: Tier) -> tuple[list[SpokenCue], Counter[str]]:
    """Labels with words in the order of time, and how often what is no word occurs."""
    spoken, left_out = [], Counter[str]()
    for label in tier.labels:
        found = spoken_label(label.text)
        left_out.update(found.left_out)
        if found.spoken:
            spoken.append(SpokenCue(label.start, label.end, found.spoken))
    return sorted(spoken, key=lambda cue: cue.start), left_out


def _no_words(path: Path, tiers: list[Tier]) -> str:
    full = [tier for tier in tiers if has_words(tier)]
    if not full:
        return f"{path} contains no word; check the file"
    if any(tier.name for tier in tiers):
        return f"{path} has no tier with words; {name_tiers(full)} seems to hold phones or notes, --tier takes it yet"
    return f"{path} seems to hold phones and no words; write the words into a .txt beside it"


def _left_out_note(path: Path, left_out: Counter[str]) -> str:
    if not left_out:
        return ""
    named = [f"{label} ({count})" for label, count in left_out.most_common(MAX_NAMED)]
    more = f" and {len(left_out) - MAX_NAMED} more" if len(left_out) > MAX_NAMED else ""
    return f"silence and noise in {path.name}, not words: {', '.join(named)}{more}"


def _overlap_note(path: Path, spoken: list[SpokenCue]) -> str:
    overlaps = list(_overlaps(spoken))
    if not overlaps:
        return ""
    first, second = overlaps[0]
    return (
        f"{len(overlaps)} labels of {path.name} begin before the one before them ends, the first {second.text[:40]!r} "
        f"at {second.start:.2f} s before the end of {first.text[:40]!r} at {first.end:.2f} s; words are taken in the "
        "order of their starts"
    )


def _overlaps(spoken: list[SpokenCue]) -> Iterator[tuple[SpokenCue, SpokenCue]]:
    for first, second in pairwise(spoken):
        if second.start < first.end - OVERLAP_S:
            yield first, second
