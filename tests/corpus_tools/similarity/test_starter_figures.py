"""The figures of docs/accuracy.md on the phone similarity of the starter talker equal those of the report."""

from pathlib import Path

import numpy as np
import pytest

from corpus_tools.studies.similarity.analysis import Analysis, NamedTalker, SimilarityOptions, analyse
from tests.packages import needs
from tts2face.models.talker_file import load_talker

DOC = Path(__file__).resolve().parents[3] / "docs" / "accuracy.md"


@pytest.fixture(scope="module")
def found() -> Analysis:
    needs("sklearn")
    return analyse(NamedTalker("grid_s1", load_talker("grid_s1")), SimilarityOptions())


@pytest.fixture(scope="module")
def documented_text() -> str:
    return " ".join(DOC.read_text(encoding="utf-8").split("## Similarity of phones")[1].split())


def short(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}f}".lstrip("0")


def test_reliability(found: Analysis, documented_text: str) -> None:
    for split in (found.by_utterances, found.by_words, found.by_utterances_same_phones):
        assert split is not None
        low, high = short(split.correlations.min()), short(split.correlations.max())
        assert f"| {short(split.mean)} | {low} - {high} | {short(split.full_length_reliability)} |" in documented_text


def test_classes(found: Analysis, documented_text: str) -> None:
    assert found.best.n_classes == 6
    assert f"**{short(found.best.silhouette, 2)} for 6**" in documented_text
    for classes in (found.curve[0], *found.chosen):
        assert f"{short(classes.silhouette, 2)} for {classes.n_classes}" in documented_text
    for number in range(6):
        group = [found.table.phones[at] for at in found.tree.order if found.best.labels[at] == number]
        assert f"| {' '.join(group)} |" in documented_text


def test_articulation(found: Analysis, documented_text: str) -> None:
    for name, agreement in found.articulatory:
        assert f"{name} r = {short(agreement.r)} (p = {short(agreement.p, 4)})" in documented_text


def test_what_is_held(found: Analysis, documented_text: str) -> None:
    movements = found.movements
    share = dict(zip(movements.names, movements.free_share, strict=True))
    for name, word in (
        ("jaw lowering", "jaw"),
        ("opening", "opening"),
        ("protrusion", "protrusion"),
        ("width", "width"),
    ):
        assert f"{word} {short(share[name], 2)}" in documented_text
    opening = movements.free[:, movements.names.index("opening")]
    assert found.table.phones[int(np.argmin(opening))] == "m"
    assert found.table.phones[int(np.argmax(opening))] == "t"
    assert (found.modes.free_share[4:] >= 0.795).all()


def test_neighbours(found: Analysis, documented_text: str) -> None:
    ranked = dict(zip(found.table.phones, found.neighbours, strict=True))
    for phone in "pfvtd":
        cells = " | ".join(f"{near} {short(value, 2)}" for near, value in ranked[phone])
        assert f"| {phone} | {cells} |" in documented_text
