"""The texts of `marked_texts.tsv` with what is spoken."""

import csv
from pathlib import Path

TABLE = Path(__file__).with_name("marked_texts.tsv")


def rows() -> list[dict[str, str]]:
    """Rows by the names of the columns, with their line feeds."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        found = csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE)
        return [{**row, "text": row["text"].replace("\\n", "\n")} for row in found]
