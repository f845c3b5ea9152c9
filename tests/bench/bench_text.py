"""Texts that are read as they should be: run ``python tests/bench/bench_text.py KIND LIST [LIST ...] [--wrong]``.

Each kind of list has its columns and its rule, a row of `KINDS`. Words are compared without punctuation and capitals;
``FBI`` is "f b i" where its letters are spoken one by one; answers that are all right stand between `` | ``.
"""

import argparse
import csv
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from bench_words import NEAR, RIGHT, WEAK_VOWELS, word_distance

from lexicon.errors import InputError
from lexicon.pronounce import Word, pronounce
from lexicon.spoken_words import pronounce_marked
from lexicon.text_marks import parse_marks

Row = Mapping[str, str]
ALTERNATIVES = " | "
MAX_JOINED_WORDS = 4  # of a written word whose phones are compared: "re-elected", "R.E.M."
_LETTERS = re.compile(r"[^\W_]+")
_WORD = re.compile(r"[^\W_]+(?:['’][^\W_]+)*")
_SPELLED = re.compile(r"([A-Z]{1,10})('?s)?\Z")


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a row is read: its kind, its text, what is said, what should be, and whether they agree."""

    kind: str
    text: str
    said: str
    wanted: str
    is_right: bool


def printed_words(text: str, language: str = "en-us") -> tuple[Word, ...]:
    """Words as ``tts2face phones`` prints them."""
    return pronounce_marked(parse_marks(text, language), language).words


def _key(written: str) -> str:
    return "".join(_LETTERS.findall(written.lower()))


def _sounds(words: Sequence[Word]) -> list[str]:
    return [name.rstrip("012") for word in words for name in word.arpabet]


def _plain(words: str) -> list[str]:
    return _WORD.findall(words.lower().replace("’", "'"))


def spoken_words(words: Sequence[Word]) -> list[str]:
    """Words in small letters, without hyphens; of spelled words each letter."""
    found: list[str] = []
    for word in words:
        for part in word.text.split("-"):
            spelled = _SPELLED.match(part)
            if spelled and (len(spelled[1]) == 1 or _is_spelled(spelled[1], _sounds([word]))):
                found += [*spelled[1][:-1].lower(), spelled[1][-1].lower() + (spelled[2] or "")]
            else:
                found += _plain(part)
    return found


def _is_spelled(letters: str, sounds: Sequence[str]) -> bool:
    """Whether the phones of a word begin with the name of each letter in turn."""
    names = [name for letter in letters for name in _sounds(pronounce(f"{letter}.").words)]
    return list(sounds[: len(names)]) == names


def _runs(words: Sequence[Word], key: str) -> Iterator[Sequence[Word]]:
    """Words that a written word became: a word, adjacent ones, or all of one written form."""
    for at in range(len(words)):
        for size in range(1, MAX_JOINED_WORDS + 1):
            run = words[at : at + size]
            if len(run) == size and "".join(_key(word.text) for word in run) == key:
                yield run
    for _, group in groupby(words, key=lambda word: word.source):
        same = list(group)
        if _key(same[0].source) == key:
            yield same


def _has_phones(words: Sequence[Word], given: str) -> bool:
    """Whether every word of ``word=PHONES;word=PHONES`` sounds so wherever it is written so."""
    for entry in filter(None, given.split(";")):
        written, _, names = entry.partition("=")
        runs = list(_runs(words, _key(written)))
        if not any(word_distance(_sounds(run), names.split()) <= RIGHT for run in runs):
            return False
    return True


def _sentence_verdict(row: Row, column: str) -> Verdict:
    text = row["text"].replace("\\n", "\n")
    words = printed_words(text)
    said = spoken_words(words)
    is_said = row["kind"] == "stretched" or any(said == _plain(own) for own in row[column].split(ALTERNATIVES))
    sounds = " ".join(f"{word.text}={' '.join(word.arpabet)}" for word in words) if row["phones"] and is_said else ""
    is_right = is_said and _has_phones(words, row["phones"])
    return Verdict(row["kind"], row["text"], f"{' '.join(said)} {sounds}".strip(), row[column], is_right)


def _marked_verdict(row: Row, markup: str) -> Verdict:
    """What is spoken of a text with the marks of people and language models; letters may be joined or apart."""
    said = spoken_words(pronounce_marked(parse_marks(row["text"].replace("\\n", "\n"), markup=markup)).words)
    answers = [_plain(answer) for answer in row["spoken"].split(ALTERNATIVES)]
    is_right = any("".join(said) == "".join(own) for own in answers)
    return Verdict(row["kind"], row["text"], " ".join(said), row["spoken"], is_right)


def _difference(a: str, b: str) -> float:
    """Distance of two names: primary stress counts, as do vowels but for weak ones, which hardly differ."""
    if not (a[-1].isdigit() and b[-1].isdigit()):
        return float(a != b)
    vowels = {a[:-1], b[:-1]}
    if ("1" in a) != ("1" in b):
        return 1.0
    if len(vowels) == 1:
        return 0.0
    return NEAR if vowels <= WEAK_VOWELS and "1" not in a else 1.0


def _stressed_distance(said: str, wanted: str) -> float:
    """Edit distance of two words in ARPABET with stress."""
    names = wanted.split()
    row = [float(at) for at in range(len(names) + 1)]
    for i, name in enumerate(said.split(), 1):
        before, row[0] = row[0], float(i)
        for j, other in enumerate(names, 1):
            before, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, before + _difference(name, other))
    return row[-1]


def _homograph_verdict(row: Row) -> Verdict:
    """Each occurrence is nearer to the expected reading than to the other one."""
    said = [" ".join(word.arpabet) for word in printed_words(row["sentence"]) if _is_form(word, row["word"])]
    wanted, others = row["expected"].split(" ; "), row["other"].split(" ; ")
    if len(wanted) == 1:
        wanted, others = wanted * len(said), others * len(said)
    is_right = len(said) == len(wanted) > 0 and all(
        _stressed_distance(own, right) < _stressed_distance(own, other)
        for own, right, other in zip(said, wanted, others, strict=True)
    )
    return Verdict(row["word"], row["sentence"], " ; ".join(said), row["expected"], is_right)


def _is_form(word: Word, wanted: str) -> bool:
    return word.text.lower().strip("'") == wanted.lower()


def _reading_verdict(row: Row) -> Verdict:
    """The first occurrence of a word has the right reading, whatever its weak vowels are."""
    said = next(" ".join(word.arpabet) for word in printed_words(row["text"]) if _is_form(word, row["word"]))
    is_right = _stressed_distance(said, row["right"]) <= RIGHT
    return Verdict(row["word"], row["text"], said, row["right"], is_right)


def _word_verdict(row: Row) -> Verdict:
    said = _sounds(printed_words(row["word"]))
    is_right = any(word_distance(said, answer.split()) <= RIGHT for answer in row["right"].split(ALTERNATIVES))
    return Verdict(row["kind"], row["word"], " ".join(said), row["right"], is_right)


def _language_verdict(row: Row) -> Verdict:
    """What is said has the letters of the right words, or sounds as they do."""
    words = pronounce(row["text"], row["language"])
    said = " ".join(word.text for word in words.words)
    is_right = any(
        _key(said) == _key(answer) or words.phones == pronounce(answer, row["language"]).phones
        for answer in row["right"].split(ALTERNATIVES)
    )
    return Verdict(row["language"], row["text"], said, row["right"], is_right)


# Kinds of lists, with the verdict of a row.
KINDS: dict[str, Callable[[Row], Verdict]] = {
    "sentences": lambda row: _sentence_verdict(row, "right"),
    "readings": lambda row: _sentence_verdict(row, "spoken"),
    "homographs": _homograph_verdict,
    "homographs_2": _reading_verdict,
    "words": _word_verdict,
    "languages": _language_verdict,
    "llm": lambda row: _marked_verdict(row, "llm"),
    "marks": lambda row: _marked_verdict(row, "auto"),
}


def read_rows(path: Path) -> list[dict[str, str]]:
    """Rows of a list by the names of its columns; a cell that a line lacks is empty."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE, restval=""))


