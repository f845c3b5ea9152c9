#!/usr/bin/env bash
# unicode-rbnf 2.4.1 (the spelled-out numbers of CLDR): the rule set spellout-cardinal-feminine of Arabic gives the
# masculine forms from 3 on. Arabic numbers from 3 to 10 have the gender opposite to that of what they count (ثلاث سيارات,
# three cars, beside ثلاثة كتب, three books), and 11 agrees in both words (إحدى عشرة سيارة, أحد عشر كتابا). CLDR
# writes ثلاثة in both rule sets, and إحدى عشر, which is half feminine, half masculine, in both. Hundreds are two words
# (ثلاثة مائة for ثلاثمائة). Numbers from its rules are wrong before any feminine noun.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --disable-pip-version-check unicode-rbnf==2.4.1 \
    2> "$work/warnings" || { cat "$work/warnings"; exit 1; }

cat > "$work/spell.py" << 'PYTHON'
from unicode_rbnf import RbnfEngine

engine = RbnfEngine.for_language("ar")
wanted = {1: "واحد|واحدة", 3: "ثلاثة|ثلاثة", 8: "ثمانية|ثمانية", 11: "إحدى عشر|إحدى عشر", 300: "ثلاثة مائة|ثلاثة مائة"}
print("unicode-rbnf 2.4.1, Arabic: masculine|feminine")
for n, words in wanted.items():
    kinds = ("spellout-cardinal-masculine", "spellout-cardinal-feminine")
    found = "|".join(engine.format_number(n, ruleset_names=[kind]).text for kind in kinds)
    print(n, found)
    if found != words:
        raise SystemExit(f"changed: {words} before")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/spell.py"
