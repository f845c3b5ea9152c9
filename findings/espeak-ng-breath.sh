#!/usr/bin/env bash
# espeakng-loader 0.2.4 (espeak-ng 1.52): a voice with breath (the female variants, for instance "+f2") gives other
# samples in another second: its noise comes from random numbers that espeak_Initialize seeds with the time. Processes of
# one second agree. The voice without a variant gives equal samples at any time, and espeak_ng_SetRandSeed before the
# synthesis makes the other one do so, too.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --disable-pip-version-check espeakng-loader==0.2.4 \
    2> "$work/warnings" || { cat "$work/warnings"; exit 1; }

cat > "$work/speak.py" << 'PYTHON'
import ctypes
import hashlib
import sys

import espeakng_loader

voice, seed = sys.argv[1:]
library = ctypes.CDLL(espeakng_loader.get_library_path())
found = []
Callback = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.c_void_p)


def collect(samples, count, _):
    if count > 0:
        found.append(ctypes.string_at(samples, 2 * count))
    return 0


callback = Callback(collect)
library.espeak_Initialize(2, 200, espeakng_loader.get_data_path().encode(), 0)
library.espeak_SetSynthCallback(callback)
assert library.espeak_SetVoiceByName(voice.encode()) == 0
if seed != "none":
    library.espeak_ng_SetRandSeed(ctypes.c_long(int(seed)))
text = b"Good morning to all of you."
library.espeak_Synth(text, len(text) + 1, 0, 1, 0, 1, None, None)
library.espeak_Synchronize()
print(hashlib.sha256(b"".join(found)).hexdigest()[:12])
PYTHON

echo "espeakng-loader 0.2.4"
changed=0
look() { # voice, seed, whether two seconds give equal samples
    first=$("$work/environment/bin/python" "$work/speak.py" "$1" "$2")
    sleep 1.5
    second=$("$work/environment/bin/python" "$work/speak.py" "$1" "$2")
    echo "voice $1, seed $2: $first, 1.5 s later $second"
    [ "$([ "$first" = "$second" ] && echo equal || echo other)" = "$3" ] || changed=1
}
look en-us none equal
look en-us+f2 none other
look en-us+f2 1 equal
[ "$changed" = 0 ] || { echo changed; exit 1; }
echo "as described"
