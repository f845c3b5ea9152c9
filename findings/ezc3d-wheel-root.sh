#!/usr/bin/env bash
# ezc3d 1.7.2: its wheel writes its source tree (README.md, LICENSE, setup.py, src, include ...) into the root of the
# environment in which it is installed; as root without an environment that is the system's prefix.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
ls -A "$work/environment" | sort > "$work/before"
"$work/environment/bin/pip" install --quiet --no-deps --only-binary=:all: ezc3d==1.7.2
ls -A "$work/environment" | sort > "$work/after"

"$work/environment/bin/pip" list | grep -i ezc3d
echo "new in the root of the environment:"
comm -13 "$work/before" "$work/after" | tee "$work/new"
echo "lines of its RECORD that leave the folder of packages:"
find "$work/environment" -path '*ezc3d-1.7.2.dist-info/RECORD' -exec grep -c '^\.\./\.\./\.\./' {} +

for name in LICENSE README.md include setup.py src; do
    grep -qx "$name" "$work/new" || [ "$name" = include ] || { echo "changed: $name is not written"; exit 1; }
done
echo "as described"
