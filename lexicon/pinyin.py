"""Chinese names in Latin letters, as English speakers read them: Xiaoming, Zhengzhou, Anqi.

Letters that no English name has (x before i, zh, q before i) tell them, where the whole word is made of syllables of
Mandarin. Values after the Oxford BBC Guide to Pronunciation (2006); the stress is on the last syllable.
"""

import re
from types import MappingProxyType

from lexicon.dictionary import arpabet_segments
from lexicon.ipa import IpaPhone

_INITIALS = MappingProxyType({
    "zh": "JH", "ch": "CH", "sh": "SH", "b": "B", "p": "P", "m": "M", "f": "F", "d": "D", "t": "T", "n": "N", "l": "L",
    "g": "G", "k": "K", "h": "HH", "j": "JH", "q": "CH", "x": "SH", "r": "R", "z": "Z", "c": "T S", "s": "S", "y": "Y",
    "w": "W",
})  # fmt: skip
_FINALS = MappingProxyType({
    "iang": "Y AA1 NG", "iong": "Y UH1 NG", "uang": "W AA1 NG", "ang": "AA1 NG", "eng": "AH1 NG", "ing": "IH1 NG",
    "ong": "UH1 NG", "ian": "Y EH1 N", "iao": "Y AW1", "uai": "W AY1", "uan": "W AA1 N", "ai": "AY1", "ei": "EY1",
    "ao": "AW1", "ou": "OW1", "an": "AA1 N", "en": "AH1 N", "in": "IH1 N", "un": "UH1 N", "ia": "Y AA1", "ie": "Y EH1",
    "iu": "Y OW1", "ua": "W AA1", "ui": "W EY1", "uo": "W OW1", "ue": "W EH1", "a": "AA1", "e": "AH1", "i": "IY1",
    "o": "OW1", "u": "UW1",
})  # fmt: skip
_SYLLABLE = f"({'|'.join(_INITIALS)})({'|'.join(_FINALS)})"
_NAME = re.compile(f"(?!.*nn)(?:{_SYLLABLE}|(ai|an|en|a|e)){_SYLLABLE}(?:{_SYLLABLE})?")
_TELLING = re.compile(r"^x[iu]|zh|qi|[ng]xi|xi(?:a|ong)")
_AFTER_PALATAL = re.compile(r"(?<=[SCJ]H )Y (?=AA|AW|OW|UH|EH1$)")  # Qiang is CH AA NG


def read_pinyin(word: str) -> tuple[IpaPhone, ...]:
    """English phones of a Chinese name; none for other words."""
    lower = word.lower()
    name = _NAME.fullmatch(lower) if _TELLING.search(lower) else None
    if name is None:
        return ()
    parts = [part for part in name.groups() if part]
    said = [_INITIALS.get(part) or _FINALS[part] for part in parts]
    phones = _AFTER_PALATAL.sub("", " ".join(said)).split()
    last = max(at for at, phone in enumerate(phones) if phone.endswith("1"))
    phones = [phone.replace("1", "0") if at < last else phone for at, phone in enumerate(phones)]
    return arpabet_segments(" ".join(phones))
