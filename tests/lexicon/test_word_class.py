"""The learnt class of a word, and what its weights are learnt from."""

from pathlib import Path

import numpy as np
import pytest

from corpus_tools.shipped.training.word_class import Example, fit, read_examples, share_right
from lexicon.part_of_speech import tag_words
from lexicon.word_class import CLASSES, class_of_tag, class_probabilities, features


def likeliest(text: str, word: str) -> str:
    words = text.split()
    lower = [token.lower() for token in words]
    return CLASSES[int(class_probabilities(lower, tag_words(tuple(words)), lower.index(word)).argmax())]


def test_tags_have_classes() -> None:
    assert [class_of_tag(tag) for tag in ("NNS", "VBD", "JJR", "RB", "CD")] == ["NN", "VB", "JJ", "JJ", "NN"]


def test_features_reach_beyond_the_sentence() -> None:
    names = features(["go", "."], ["VB", "."], 0)
    assert {"t=VB", "t-1=-", "w-2=-", "w+1=.", "w+2=-"} <= set(names)
    assert len(names) == len(set(names))


def test_a_finite_verb_of_the_clause_is_a_feature() -> None:
    lower, tags = ["they", "left", ",", "and", "rules", "conflict", "."], ["PRP", "VBD", ",", "CC", "NNS", "NN", "."]
    assert "v=" in features(lower, tags, 5)
    assert "v=<" in features([*lower[:2], "conflict"], [*tags[:2], "NN"], 2)
    assert "v=>" in features(["conflict", "is"], ["NN", "VBZ"], 0)


@pytest.mark.parametrize(
    ("text", "word", "name"),
    [
        ("Some owners abuse their dogs .", "abuse", "VB"),
        ("The abuse lasted years .", "abuse", "NN"),
        ("Metals conduct heat .", "conduct", "VB"),
        ("It was a moderate success .", "moderate", "JJ"),
    ],
)
def test_words_around_decide(text: str, word: str, name: str) -> None:
    assert likeliest(text, word) == name


def test_probabilities_are_shares() -> None:
    found = class_probabilities(["the", "row", "."], ["DT", "NN", "."], 1)
    assert found.shape == (len(CLASSES),)
    assert np.isclose(found.sum(), 1)


def test_weights_tell_separable_examples_apart() -> None:
    examples = [Example("run", name, (f"w-1={word}", "b"), "NN") for name, word in (("NN", "the"), ("VB", "to"))] * 10
    weights = fit(examples)
    assert share_right(weights, examples) == 1
    assert weights["w-1=the"][0] > 0 > weights["w-1=the"][1]


def write_wordnet(folder: Path) -> None:
    gloss = '| to move; "they run home"; "the long run"\n'
    for name, line in {"noun": 'run 01 n 00 1 run 0 000 | a race; "he won the run"', "verb": gloss}.items():
        (folder / f"index.{name}").write_text("  licence\nrun n 1\n" if name == "noun" else "run v 1\n")
        text = f"00000001 00 {name[0]} 01 run 0 000 {line[line.index('|') :]}"
        (folder / f"data.{name}").write_text(f"  licence\n{text.rstrip()}\n")
    for name in ("adj", "adv"):
        (folder / f"index.{name}").write_text("")
        (folder / f"data.{name}").write_text("")


def test_examples_of_wordnet_have_the_class_of_their_meaning(tmp_path: Path) -> None:
    write_wordnet(tmp_path)
    found = [example for example in read_examples(tmp_path) if "w-1=won" not in example.features]
    assert {example.word for example in found} == {"run"}
    assert {"NN", "VB", "JJ"} == {example.name for example in found}
    assert ("VB", True) in {(example.name, "w-1=they" in example.features) for example in found}
