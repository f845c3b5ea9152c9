"""Write the shipped English prompts: ``python -m corpus_tools.prompts.write_prompts BOOK ...``.

Candidates are easy sentences of frequent words without names, from public-domain books, which NOTICE.md names. The
result was read by a person, whose objections are `REJECTED_WORDS` and `REJECTED_PARTS`.
"""

import re
import sys
from itertools import islice
from pathlib import Path

from corpus_tools.prompts.coverage import count_units, select_sentences, sentence_units
from corpus_tools.prompts.prompts import POOL, UNIT_COUNTS, format_counts
from corpus_tools.prompts.sentences import count_words, easy_sentences, words_of
from lexicon.dictionary import cmudict_lookup
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.values.files import read_text
from tts2face.storage.files import write_atomically

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
