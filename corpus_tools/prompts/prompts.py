"""Prompts for a number of minutes: shipped ones in American English, or from a text of the user's."""

import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from corpus_tools.prompts.coverage import Coverage, RunningText, Units, count_units, select_sentences, sentence_units
from corpus_tools.prompts.sentences import MAX_WORDS, MIN_WORDS, easy_sentences
from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE, check_language
from lexicon.values.files import read_text

POOL = Path(__file__).with_name("prompts_en_us.tsv")  # written by `write_prompts`, best first
UNIT_COUNTS = Path(__file__).with_name("running_text_en_us.tsv")
# of a recording
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
