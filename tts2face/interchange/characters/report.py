"""Report of an import on one screen: which shapes were found, how strong they are, what replaces missing ones."""

from textwrap import TextWrapper
from typing import TYPE_CHECKING

from tts2face.face.expressions import GAZE_SHAPES
from tts2face.face.stand_in import VISEME_PREFIX
from tts2face.interchange.characters.import_notes import some_of
from tts2face.interchange.characters.shape_names import ARKIT_SHAPES

if TYPE_CHECKING:
    from tts2face.interchange.characters.importing import ImportReport

WIDTH, INDENT = 100, 12  # columns of the text, and of the names of its rows
ROW_NAMES = 8  # names of a row
NOTHING = "nothing"  # what replaces a shape that only faces outside speech and gestures need
# Shapes on which speech depends most, whose sources and strengths are shown.
SHOWN = ("jawOpen", "mouthPucker", "mouthFunnel", "mouthSmileLeft", "mouthUpperUpLeft", "mouthLowerDownLeft")


def report_text(report: "ImportReport") -> str:
    """Report of an import as text of at most `WIDTH` columns."""
    score = "read from the table" if report.score is None else f"tracked, score {report.score:.2f}"
    rows = [
        *summary(report),
        ("landmarks", f"{len(report.landmarks)}, {score}; eyeballs: {report.n_eyeballs}"),
        *(("note", note) for note in report.notes),
        ("licence", report.licence or "not stated; check it before publishing clips"),
    ]
    wrapped = TextWrapper(WIDTH, subsequent_indent=" " * INDENT, break_long_words=False, break_on_hyphens=False)
    return "\n".join(wrapped.fill(f"{name:{INDENT}}{text}") for name, text in rows) + "\n"


def summary(report: "ImportReport") -> list[tuple[str, str]]:
    """Rows of name and text: the shapes found, those of the mouth, replaced, missing and unused ones."""
    found = [name for name in ARKIT_SHAPES if name in report.mapping]
    visemes = [name.removeprefix(VISEME_PREFIX) for name in report.mapping if name.startswith(VISEME_PREFIX)]
    replaced: dict[str, list[str]] = {}
    for name, replacement in report.missing.items():
        replaced.setdefault(replacement, []).append(name)
    missing = replaced.pop(NOTHING, [])
    beside = f", visemes {some_of(visemes, ROW_NAMES)}" if visemes else ""
    rows = [("found", f"{len(found)} of ARKit's {len(ARKIT_SHAPES)}{beside}")]
    if report.carried_from:
        of = f"{report.n_carried} of ARKit's {len(ARKIT_SHAPES)} shapes"
        rows = [("carried", f"{of}, of the shipped face {report.carried_from}")]
    turned = [name for name in GAZE_SHAPES if name not in report.mapping and name not in report.missing]
    rows += [("added", f"gaze ({len(turned)} shapes): the eyeballs turn")] if turned and report.n_eyeballs else []
    mouth = [
        f"{name} {report.strengths[name]:.2f} ({' + '.join(source.name for source in report.mapping[name])})"
        for name in SHOWN
        if name in report.strengths and name in report.mapping
    ]
    if mouth:
        rows.append(("strength", f"relative to the default head (source): {', '.join(mouth)}"))
    rows += [("replaced", f"{some_of(names, ROW_NAMES)}: {replacement}") for replacement, names in replaced.items()]
    rows += [("missing", some_of(missing, ROW_NAMES))] if missing else []
    return rows + ([("unused", some_of(report.unused, ROW_NAMES))] if report.unused else [])
