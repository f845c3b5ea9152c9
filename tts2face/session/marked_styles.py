"""Styles in the marks of a text, and those of the palette for which they stand.

A mark that names a style which is not written as one, or which the palette lacks, is left out of its text with a note.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from lexicon.errors import InputError
from lexicon.mark_table import read_marks_table
from lexicon.marked_text import MarkedText
from lexicon.ssml_leniency import nearest_style
from tts2face.gestures.timeline import parse_style


@lru_cache(maxsize=1000)
def innermost_styles(nested: tuple[str, ...]) -> Mapping[str, str]:
    """Style of each feature under nested marks; the innermost mark of a feature applies."""
    chosen: dict[str, str] = {}
    for written in nested:
        chosen |= parse_style(written)
    return chosen


def marked_styles(text: MarkedText) -> tuple[str, ...]:
    """Names of all styles in the marks of a text, in order of first use; raises as `parse_style`."""
    runs = dict.fromkeys(run.styles for run in text.runs)
    return tuple(dict.fromkeys(style for styles in runs for style in innermost_styles(styles).values()))


def palette_style(names: Sequence[str], written: str) -> str:
    """Style of a palette with these names for which a written one stands; the written one if it stands for none."""
    return written if written in names else nearest_style(written) or written


def with_styles_of(text: MarkedText, names: Sequence[str] | None) -> MarkedText:
    """A text whose marks name styles of a palette; what cannot be followed is left out, with a note.

    Parameters
    ----------
    names
        Styles of the palette; None: any name is one of it.
    """
    used = dict.fromkeys(name for run in text.runs for name in run.styles)
    if not used:
        return text
    notes, known = [*text.notes], dict[str, str]()
    for written in used:
        try:
            style, lacking = _of_palette(written, names)
        except InputError as wrong:
            notes.append(f"the style {written[:40]!r} of a mark is not followed: {wrong}")
            continue
        known |= {written: style} if style else {}
        notes += [f"there is no style {name[:40]!r} in the palette; its words keep the style around them"
                  for name in lacking if name not in text.foreign_styles]  # fmt: skip
    runs = [replace(run, styles=tuple(known[name] for name in run.styles if name in known)) for run in text.runs]
    return replace(text, runs=tuple(runs), notes=tuple(notes))


def _of_palette(written: str, names: Sequence[str] | None) -> tuple[str, tuple[str, ...]]:
    """A style as a palette with these names has it, empty without one, and the names that it lacks."""
    chosen = parse_style(written)
    if names is None:
        return written, ()
    found = {feature: palette_style(names, style) for feature, style in chosen.items()}
    lacking = dict.fromkeys(style for feature, style in chosen.items() if found[feature] not in names)
    kept = {feature: style for feature, style in found.items() if style in names}
    if kept == chosen:
        return written, ()
    of_all = set(kept.values()) if len(kept) == len(chosen) and "=" not in written else set()
    return of_all.pop() if of_all else ",".join(f"{key}={style}" for key, style in kept.items()), tuple(lacking)


def check_own_styles(table: Path | None, names: Sequence[str]) -> None:
    """Refuse a user's table of marks with a style that a palette with these names lacks."""
    own = sorted(read_marks_table(table).own_styles) if table is not None else ()
    for written in own:
        for style in parse_style(written).values():
            if style not in names and nearest_style(style) is None:
                raise InputError(f"{table}: there is no style {style[:40]!r} in the palette; it has {', '.join(names)}")
