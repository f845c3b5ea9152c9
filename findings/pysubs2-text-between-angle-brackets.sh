#!/usr/bin/env bash
# pysubs2 1.8.1: of SubRip and WebVTT the words between < and > are dropped although they are no tag: "for 3 < x we get
# y > 0" becomes "for 3  0", and "press <Enter>" becomes "press ". Only a < without a > after it stays.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --no-deps pysubs2==1.8.1

cat > "$work/run.py" <<'PYTHON'
import pysubs2

texts = ["for 3 < x we get y > 0", "press <Enter> now", "I <3 you", "<i>so</i> it is"]
print("pysubs2", pysubs2.VERSION)
cues = "".join(
    f"{number}\n00:00:0{number},000 --> 00:00:0{number},900\n{text}\n\n" for number, text in enumerate(texts, start=1)
)
for kind, content in (("srt", cues), ("vtt", "WEBVTT\n\n" + cues.replace(",", "."))):
    read = [event.plaintext for event in pysubs2.SSAFile.from_string(content, format_=kind)]
    print(kind, read)
    if read != ["for 3  0", "press  now", "I <3 you", "so it is"]:
        raise SystemExit("changed")
PYTHON
"$work/environment/bin/python" "$work/run.py"
echo "as described"
