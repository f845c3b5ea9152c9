"""Convert language names and tags (``EN``, ``en_US``, ``zh-Hans``, ``German``) to codes of espeak-ng."""

import difflib
import functools
import re
from collections.abc import Iterator
from types import MappingProxyType

from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE, languages

# Tags with another code in espeak-ng: languages without region, macrolanguages, withdrawn codes, and regions whose
# speech is closer to one variety of espeak-ng than to another.
CODES_OF_TAGS = MappingProxyType({
    "en": "en-us", "en-ca": "en-us", "en-uk": "en-gb", "en-au": "en-gb", "en-nz": "en-gb", "en-ie": "en-gb",
    "en-za": "en-gb", "en-in": "en-gb", "en-sg": "en-gb", "en-hk": "en-gb", "en-jm": "en-029", "en-tt": "en-029",
    "en-bb": "en-029", "en-scotland": "en-gb-scotland", "fr": "fr-fr", "fr-lu": "fr-be", "pt-pt": "pt",
    **dict.fromkeys(
        ["es-ar", "es-bo", "es-cl", "es-co", "es-cr", "es-cu", "es-do", "es-ec", "es-gt", "es-hn", "es-mx", "es-ni",
         "es-pa", "es-pe", "es-pr", "es-py", "es-sv", "es-us", "es-uy", "es-ve"], "es-419"),
    "zh": "cmn", "zh-hk": "yue", "zh-mo": "yue", "zh-yue": "yue", "zh-hak": "hak", "zh-latn": "cmn-latn-pinyin",
    "chr": "chr-US-Qaaa-x-west", "no": "nb", "nn": "nb", "iw": "he", "in": "id", "mo": "ro",
    "sh": "hr", "jp": "ja", "vi-central": "vi-vn-x-central", "vi-south": "vi-vn-x-south",
})  # fmt: skip
# English names that differ from those of espeak-ng, or that espeak-ng lists for several varieties.
CODES_OF_NAMES = MappingProxyType({
    "english": "en-us", "american english": "en-us", "us english": "en-us", "british english": "en-gb",
    "uk english": "en-gb", "scottish english": "en-gb-scotland", "french": "fr-fr", "belgian french": "fr-be",
    "swiss french": "fr-ch", "latin american spanish": "es-419", "mexican spanish": "es-419", "castilian": "es",
    "brazilian portuguese": "pt-br", "european portuguese": "pt", "brazilian": "pt-br", "chinese": "cmn",
    "mandarin": "cmn", "mandarin chinese": "cmn", "cantonese": "yue", "hakka": "hak", "norwegian": "nb",
    "bokmål": "nb", "irish": "ga", "irish gaelic": "ga", "scottish gaelic": "gd", "ancient greek": "grc",
    "modern greek": "el", "farsi": "fa", "burmese": "my", "flemish": "nl", "maori": "mi", "sinhalese": "si",
    "valencian": "ca-va", "slovene": "sl", "oriya": "or", "odia": "or", "kirghiz": "ky", "uighur": "ug",
})  # fmt: skip
_SUBTAGS = re.compile(r"[a-z]{2,8}(?:-[a-z0-9]{1,8})*")
_LOCALE_END = re.compile(r"[.@].*")  # of a POSIX locale: en_US.UTF-8, de_DE@euro
_SCRIPT = re.compile(r"[a-z]{4}")
# similar languages in a refusal
MAX_HINTS = 4


def language_code(written: str) -> str:
    """The espeak-ng code of a language: from the code itself, a BCP 47 tag, a POSIX locale, or its English name.

    Case is ignored, and ``_`` is read as ``-``. A tag that espeak-ng does not have falls back to a shorter one: without
    its script, then without its last parts (RFC 4647, lookup).

    Examples
    --------
    >>> [language_code(written) for written in ("en_US", "pt-BR", "zh-Hans", "de-AT", "German")]
    ['en-us', 'pt-br', 'cmn', 'de', 'de']

    Raises
    ------
    InputError
        It matches no language of espeak-ng, or several; the message names similar ones.
    """
    if written == DEFAULT_LANGUAGE:  # espeak-ng need not be loaded
        return written
    name = " ".join(written.casefold().split())
    by_code = {code.casefold(): code for code in languages()}
    tag = _LOCALE_END.sub("", name).replace("_", "-")
    if _SUBTAGS.fullmatch(tag):
        for shorter in _fallbacks(tag):
            code = CODES_OF_TAGS.get(shorter, shorter)
            if code.casefold() in by_code:
                return by_code[code.casefold()]
    named = _codes_of_names().get(name, ())
    if len(named) == 1:
        return named[0]
    close = [f"{code} ({languages()[code]})" for code in named or _close_codes(name)]
    hint = f"did you mean {', '.join(close)}?" if close else "`tts2face languages` lists all languages"
    raise InputError(f"there is no language {written[:40]!r}; {hint}")


def _fallbacks(tag: str) -> Iterator[str]:
    """A tag, then shorter ones: without its script, and part by part from its end."""
    subtags = tag.split("-")
    while subtags:
        yield "-".join(subtags)
        if len(subtags) > 2 and _SCRIPT.fullmatch(subtags[1]):
            yield "-".join([subtags[0], *subtags[2:]])
        subtags.pop()


@functools.cache
def _codes_of_names() -> dict[str, tuple[str, ...]]:
    """Codes by English name in lower case: espeak-ng's names, with and without parentheses, and `CODES_OF_NAMES`."""
    known = languages()
    found: dict[str, tuple[str, ...]] = {}
    for code in sorted(known, key=len):
        base = known[code].casefold().partition(" (")[0]
        before = found.get(base, ())
        if not before or len(code) == len(before[0]):  # the variety with the shortest code
            found[base] = (*before, code)
    found |= {name.casefold(): (code,) for code, name in known.items()}
    return found | {name: (code,) for name, code in CODES_OF_NAMES.items() if code in known}


def _close_codes(query: str) -> list[str]:
    """Codes whose spelling or name is similar to `query`."""
    names = _codes_of_names()
    near = [code for name, codes in names.items() if len(query) > 2 and name.startswith(query) for code in codes]
    near += [code for name in difflib.get_close_matches(query, names, n=3, cutoff=0.7) for code in names[name]]
    near += difflib.get_close_matches(query, list(languages()), n=3, cutoff=0.6)
    return list(dict.fromkeys(near))[:MAX_HINTS]