def verdicts(kind: str, path: Path) -> list[Verdict]:
    """Verdict of each row of a list; a text that is refused is wrong."""
    found = []
    for row in read_rows(path):
        try:
            found.append(KINDS[kind](row))
        except InputError as refused:
            text = row.get("text") or row.get("sentence") or row.get("word") or ""
            found.append(Verdict(row.get("kind", ""), text, f"refused: {refused}", "", is_right=False))
    return found


def main() -> None:
    """Print how many rows of each list are right, by kind, and with --wrong the others."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("lists", nargs="+", type=Path)
    parser.add_argument("--wrong", action="store_true", help="Print each wrong row.")
    options = parser.parse_args()
    for path in options.lists:
        found = verdicts(options.kind, path)
        right, total = Counter(v.kind for v in found if v.is_right), Counter(v.kind for v in found)
        for verdict in found:
            if options.wrong and not verdict.is_right:
                print(f"{verdict.kind}\t{verdict.text}\n    said   {verdict.said}\n    wanted {verdict.wanted}")
        kinds = (
            ", ".join(f"{kind} {right[kind]}/{n}" for kind, n in total.items()) if len(total) < len(found) / 2 else ""
        )
        print(f"{path.name}: {right.total()} of {len(found)}" + (f"; {kinds}" if kinds else ""))


if __name__ == "__main__":
    main()
