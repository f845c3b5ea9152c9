#!/usr/bin/env bash
# pyopenjtalk-plus 0.4.1.post10 (Open JTalk's front end for Japanese): a number in digits and the same number in Chinese
# characters are read differently. 800です is happyaku desu, 八百です is yao desu (as in yaoya, greengrocer); 10分 is
# juppun (ten minutes), 十分 is juubun (enough); 100足 is hyakusoku (a hundred pairs of shoes), 百足 is mukade
# (centipede). A normaliser that writes numbers as characters before it asks for their reading loses them: 90 of some
# 3,200 pairs of a number and a counter differ. The reading of the digits is the right one in each pair below.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --disable-pip-version-check pyopenjtalk-plus==0.4.1.post10 \
    2> "$work/warnings" || { cat "$work/warnings"; exit 1; }

cat > "$work/read.py" << 'PYTHON'
import pyopenjtalk

print("pyopenjtalk-plus 0.4.1.post10: digits, the same number in Chinese characters")
for digits, characters, wanted in (
    ("800です", "八百です", "ハッピャクデス ヤオデス"),
    ("10分です", "十分です", "ジュップンデス ジューブンデス"),
    ("5分です", "五分です", "ゴフンデス ゴブデス"),
    ("100足です", "百足です", "ヒャクソクデス ムカデデス"),
    ("10勝です", "十勝です", "ジュッショーデス トカチデス"),
    ("3行です", "三行です", "サンギョーデス ミユキデス"),
    ("800円です", "八百円です", "ハッピャクエンデス ハッピャクエンデス"),
    ("3本です", "三本です", "サンボンデス サンボンデス"),
):
    found = " ".join(pyopenjtalk.g2p(text, kana=True) for text in (digits, characters))
    print(digits, characters, found)
    if found != wanted:
        raise SystemExit(f"changed: {wanted} before")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/read.py"
