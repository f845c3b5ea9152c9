"""Prompts for a number of minutes: shipped ones in American English, or from a text of the user's.

Sentences of a text that are easy to read aloud.

Write the shipped English prompts: ``python -m corpus_tools.prompts.prompts BOOK ...``.

Candidates are easy sentences of frequent words without names, from public-domain books, which NOTICE.md names. The
result was read by a person, whose objections are `REJECTED_WORDS` and `REJECTED_PARTS`.
"""

import functools
import math
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from corpus_tools.prompts.coverage import Coverage, RunningText, Units, count_units, select_sentences, sentence_units
from lexicon.chunks import split_chunks
from lexicon.dictionary import cmudict_lookup
from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE, check_language
from lexicon.values.files import read_text
from tts2face.storage.files import write_atomically

MIN_WORDS, MAX_WORDS = 5, 12
LONGEST_SENTENCE = 400  # characters; longer ones are cut, and have too many words anyway
_WORD = re.compile(r"[^\W\d_]+(?:['’-][^\W\d_]+)*")
_OTHER_SIGNS = re.compile(r"""[^\w\s',.?!¿¡’、。？！।؟،-]|[\d_]|--|[.?!][.?!\s]""")
_BLANK_LINES = re.compile(r"\n\s*\n")
_QUOTES = re.compile(r"""^["'“‘«„`\s]+|["'”’»“`\s]+$""")


def easy_sentences(text: str, language: str) -> Iterator[str]:
    """Sentences of `MIN_WORDS` to `MAX_WORDS` words, without numbers, brackets and quotations inside; each once.

    In texts without spaces between words, as in Japanese, every sentence that is not longer than its limit.
    """
    found: set[str] = set()
    for paragraph in _BLANK_LINES.split(text):
        for piece in split_chunks(paragraph, LONGEST_SENTENCE, language):
            sentence = _QUOTES.sub("", piece)
            key = sentence.casefold()
            if key not in found and _is_easy(sentence):
                found.add(key)
                yield sentence


def words_of(text: str) -> list[str]:
    """Words of a text in lower case."""
    return [word.casefold().replace("’", "'") for word in _WORD.findall(text)]


def count_words(text: str) -> Counter[str]:
    """How often each word occurs in lower case: names have a count of 0."""
    return Counter(word for word in _WORD.findall(text) if word == word.casefold())


def _is_easy(sentence: str) -> bool:
    if _OTHER_SIGNS.search(sentence) or not sentence[:1].isalpha() or sentence[0] != sentence[0].upper():
        return False
    return sentence[-1] in ".?!。？！।؟" and MIN_WORDS <= _n_words(sentence) <= MAX_WORDS


def _n_words(sentence: str) -> int:
    """Number of words; that of syllables by estimate where words are not separated."""
    words = _WORD.findall(sentence)
    is_separated = " " in sentence or not any(ord(letter) >= 0x2E80 for letter in sentence)
    return len(words) if is_separated else sum(map(len, words)) // 2


POOL = Path(__file__).with_name("prompts_en_us.tsv")  # written by `write_prompts`, best first
UNIT_COUNTS = Path(__file__).with_name("running_text_en_us.tsv")
MAX_MINUTES = 60.0
MAX_CANDIDATES = 20_000  # sentences of a text that are compared, evenly over it
_MINUTES, _N_PROMPTS = (0.0, 2.0, 5.0, 10.0, 60.0), (0.0, 25.0, 60.0, 120.0, 720.0)  # about 5 s a prompt


@dataclass(frozen=True, slots=True, eq=False)
class Prompts:
    """Sentences to read aloud, best first, with their units, and the counts of running text of their language."""

    language: str
    texts: tuple[str, ...]
    units: tuple[Units, ...]
    running: RunningText

    def coverage_by_minute(self) -> tuple[tuple[int, int, Coverage], ...]:
        """Minute, number of prompts until then, and what they cover, for each minute."""
        counts = [n_prompts(minute) for minute in range(1, math.ceil(MAX_MINUTES) + 1)]
        last = next(at for at, n in enumerate(counts) if n >= len(self.texts))
        shown = [*counts[:last], len(self.texts)]
        return tuple((minute, n, self.running.coverage(self.units[:n])) for minute, n in enumerate(shown, start=1))


def n_prompts(minutes: float) -> int:
    """Number of prompts for minutes of recording: 25 for 2, 60 for 5, 120 for 10, about 5 s each."""
    return round(float(np.interp(minutes, _MINUTES, _N_PROMPTS)))


