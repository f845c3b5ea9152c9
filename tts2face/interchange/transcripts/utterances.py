"""Times of the words of an utterance that has only its own: shares by nominal lengths."""

from collections.abc import Sequence
from itertools import accumulate, pairwise

from lexicon.dictionary import cmudict_lookup
from lexicon.nominal_durations import NOMINAL_S
from lexicon.phones import PHONES
from tts2face.interchange.transcripts.spoken import SpokenCue

LETTER_S = 0.07  # nominal length of a letter of a word that is in no dictionary


def shared_words(labels: Sequence[SpokenCue]) -> tuple[tuple[SpokenCue, ...], str]:
    """One cue a word, and a sentence about labels of several words, which share their time; empty without one."""
    words = [word for label in labels for word in _divided(label)]
    n_shared = sum(len(label.text.split()) > 1 for label in labels)
    if not n_shared:
        return tuple(words), ""
    kind = "utterance shares its time among its" if n_shared == 1 else "utterances share their times among their"
    return tuple(words), f"{n_shared} {kind} words by nominal lengths, as the words have no times of their own"


def _divided(label: SpokenCue) -> list[SpokenCue]:
    # punctuation alone takes no time; a label of nothing else stays whole
    words = [word for word in label.text.split() if any(map(str.isalnum, word))] or [label.text]
    return [SpokenCue(*span, word) for word, span in zip(words, share_time(label.start, label.end, words), strict=True)]


def share_time(start: float, end: float, texts: Sequence[str]) -> list[tuple[float, float]]:
    """Spans of consecutive texts from `start` to `end`, in seconds, in proportion to their nominal lengths."""
    lengths = list(accumulate((sum(map(nominal_length, text.split())) or LETTER_S for text in texts), initial=0.0))
    scale = (end - start) / lengths[-1]
    # the last edge is the end itself, free of rounding
    edges = [*(start + length * scale for length in lengths[:-1]), end]
    return list(pairwise(edges))


def nominal_length(word: str) -> float:
    """Seconds of a word by its phones, or by its letters where the dictionary lacks it; above 0."""
    found = cmudict_lookup("".join(letter for letter in word if letter.isalnum() or letter in "'’").lower())
    if found:
        return sum(NOMINAL_S[PHONES[segment.phone].kind] for segment in found)
    return LETTER_S * max(sum(letter.isalnum() for letter in word), 1)
