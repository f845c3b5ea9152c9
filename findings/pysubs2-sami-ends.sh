#!/usr/bin/env bash
# pysubs2 1.8.1: the end of a cue of SAMI is estimated from the length of its text, although the next <SYNC>, which
# clears the line, says when it ends: 1000 to 3000 ms is read as 1000 to 2773 ms, and the clearing <SYNC> as a cue
# without words.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --no-deps pysubs2==1.8.1

cat > "$work/run.py" <<'PYTHON'
import pysubs2

content = (
    "<SAMI><BODY>\n<SYNC Start=1000><P Class=ENCC>The train was late.\n<SYNC Start=3000><P Class=ENCC>&nbsp;\n"
    "<SYNC Start=9000><P Class=ENCC>We walked home.\n<SYNC Start=11000><P Class=ENCC>&nbsp;\n</BODY></SAMI>\n"
)
read = [(event.start, event.end, event.plaintext) for event in pysubs2.SSAFile.from_string(content, format_="sami")]
print("pysubs2", pysubs2.VERSION)
print(read)
spoken = [(start, end) for start, end, text in read if text.strip()]
if len(spoken) != 2 or spoken[0] != (1000, 2773) or spoken[1][1] == 11000:
    raise SystemExit("changed")
PYTHON
"$work/environment/bin/python" "$work/run.py"
echo "as described"
