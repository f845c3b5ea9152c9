"""Phone edges of sentences that were corrected by hand."""

from dataclasses import dataclass

import numpy as np

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from lexicon.values.fields import check_fields

RECORDING = ""  # text of the one sentence of a recording
MAX_END_CHANGE_S = 0.05  # the last edge is the end of the sound; older projects padded it to a whole frame
EQUAL_EDGES_S = 1e-3  # by which edges of one sound differ, as its start is cut at a sample


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
        """Refuse other types, edges that do not fit the phones, and times that do not increase."""
        check_fields(self)
        if self.occurrence < 0:
            raise InputError(f"the occurrence of a sentence must be 0 or more, not {self.occurrence}")
        PhoneSequence(self.phones, self.edges)

    def applied(self, phones: PhoneSequence) -> PhoneSequence | None:
        """The phones of a sentence at the corrected edges; None if it has other phones or another sound.

        The first sentence of a clip has less silence before it than the same one elsewhere: edges move with the sound,
        which is the same where at least half of them were not corrected.
        """
        if phones.phones != self.phones:
            return None
        own = np.array(self.edges)
        later = phones.edges[1:-1] - own[1:-1]
        if abs(phones.end - own[-1]) > MAX_END_CHANGE_S and len(later) and phones.phones[0] == SILENCE:
            shift = float(np.median(later))
            # most edges agree about a shift: the start of the sound was cut, and nothing else changed
            if 2 * np.count_nonzero(np.abs(later - shift) <= EQUAL_EDGES_S) >= len(later):
                own[1:] += shift
        if abs(phones.end - own[-1]) > MAX_END_CHANGE_S or own[-2] >= phones.end or own[1] <= 0.0:
            return None
        own[-1] = phones.end
        return PhoneSequence(phones.phones, own)
