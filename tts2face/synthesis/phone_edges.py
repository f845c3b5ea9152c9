"""Phone edges that a person has corrected, in place of those of the voice or of the alignment."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence

RECORDING = ""  # text of the one sentence of a recording
MAX_END_CHANGE_S = 0.05  # the last edge is the end of the sound, padded to a whole number of frames


class StaleEdgesError(InputError):
    """Corrected edges of a sentence that has other phones or another duration now."""

    def __init__(self, text: str, occurrence: int) -> None:
        self.text, self.occurrence = text, occurrence
        where = f"the sentence {text[:60]!r}" if text else "the recording"
        super().__init__(
            f"the corrected phone edges of {where} belong to other phones or to another sound; remove them, or "
            "restore the text, voice and pronunciations for which they were made"
        )


@dataclass(frozen=True, slots=True)
class SentenceEdges:
    """Corrected edges of one sentence.

    Parameters
    ----------
    text, occurrence
        Written sentence without its marks (`RECORDING` for a recording), and the number of equal sentences before it.
    phones
        The N phones for which the edges were corrected.
    edges
        N + 1 edges in seconds of the sentence, increasing from 0.

    Raises
    ------
    InputError
        The number is negative, or there is not one edge more than phones.
    """

    text: str
    occurrence: int
    phones: tuple[str, ...]
    edges: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse edges that do not fit the phones, and times that do not increase."""
        if self.occurrence < 0:
            raise InputError(f"the occurrence of a sentence must be 0 or more, not {self.occurrence}")
        PhoneSequence(self.phones, self.edges)

    def fits(self, phones: PhoneSequence) -> bool:
        """Whether a sentence has these phones and this duration."""
        has_end = abs(phones.end - self.edges[-1]) <= MAX_END_CHANGE_S and self.edges[-2] < phones.end
        return has_end and phones.phones == self.phones


def correct_phones(
    phones: PhoneSequence, text: str, occurrence: int, corrections: Sequence[SentenceEdges]
) -> PhoneSequence:
    """Phones of a sentence at their corrected edges, or as they are without a correction.

    Raises
    ------
    StaleEdgesError
        The correction belongs to other phones or to a sound of another length.
    """
    for one in corrections:
        if (one.text, one.occurrence) == (text, occurrence):
            if not one.fits(phones):
                raise StaleEdgesError(text, occurrence)
            return PhoneSequence(phones.phones, np.concatenate([one.edges[:-1], [phones.end]]))
    return phones
