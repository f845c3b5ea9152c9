"""STM of NIST's scoring tools: file, channel, speaker, start, end and the words of an utterance a line."""

import re
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.transcripts.ctm import tiers_of_file
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.silence import without_variants
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

_LINE = re.compile(r"(\S+)\s+(\S+)\s+(\S+)\s+(\d+(?:\.\d*)?|\.\d+)\s+(\d+(?:\.\d*)?|\.\d+)(?:\s+<[^<>]*>)?(?:\s+(.*))?")
UNSPOKEN = frozenset({"ignore_time_segment_in_scoring", "inter_segment_gap", "excluded_region"})
_ALTERNATIVES = re.compile(r"\{\s*([^/{}]*?)\s*/[^{}]*\}")  # { first / second / @ }
_HESITATION = re.compile(r"\(?%\w+\)?")  # (%hesitation)
_OPTIONAL = re.compile(r"\(([^()]*)\)")  # words that may be missing in an answer


def read_stm(path: Path) -> list[Tier]:
    """Utterances of each speaker of a recording; of alternatives the first."""
    speakers: dict[tuple[str, str], list[SpokenCue]] = {}
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip() or line.startswith(";;"):
            continue
        match = _LINE.fullmatch(line.strip())
        if match is None:
            reason = f"{line[:60]!r} is not file, channel, speaker, start, end and words"
            raise DataError(f"{path}, line {number}: {reason}; correct it")
        start, end = float(match[4]), float(match[5])
        words = (match[6] or "").strip()
        if words.casefold() in UNSPOKEN:
            continue
        words = without_variants(_HESITATION.sub("", _ALTERNATIVES.sub(r"\1", words)))
        words = _OPTIONAL.sub(r"\1", words)
        speakers.setdefault((match[1], match[3]), []).append(SpokenCue(start, end, words))
    return tiers_of_file(path, speakers)
