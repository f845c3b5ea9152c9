#!/usr/bin/env bash
# espeakng-loader 0.2.4 (espeak-ng 1.52): its Mandarin has no syllables xiong, qiong and jiong. Characters that are read so
# (熊 bear, 兄 brother, 穷 poor, 窘 embarrassed) switch to English in the middle of a sentence: the letters of their pinyin
# are spelled by English rules ("kshongtoo"). No error, no warning: only the mark (en) in the phonemes tells it. Pinyin
# itself (cmn-latn-pinyin) is read the same way; yong, which rhymes with them, is right.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --disable-pip-version-check espeakng-loader==0.2.4 \
    2> "$work/warnings" || { cat "$work/warnings"; exit 1; }

cat > "$work/say.py" << 'PYTHON'
import ctypes

import espeakng_loader

library = ctypes.CDLL(espeakng_loader.get_library_path())
library.espeak_Initialize(1, 0, espeakng_loader.get_data_path().encode(), 0)
library.espeak_TextToPhonemes.restype = ctypes.c_char_p


def phonemes(text, voice):
    library.espeak_SetVoiceByName(voice.encode())
    rest = ctypes.pointer(ctypes.c_char_p(text.encode()))
    return library.espeak_TextToPhonemes(ctypes.cast(rest, ctypes.POINTER(ctypes.c_void_p)), 1, 2).decode()


print("espeakng-loader 0.2.4, phonemes of Mandarin")
for text, voice, is_english in (
    ("熊", "cmn", True), ("兄", "cmn", True), ("穷", "cmn", True), ("窘", "cmn", True), ("用", "cmn", False),
    ("雄", "cmn", True), ("xiong2", "cmn-latn-pinyin", True), ("yong4", "cmn-latn-pinyin", False),
):
    found = phonemes(text, voice)
    print(text, found)
    if ("(en)" in found) != is_english:
        raise SystemExit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/say.py"
