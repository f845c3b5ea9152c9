#!/usr/bin/env bash
# pympi-ling 1.71 and rustling 0.9.0 read ELAN's .eaf: words that are parts of an utterance (Symbolic_Subdivision) have no
# times of their own, and both give each of three words the whole utterance. In the TextGrid that pympi makes of it, one
# of the three is left; that of rustling has three intervals of the same times, of which Praat (praat-parselmouth 0.4.7)
# reads one. By the format the three follow one another within the utterance (PREVIOUS_ANNOTATION).
# Fails (exit code 1) if the packages behave otherwise. Needs Python 3.11, pip and a package index; loads 30 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --disable-pip-version-check \
    pympi-ling==1.71 rustling==0.9.0 praat-parselmouth==0.4.7 2> "$work/warnings" || { cat "$work/warnings"; exit 1; }

cat > "$work/parts.eaf" << 'EAF'
<?xml version="1.0" encoding="UTF-8"?>
<ANNOTATION_DOCUMENT AUTHOR="" DATE="2026-11-29T12:00:00+00:00" FORMAT="3.0" VERSION="3.0"
 xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:noNamespaceSchemaLocation="http://www.mpi.nl/tools/elan/EAFv3.0.xsd">
<HEADER MEDIA_FILE="" TIME_UNITS="milliseconds"/>
<TIME_ORDER>
<TIME_SLOT TIME_SLOT_ID="ts1" TIME_VALUE="1000"/><TIME_SLOT TIME_SLOT_ID="ts2" TIME_VALUE="2500"/>
</TIME_ORDER>
<TIER LINGUISTIC_TYPE_REF="utterance" TIER_ID="utterance"><ANNOTATION>
<ALIGNABLE_ANNOTATION ANNOTATION_ID="a1" TIME_SLOT_REF1="ts1" TIME_SLOT_REF2="ts2">
<ANNOTATION_VALUE>bin red now</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION></TIER>
<TIER LINGUISTIC_TYPE_REF="word" PARENT_REF="utterance" TIER_ID="words">
<ANNOTATION><REF_ANNOTATION ANNOTATION_ID="a2" ANNOTATION_REF="a1">
<ANNOTATION_VALUE>bin</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION>
<ANNOTATION><REF_ANNOTATION ANNOTATION_ID="a3" ANNOTATION_REF="a1" PREVIOUS_ANNOTATION="a2">
<ANNOTATION_VALUE>red</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION>
<ANNOTATION><REF_ANNOTATION ANNOTATION_ID="a4" ANNOTATION_REF="a1" PREVIOUS_ANNOTATION="a3">
<ANNOTATION_VALUE>now</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION></TIER>
<LINGUISTIC_TYPE GRAPHIC_REFERENCES="false" LINGUISTIC_TYPE_ID="utterance" TIME_ALIGNABLE="true"/>
<LINGUISTIC_TYPE CONSTRAINTS="Symbolic_Subdivision" GRAPHIC_REFERENCES="false" LINGUISTIC_TYPE_ID="word"
 TIME_ALIGNABLE="false"/>
<CONSTRAINT DESCRIPTION="Annotations refering to the same parent are ordered" STEREOTYPE="Symbolic_Subdivision"/>
</ANNOTATION_DOCUMENT>
EAF

cat > "$work/look.py" << 'PYTHON'
import sys
from importlib.metadata import version
from pathlib import Path

import parselmouth
import pympi
import rustling
from parselmouth.praat import call

folder = Path(sys.argv[1])
print(*(f"{name} {version(name)}" for name in ("pympi-ling", "rustling", "praat-parselmouth")), sep=", ")


def words_in_praat(path):
    grid = parselmouth.read(str(path))
    labels = [call(grid, "Get label of interval", 2, at + 1) for at in range(int(call(grid, "Get number of intervals", 2)))]
    return [label for label in labels if label]


eaf = pympi.Eaf(str(folder / "parts.eaf"))
of_pympi = [row[:3] for row in eaf.get_annotation_data_for_tier("words")]
eaf.to_textgrid().to_file(str(folder / "pympi.TextGrid"))
corpus = rustling.read_elan(str(folder / "parts.eaf"))
of_rustling = [(one.start_time, one.end_time, one.value) for one in corpus.tiers()[0]["words"].annotations]
(written,) = corpus.to_textgrid_strs()
(folder / "rustling.TextGrid").write_text(written)
left = [words_in_praat(folder / f"{name}.TextGrid") for name in ("pympi", "rustling")]
print("times in ms by pympi:   ", of_pympi)
print("times in ms by rustling:", of_rustling)
print("words in the TextGrid of pympi, of rustling, as Praat reads them:", *left)
whole = [(1000, 2500, word) for word in ("bin", "red", "now")]
if (of_pympi, of_rustling, left) != (whole, whole, [["bin"], ["bin"]]):
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/look.py" "$work"
