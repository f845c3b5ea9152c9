"""Lists of the available choices: ``tts2face languages | faces | identities | haircuts | ...``."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

AsJson = Annotated[bool, Parameter(help="Print JSON instead of a table.", name="--json", negative="")]
EMPTY_CELL = "-"


def languages(*, as_json: AsJson = False) -> None:
    """List the languages (`--language`): codes and English names; `--language` accepts both."""
    from tts2face.session.catalogue import languages

    entries = languages()
    print_entries(entries, ("code", "name"), ((entry.code, entry.name) for entry in entries), as_json)


def faces(*, as_json: AsJson = False) -> None:
    """List the faces (`--face`)."""
    from tts2face.session.catalogue import faces

    entries = faces()
    rows = ((entry.name, str(len(entry.identities)), entry.person or EMPTY_CELL, entry.summary) for entry in entries)
    print_entries(entries, ("face", "identities", "person", "summary"), rows, as_json)


def identities(
    *, face: Annotated[str, Parameter(help="Shipped face or .face file.")] = "head", as_json: AsJson = False
) -> None:
    """List the identities (`--identity`) of a face: presets of age, sex and ancestry."""
    from tts2face.session.catalogue import identities

    entries = identities(face)
    rows = ((entry.name, entry.person or EMPTY_CELL, entry.summary) for entry in entries)
    print_entries(entries, ("identity", "person", "summary"), rows, as_json)


def haircuts(*, as_json: AsJson = False) -> None:
    """List the haircuts (`--hair`)."""
    from tts2face.session.catalogue import haircuts

    entries = haircuts()
    print_entries(
        entries, ("haircut", "face", "summary"), ((entry.name, entry.face, entry.summary) for entry in entries), as_json
    )


def hair_colors(*, as_json: AsJson = False) -> None:
    """List the hair colours (`--hair-color`) that have a name."""
    from tts2face.session.catalogue import hair_colors

    entries = hair_colors()
    print_entries(entries, ("color", "sRGB"), ((entry.name, entry.color) for entry in entries), as_json)


def styles(
    *,
    palette: Annotated[str, Parameter(help="Shipped palette or .palette file.")] = "starter",
    as_json: AsJson = False,
) -> None:
    """List the styles (`--style`) of a palette."""
    from tts2face.session.catalogue import styles

    entries = styles(palette)
    rows = ((entry.name, entry.source or EMPTY_CELL, entry.summary) for entry in entries)
    print_entries(entries, ("style", "derived from", "summary"), rows, as_json)


def talkers(*, as_json: AsJson = False) -> None:
    """List the shipped talkers (`--talker`)."""
    from tts2face.session.catalogue import talkers

    entries = talkers()
    rows = (
        (
            entry.name,
            entry.language,
            str(entry.n_utterances),
            f"{entry.minutes:g}",
            "yes" if entry.has_own_face else "no",
            entry.licence,
        )
        for entry in entries
    )
    print_entries(entries, ("talker", "language", "utterances", "minutes", "own face", "licence"), rows, as_json)


def formats(*, as_json: AsJson = False) -> None:
    """List the export formats (`--export`) and the suffixes that select them."""
    from tts2face.session.catalogue import formats

    entries = formats()
    rows = (
        (entry.name, " ".join(entry.suffixes), "yes" if entry.is_installed else "no", entry.summary)
        for entry in entries
    )
    print_entries(entries, ("format", "suffixes", "installed", "summary"), rows, as_json)


LISTS = (languages, faces, identities, haircuts, hair_colors, styles, talkers, formats)


def languages_text(codes: Sequence[str]) -> str:
    """Codes of languages for a table, or their number."""
    if not codes:
        return "its own"
    return ", ".join(codes) if len(codes) < 6 else str(len(codes))


def print_entries(
    entries: "Sequence[DataclassInstance]", heading: Sequence[str], rows: Iterable[Sequence[str]], as_json: bool
) -> None:
    """Print entries as JSON or as a table with aligned columns."""
    if as_json:
        records: list[dict[str, Any]] = [asdict(entry) for entry in entries]
        print(json.dumps(records, ensure_ascii=False, indent=2))  # noqa: T201 - the result
        return
    table = [heading, *rows]
    widths = [max(len(row[column]) for row in table) for column in range(len(heading))]
    for row in table:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())  # noqa: T201
