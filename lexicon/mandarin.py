"""Characters of Mandarin by the reading that they have in their context, for espeak-ng, which knows one of each.

pypinyin reads the text by its dictionary of phrases. A character that espeak-ng 1.52 reads otherwise (还 in 还钱) is
replaced by one with the wanted reading alone (环); syllables that it lacks (xiong, qiong, jiong) by two characters.
``mandarin.tsv`` has, by syllable with tone: the characters for it, and those of more than one reading that espeak-ng
reads so; the row ``-`` those that it reads otherwise in any context. It was made of the readings of pypinyin 0.55
(MIT) and of espeak-ng 1.52 for the 6,763 characters of GB 2312 and the 5,401 common ones of Big5.
"""

import functools
from importlib import resources
from typing import Any, NamedTuple

_NEUTRAL = "5"


class _Readings(NamedTuple):
    """Characters for a syllable, and the syllable that espeak-ng says of a character of several readings."""

    homophone: dict[str, str]
    said: dict[str, str]


@functools.cache
def _readings() -> _Readings:
    lines = resources.files("lexicon").joinpath("mandarin.tsv").read_text(encoding="utf-8").splitlines()[1:]
    rows = [line.split("\t") for line in lines]
    return _Readings(
        {syllable: characters for syllable, characters, _ in rows if characters},
        {character: syllable for syllable, _, said in rows for character in said},
    )


@functools.lru_cache(maxsize=256)
def espeak_characters(text: str) -> tuple[str, ...]:
    """For each character of a text, those that espeak-ng is given."""
    homophone, said = _readings()
    if said.keys().isdisjoint(text):
        return tuple(text)
    found: list[str] = []
    for word, syllables in _words(text):
        for character, syllable in zip(word, syllables, strict=True):
            own = said.get(character, syllable)
            # particles stand alone: 慢慢地 is de, 土地 is di
            is_particle = len(word) == 1 and own.endswith(_NEUTRAL)
            is_known = own == syllable or is_particle or syllable not in homophone
            found.append(character if is_known else homophone[syllable])
    return tuple(found)


def _words(text: str) -> list[tuple[str, list[str]]]:
    """Words of a text with the syllable of each character; of other signs the sign."""
    from pypinyin import Style, pinyin
    from pypinyin.seg.mmseg import seg

    found: list[tuple[str, list[str]]] = []
    for word in seg.cut(text):
        read = pinyin(word, style=Style.TONE3, neutral_tone_with_five=True, errors=_characters)
        found.append((word, [syllables[0] for syllables in read]))
    return found


def _characters(signs: str) -> Any:
    """Signs without a reading, one by one; the library's annotation knows a string alone."""
    return list(signs)
