"""Words as people type them: thx, idk, sooooo, Shhh, W-w-what, and #throwbackthursday in its words.

``informal_words.tsv`` says what abbreviations of chats are; single letters between spaces are spelled.
"""

import functools
import re
from itertools import pairwise, product

from lexicon.dictionary import own_pronunciation, word_set
from lexicon.misaki import misaki_readings
from lexicon.written_forms import read_table

STRETCHED = re.compile(r"([^\W\d_])\1\1", re.IGNORECASE)
_RUN = re.compile(r"([^\W\d_])\1{2,}", re.IGNORECASE)
MAX_RUNS = 4  # of letters in a stretched word: 16 spellings
MAX_TAG_LETTERS = 40  # of a hashtag that is divided
# Short words that may stand in a hashtag; the dictionary's others are names of letters and abbreviations.
_SHORT = word_set(
    "a i am an as at be by do go he hi if in is it me my no of oh on or ox so to up us we you the and for but not all "
    "can her his him our out day get has how man new now old see two way who boy did its let put say she too use dad "
    "mom sun run fun ice sea sky car cat dog eat egg art big red hot job joy key kid law lip low map mix one own pet "
    "pop pro raw sad set six son spa tea ten top try war web wet win yes zen fit fan eye box bar bad ask air act add "
    "age ago aid aim bed bet bit buy cut die dry due end far few fly god got gym hit ill ink lot mad may met net nor "
    "odd off oil pay per pie rap rid row sex sit tax tip toy van via won yet"
)
# Letters before a hyphen that are no stutter.
_COMPOUNDS = word_set("t-test t-tests s-shaped d-day b-boy b-boys b-ball g-girl c-class e-edition p-p x-x")


@functools.lru_cache(maxsize=10_000)
def is_common(word: str) -> bool:
    """Whether a word in small letters is in the checked dictionary, itself or as a plural."""
    stem = word[:-1] if word.endswith("s") and len(word) > 3 else word
    return any(
        misaki_readings(form, grades=("gold",), is_exact=True)
        for form in dict.fromkeys((word, stem, word.capitalize()))
        if len(form) > 1
    )


@functools.lru_cache(maxsize=10_000)
def plain_word(word: str) -> str:
    """A stretched word in its spelling: sooooo is so, goooood good, Hmmmm Hmm; the word itself if none is known."""
    runs = list(_RUN.finditer(word))
    is_code = word.isupper() and len(word) < 4
    if not runs or len(runs) > MAX_RUNS or is_code or not word.isascii() or own_pronunciation(word):
        return word
    # two letters before one: cool is no col; in the end one is likelier (so, see by its other letter)
    spellings = []
    for lengths in product((2, 1), repeat=len(runs)):
        pieces, at = [], 0
        for run, length in zip(runs, lengths, strict=True):
            pieces += [word[at : run.start()], run[0][:length]]
            at = run.end()
        spellings.append("".join([*pieces, word[at:]]))
    known = (spelling for spelling in spellings if _is_known(spelling.lower()))
    return next(known, word)


def _is_known(word: str) -> bool:
    return own_pronunciation(word) is not None or bool(misaki_readings(word, grades=("gold",), is_exact=True))


@functools.lru_cache(maxsize=20_000)
def informal_word(word: str) -> str:
    """The words for which a word of chat stands: IDK, thanks; of a stretched one its spelling; else itself."""
    known = read_table("informal_words.tsv").get(word)
    if known:
        return known[0]
    return plain_word(word) if STRETCHED.search(word) else word


def read_stutter(m: re.Match[str], _: str) -> str:
    """W-w-what is what, I-I I I; t-test is none."""
    written = m.group()
    first, word = m["stutter"], m["stuttered"]
    if written.lower() in _COMPOUNDS or word.lower().startswith("shape"):
        return written
    if word.lower() == first.lower():
        return f"{first} {word}" if first in {"I", "a"} else written
    return word.capitalize() if first[:1].isupper() else word


@functools.lru_cache(maxsize=1000)
def tag_words(letters: str) -> str:
    """Words of a hashtag in small letters, the fewest known ones: throwbackthursday; itself if there are none."""
    if not 5 <= len(letters) <= MAX_TAG_LETTERS or not letters.isascii() or is_common(letters):
        return letters
    best: list[tuple[int, ...] | None] = [(0,)] + [None] * len(letters)
    for end in range(1, len(letters) + 1):
        for start in range(max(0, end - 16), end):
            before, word = best[start], letters[start:end]
            if before is None or not (word in _SHORT if len(word) < 4 else is_common(word)):
                continue
            # fewest words, then the longest first one
            cuts = (*before, end)
            known = best[end]
            if known is None or len(cuts) < len(known) or (len(cuts) == len(known) and cuts > known):
                best[end] = cuts
    found = best[-1]
    return letters if found is None else " ".join(letters[a:b] for a, b in pairwise(found))
