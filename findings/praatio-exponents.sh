#!/usr/bin/env bash
# praatio 6.2.2 refuses a TextGrid that Praat (praat-parselmouth 0.4.7) writes as text and reads back, if an edge is below
# 0.0001 s: Praat writes 1e-05, and praatio finds no number in the line. It reads the same file saved as short text.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 30 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --disable-pip-version-check \
    praatio==6.2.2 praat-parselmouth==0.4.7 2> "$work/warnings" || { cat "$work/warnings"; exit 1; }

cat > "$work/look.py" << 'PYTHON'
import sys
from importlib.metadata import version
from pathlib import Path

import parselmouth
from parselmouth.praat import call
from praatio import textgrid
from praatio.utilities.errors import ParsingError

path = Path(sys.argv[1], "made.TextGrid")
print(*(f"{name} {version(name)}" for name in ("praatio", "praat-parselmouth")), sep=", ")


def read(edge, form):
    grid = call("Create TextGrid", 0, 1, "words", "")
    call(grid, "Insert boundary", 1, edge)
    call(grid, "Set interval text", 1, 2, "bin")
    call(grid, f"Save as {form} file...", str(path))
    assert call(parselmouth.read(str(path)), "Get end time of interval", 1, 1) == edge
    try:
        entries = textgrid.openTextgrid(str(path), includeEmptyIntervals=True).getTier("words").entries
        found = [(entry.start, entry.end) for entry in entries]
    except ParsingError as refused:
        found = f"ParsingError: {refused}"
    print(f"edge at {edge}, {form}: {found}")
    return found


found = [read(edge, form) for edge in (0.0001, 1e-05) for form in ("text", "short text")]
missing = "ParsingError: Expected field in Textgrid missing."
whole, small = [(0, 0.0001), (0.0001, 1)], [(0, 1e-05), (1e-05, 1)]
if found != [whole, whole, missing, small]:
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/look.py" "$work"
