"""Phones of English words that no dictionary has and that have no known parts: by spelling, with espeak-ng."""

import re
from collections.abc import Sequence
from types import MappingProxyType

from lexicon.english import fold_to_arpabet
from lexicon.foreign_spellings import read_foreign_spelling
from lexicon.g2p import DEFAULT_LANGUAGE, segments_by_rules
from lexicon.ipa import IpaPhone

# Two consonants with which no English word begins: espeak-ng spells the first of them (vlog, Zlatan, Dnipro).
_ODD_START = re.compile(
    r"(?:v(?=[lr][aeiouy])|z(?=[bdgklmnrvw][aeiouylr])|t(?=ch)|t(?=[zslnm][aeiouyhw])|d(?=[nlv][aeiouyi])|"
    r"k(?=[vtsj][aeiouy])|c(?=[tsv][aeiouyi])|g(?=[vdz][aeiouy])|s(?=[vbr][aeiouy])|chth|phth)",
    re.IGNORECASE,
)
_SOUND_OF_START = MappingProxyType({
    "v": "v", "z": "z", "t": "t", "d": "d", "k": "k", "c": "k", "g": "ɡ", "s": "s", "chth": "θ", "phth": "θ",
})  # fmt: skip
_NAME_IN_S = re.compile(r"[A-Z].*[^s][aiouy]s")


def read_unlisted_words(words: Sequence[str]) -> tuple[tuple[IpaPhone, ...], ...]:
    """Phones of each word in CMUdict's inventory; empty for a word that cannot be read."""
    foreign = [read_foreign_spelling(word) for word in words]
    starts = [_ODD_START.match(word) for word in words]
    rests = [word[start.end() :] if start else word for word, start in zip(words, starts, strict=True)]
    by_rules = segments_by_rules(rests, DEFAULT_LANGUAGE)
    found = []
    for word, start, own, said in zip(words, starts, foreign, by_rules, strict=True):
        segments = own or fold_to_arpabet(said)
        if not own and start and segments and segments[0].phone != "tʃ":
            segments = (IpaPhone(_SOUND_OF_START[start[0].lower()]), *segments)
        # Texas, Carlos, Davis: no plural
        if segments and segments[-1].phone == "z" and _NAME_IN_S.fullmatch(word):
            segments = (*segments[:-1], IpaPhone("s"))
        found.append(segments)
    return tuple(found)
