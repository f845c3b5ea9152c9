"""CTM of NIST's scoring tools and of recognisers: file, channel, start, length and word a line."""

from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

N_FIELDS = 5  # a sixth is the confidence


def read_ctm(path: Path) -> list[Tier]:
    """Words of each channel of a recording; of alternatives the first."""
    channels: dict[tuple[str, str], list[SpokenCue]] = {}
    is_other = False  # within the second and further alternatives
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        fields = line.split()
        if not fields or line.startswith((";;", "#")):
            continue
        if len(fields) >= N_FIELDS and fields[4].startswith("<ALT"):
            is_other = fields[4] == "<ALT>"
            continue
        if is_other:
            continue
        try:
            start, length = float(fields[2]), float(fields[3])
            cue = SpokenCue(start, start + length, fields[4])
        except (IndexError, ValueError) as wrong:
            reason = f"{line[:60]!r} is not file, channel, start, length and word"
            raise DataError(f"{path}, line {number}: {reason}; correct it") from wrong
        channels.setdefault((fields[0], fields[1]), []).append(cue)
    return tiers_of_file(path, channels)


def tiers_of_file(path: Path, rows: dict[tuple[str, str], list[SpokenCue]]) -> list[Tier]:
    """Tiers of the recording of the path's name, from labels by names of a recording and of a tier.

    A file with the labels of one recording is of that one, whatever its name.
    """
    names = list(dict.fromkeys(Path(recording).stem for recording, _ in rows))
    named = next((name for name in names if name.casefold() == path.stem.casefold()), None)
    if named is None and len(names) > 1:
        raise DataError(f"{path} has the words of {names[0]}, {names[1]} ..., and not of {path.stem}; rename one")
    return [
        Tier(tier, tuple(cues), is_speech=True)
        for (recording, tier), cues in rows.items()
        if named is None or Path(recording).stem == named
    ]