def choose_prompts(minutes: float = 5.0, *, language: str = DEFAULT_LANGUAGE, text: Path | None = None) -> Prompts:
    """Prompts that cover the phones of a language in their visible contexts; equal for equal arguments.

    Parameters
    ----------
    minutes
        From 1 to `MAX_MINUTES`; of the shipped prompts to 20.
    text
        UTF-8 text of that language, from which sentences of 5 to 12 words are selected. There are shipped prompts in
        American English only.

    Raises
    ------
    InputError
        The minutes are outside of their limits, there are no shipped prompts in the language, the language does not
        exist, or the text cannot be read or has too few suitable sentences.
    DataError
        The text is not UTF-8.

    Examples
    --------
    >>> choose_prompts(2).coverage_by_minute()[-1][1]
    25
    """
    if not 1.0 <= minutes <= MAX_MINUTES:
        raise InputError(f"prompts for {minutes:g} minutes cannot be chosen; give 1 to {MAX_MINUTES:g} minutes")
    check_language(language)
    if text is None and language != DEFAULT_LANGUAGE:
        raise InputError(f"there are no shipped prompts in {language}; give a text of that language with --text")
    sentences = shipped_sentences() if text is None else _sentences_of(text, language)
    units = [sentence_units(sentence, language) for sentence in sentences]
    running = shipped_counts() if text is None else count_units(units)
    wanted = n_prompts(minutes)
    order = list(islice(select_sentences(units, running), wanted))
    if len(order) < wanted:
        source = "the shipped list" if text is None else str(text)
        raise InputError(
            f"{source} has {len(order)} prompts ({MIN_WORDS} to {MAX_WORDS} words that add phones or contexts), fewer "
            f"than the {wanted} of {minutes:g} minutes; give {'--text FILE' if text is None else 'a longer text'} or "
            "fewer minutes"
        )
    return Prompts(language, tuple(sentences[at] for at in order), tuple(units[at] for at in order), running)


def _sentences_of(text: Path, language: str) -> list[str]:
    try:
        content = read_text(text)
    except OSError as refused:
        raise InputError(f"{text} cannot be read ({refused.strerror}); give a text file") from refused
    sentences = list(easy_sentences(content, language))
    step = max(1, math.ceil(len(sentences) / MAX_CANDIDATES))
    return sentences[::step]


@functools.cache
def shipped_sentences() -> tuple[str, ...]:
    """The shipped English prompts, best first."""
    return tuple(POOL.read_text(encoding="utf-8").splitlines()[1:])


@functools.cache
def shipped_counts() -> RunningText:
    """Counts of phones and triphones in the books of the shipped prompts."""
    rows = [line.split("\t") for line in UNIT_COUNTS.read_text(encoding="utf-8").splitlines()[1:]]
    phones = {name: int(count) for kind, name, count in rows if kind == "phone"}
    triphones = {}
    for kind, name, count in rows:
        if kind == "triphone":
            before, here, behind = name.split()
            triphones[before, here, behind] = int(count)
    return RunningText(phones, triphones)


def format_counts(running: RunningText) -> str:
    """The table that `shipped_counts` reads."""
    rows: Iterable[tuple[str, str, int]] = (
        *(("phone", phone, count) for phone, count in running.phones.items()),
        *(("triphone", " ".join(triphone), count) for triphone, count in running.triphones.items()),
    )
    return "kind\tname\tcount\n" + "".join(f"{kind}\t{name}\t{count}\n" for kind, name, count in rows)


N_SHIPPED = 180  # 15 minutes
MIN_WORD_COUNT = 20  # occurrences of each word in the books; rarer ones are old or hard to read
# Old words and forms of address, and subjects that nobody should have to read aloud.
REJECTED_WORDS = frozenset(Path(__file__).with_name("rejected_words.tsv").read_text(encoding="utf-8").split()[1:])
REJECTED_PARTS = re.compile(
    r"\b(?:every|any|some|no) (?:body|thing|one's)\b|\bfor ever\b|\bever say\b|^(?:And|Or|Nor|For|Oh|Ah)\b|"
    r"\b(?:do|does|did|is|are|was|were|have|has|had|can|could|will|would|shall|should|must|may|might) not "
    r"(?:you|he|she|they|we|I|it|this|that)\b|\bhad (?:rather|he|she|they|it|I|you)\b|(?:^|\s)'|'\s",
    re.IGNORECASE,
)


def main() -> None:
    """Write the prompts and the counts of running text beside this file."""
    text = "\n\n".join(read_text(Path(name)) for name in sys.argv[1:])
    counts = count_words(text)
    sentences = list(easy_sentences(text, DEFAULT_LANGUAGE))
    running = count_units(sentence_units(sentence, DEFAULT_LANGUAGE) for sentence in sentences)
    candidates = [sentence for sentence in sentences if _is_suitable(sentence, counts)]
    units = [sentence_units(sentence, DEFAULT_LANGUAGE) for sentence in candidates]
    selected = [candidates[at] for at in islice(select_sentences(units, running), N_SHIPPED)]
    write_atomically(POOL, "".join(f"{sentence}\n" for sentence in ("text", *selected)).encode())
    write_atomically(UNIT_COUNTS, format_counts(running).encode())


def _is_suitable(sentence: str, counts: dict[str, int]) -> bool:
    """Whether a sentence has frequent words only, none of them a name or rejected."""
    if REJECTED_PARTS.search(sentence) or any(word[0].isupper() and word != "I" for word in sentence.split()[1:]):
        return False
    words = words_of(sentence)
    return REJECTED_WORDS.isdisjoint(words) and all(
        word == "i" or (counts[word] >= MIN_WORD_COUNT and cmudict_lookup(word)) for word in words
    )


if __name__ == "__main__":
    main()
