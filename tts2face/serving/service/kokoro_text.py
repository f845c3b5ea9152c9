"""Marks and phones as clients of Kokoro-FastAPI write them, as marks of this service.

``[pause:1.0s]`` is a pause, and ``[word](/ipa/)`` a word with its phones; elsewhere that is a link. What has another
form, as ``[word](/path)``, is one here, too.
"""

import re

from lexicon.errors import InputError
from lexicon.ipa import parse_ipa
from lexicon.text_marks import is_ssml

_PAUSE = re.compile(r"\[pause:([^\[\]\n]*+)(\]?)", re.IGNORECASE)
_SECONDS = re.compile(r"([0-9]{1,4}(?:\.[0-9]{1,9})?) ?s?", re.IGNORECASE)
_GIVEN = re.compile(r"\[([^\[\]\n]*+)\]\(/([^()\[\]/\n]*+)/\)")
FORM = "[word](/wˈɜɹd/)"
MAX_SHOWN = 60  # characters of a mark in a message
_PUNCTUATION = '.,;:!?…—"“”()'
# Letters of Kokoro's alphabet (misaki) that are not IPA.
_IPA = str.maketrans({
    "A": "eɪ", "I": "aɪ", "O": "oʊ", "Q": "əʊ", "W": "aʊ", "Y": "ɔɪ", "T": "ɾ", "ʤ": "dʒ", "ʧ": "tʃ",
    "ᵊ": "ə", "ᵻ": "ɪ",
})  # fmt: skip


def kokoro_ipa(written: str) -> str:
    """Phones in Kokoro's alphabet, or in IPA, as IPA."""
    return written.translate(_IPA)


def with_marks(text: str) -> str:
    """A text with the marks of this service in place of Kokoro-FastAPI's; SSML as it is.

    Examples
    --------
    >>> with_marks("A [pause:1.0s] [tomato](/təmˈɑːtO/), see [this](/a page).")
    'A [pause 1.0] [phoneme:təmˈɑːtoʊ]tomato[/phoneme], see [this](/a page).'
    """
    if is_ssml(text):
        return text
    return _GIVEN.sub(_given, _PAUSE.sub(_paused, text))


def _paused(match: "re.Match[str]") -> str:
    seconds = _SECONDS.fullmatch(match[1].strip())
    if seconds is None or not match[2]:
        raise InputError(f"cannot read the mark {match[0][:MAX_SHOWN]}; write a pause in seconds, as [pause:0.5s]")
    return f"[pause {seconds[1]}]"


def _given(match: "re.Match[str]") -> str:
    """A word with its phones."""
    shown, word = match[0][:MAX_SHOWN], match[1].strip()
    ipa = kokoro_ipa(match[2].strip())
    if not word:
        raise InputError(f"{shown} has phones and no word; write the word in the square brackets, as {FORM}")
    try:
        has_phones = bool(parse_ipa(ipa))
    except InputError as wrong:
        raise InputError(f"{shown}: {wrong}") from wrong
    if not has_phones:
        raise InputError(f"{shown} has no phones; write them in IPA or in Kokoro's alphabet, as {FORM}")
    return f"[phoneme:{ipa}]{match[1]}[/phoneme]"


def phones_text(phones: str) -> str:
    """A text of words with given phones, divided by spaces, with the punctuation around them.

    Examples
    --------
    >>> phones_text("həlˈO, wˈɜɹld!")
    '[phoneme:həlˈoʊ][/phoneme], [phoneme:wˈɜɹld][/phoneme]!'
    """
    words: list[str] = []
    for written in kokoro_ipa(phones).split():
        bare = written.lstrip(_PUNCTUATION)
        ipa = bare.rstrip(_PUNCTUATION)
        if not ipa:
            words.append(written)
        elif parse_ipa(ipa):
            words.append(f"{written[: len(written) - len(bare)]}[phoneme:{ipa}][/phoneme]{bare[len(ipa) :]}")
    if not any("phoneme" in word for word in words):
        raise InputError(f"there is no phone in {phones[:40]!r}; give words in IPA or in Kokoro's alphabet")
    return " ".join(words)
