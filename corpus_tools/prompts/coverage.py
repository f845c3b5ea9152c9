"""Units of a text that a recording covers: phones, and triphones by the visemes of their three phones."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

from lexicon.phones import SILENCE, look_up_phone
from lexicon.pronounce import pronounce
from tts2face.exports.visemes import viseme_table

INVENTORY = "oculus"  # visemes, a class of every phone of the phone table; 15 with silence
Triphone = tuple[str, str, str]  # viseme before, visemes of the phone joined by "-", viseme behind


@dataclass(frozen=True, slots=True)
class Units:
    """What one sentence contains: its phones, and a triphone for each of them."""

    phones: tuple[str, ...]
    triphones: tuple[Triphone, ...]


@dataclass(frozen=True, slots=True)
class Coverage:
    """What sentences cover.

    Parameters
    ----------
    n_phones, of_phones
        Phones that occur, and those of the running text.
    n_triphones, of_triphones
        Classes of triphones that occur, and those of the running text.
    share
        Of the triphones of running text, by their frequency, that belong to a class that occurs.
    """

    n_phones: int
    of_phones: int
    n_triphones: int
    of_triphones: int
    share: float


@dataclass(frozen=True, slots=True)
class RunningText:
    """How often each phone and each class of triphones occurs in running text."""

    phones: Mapping[str, int]
    triphones: Mapping[Triphone, int]

    def coverage(self, sentences: Iterable[Units]) -> Coverage:
        """Coverage of this text by sentences."""
        phones: set[str] = set()
        triphones: set[Triphone] = set()
        for units in sentences:
            phones.update(units.phones)
            triphones.update(units.triphones)
        covered = sum(n for triphone, n in self.triphones.items() if triphone in triphones)
        return Coverage(
            n_phones=len(phones & self.phones.keys()),
            of_phones=len(self.phones),
            n_triphones=len(triphones & self.triphones.keys()),
            of_triphones=len(self.triphones),
            share=covered / max(sum(self.triphones.values()), 1),
        )


def sentence_units(text: str, language: str) -> Units:
    """Units of a sentence; there is silence before it, behind it and at its marks.

    Raises
    ------
    InputError
        The text contains no word, or the language does not exist or cannot read its letters.
    """
    phones: list[str] = [SILENCE]
    for word in pronounce(text, language).words:
        phones += [*word.phones, *([SILENCE] if word.mark else [])]
    if phones[-1] != SILENCE:
        phones.append(SILENCE)
    visemes = [_visemes(phone) for phone in phones]
    triphones = [
        (before[-1], "-".join(here), behind[0])
        for (before, here), (_, behind) in pairwise(pairwise(visemes))
        if here[0] != SILENCE
    ]
    return Units(tuple(phone for phone in phones if phone != SILENCE), tuple(triphones))


def count_units(sentences: Iterable[Units]) -> RunningText:
    """Counts of the units of sentences, in alphabetical order."""
    phones: Counter[str] = Counter()
    triphones: Counter[Triphone] = Counter()
    for units in sentences:
        phones.update(units.phones)
        triphones.update(units.triphones)
    return RunningText(dict(sorted(phones.items())), dict(sorted(triphones.items())))


def _visemes(phone: str) -> tuple[str, ...]:
    return viseme_table(INVENTORY)[look_up_phone(phone).symbol]
