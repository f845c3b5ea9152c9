"""Names of speakers before the words of utterances, ``S1: bin red``, which nobody says."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from tts2face.interchange.subtitles.labels import find_speakers, split_label
from tts2face.interchange.transcripts.spoken import SpokenCue

MAX_NAMED = 6  # speakers in a note
# of programs that divide speakers; names of people are found as in subtitles
_NUMBERED = re.compile(r"((?:s|p|spk|spkr|speaker|sprecher|locuteur|hablante)[ _-]?\d{1,3})\s*:\s+", re.IGNORECASE)


def without_speakers(spoken: Sequence[SpokenCue]) -> tuple[list[SpokenCue], str]:
    """Utterances without the names of their speakers, and a sentence about these; empty without one."""
    names = find_speakers([cue.text for cue in spoken])
    said, found = [], Counter[str]()
    for cue in spoken:
        match = _NUMBERED.match(cue.text)
        label = (match[1], cue.text[match.end() :]) if match else split_label(cue.text, names.keys())
        if label is None or not (label[0] and label[1].strip()):
            said.append(cue)
            continue
        found[" ".join(label[0].split())] += 1
        said.append(replace(cue, text=label[1].strip()))
    if not found:
        return said, ""
    shown = ", ".join(f"{name} ({count})" for name, count in found.most_common(MAX_NAMED))
    more = f" and {len(found) - MAX_NAMED} more" if len(found) > MAX_NAMED else ""
    return said, f"speakers by names before a colon, which are not spoken: {shown}{more}"
