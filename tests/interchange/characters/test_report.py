"""The report of an import fits on one screen."""

import re

import pytest

from tts2face.interchange.characters.importing import ImportReport
from tts2face.interchange.characters.report import report_text, summary
from tts2face.interchange.characters.shape_names import ARKIT_SHAPES
from tts2face.interchange.characters.shapes import ShapeSource


def made_report(n_found: int, n_unused: int = 0, n_notes: int = 0) -> ImportReport:
    found, others = ARKIT_SHAPES[:n_found], ARKIT_SHAPES[n_found:]
    return ImportReport(
        mapping={name: (ShapeSource(f"own_{name}"), ShapeSource("more")) for name in found},
        unused=tuple(f"a_rather_long_name_of_a_shape_{n}" for n in range(n_unused)),
        missing={name: "nothing" if n % 3 else "the other shapes of its mouth" for n, name in enumerate(others)},
        landmarks={}, score=0.987, n_eyeballs=2, notes=tuple(f"note {n} " + "word " * 20 for n in range(n_notes)),
        licence="", strengths=dict.fromkeys(found, 0.5),
    )  # fmt: skip


@pytest.mark.parametrize(("n_found", "n_unused", "n_notes"), [(52, 0, 0), (30, 200, 3), (1, 1000, 3)])
def test_any_report_fits_on_a_screen(n_found: int, n_unused: int, n_notes: int) -> None:
    text = report_text(made_report(n_found, n_unused, n_notes))
    lines = text.splitlines()
    assert len(lines) <= 24
    assert max(len(line) for line in lines) <= 100
    assert f"{n_found} of ARKit's 52" in lines[0]
    assert "licence     not stated" in text


def test_every_missing_shape_is_counted() -> None:
    rows = summary(made_report(30))
    assert [name for name, _ in rows] == ["found", "strength", "replaced", "missing"]
    listed = [text.split(": ")[0] for _, text in rows[2:]]
    more = [int(found[1]) for text in listed if (found := re.search(r" and (\d+) more", text))]
    assert sum(text.count(",") + 1 for text in listed) + sum(more) == 22


def test_sources_and_strengths_of_the_mouth_are_shown() -> None:
    (_, text) = summary(made_report(52))[1]
    assert "jawOpen 0.50 (own_jawOpen + more)" in text
