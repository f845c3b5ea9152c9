#!/usr/bin/env bash
# python-osc 1.10.2: a star means one thing in the address of a message and another in an address given to
# `Dispatcher.map`. In a message it matches within a part between slashes (OSC 1.0); in a mapping it matches across
# them: "/face/*" takes "/face/jaw/open" too, and "/face/*/open" takes "/face/a/b/open". The other signs of OSC (?,
# [ab], {a,b}) match in messages; in a mapping they are ordinary letters, or, beside a star, signs of Python's regular
# expressions: there a dot takes any letter and "/face(1)/*" does not take "/face(1)/a".
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: python-osc==1.10.2
"$work/environment/bin/python" - <<'END'
import sys
from importlib.metadata import version

from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_message_builder import build_msg


def is_taken(mapped, sent):
    """Whether a handler of one address gets a message of another."""
    dispatcher, heard = Dispatcher(), []
    dispatcher.map(mapped, lambda address, *values: heard.append(address))
    dispatcher.call_handlers_for_packet(build_msg(sent, [0.5]).dgram, ("127.0.0.1", 9))
    return heard == [sent]


expected = {
    ("/face/jaw", "/face/*"): True,
    ("/face/jaw/open", "/face/*"): False,
    ("/face/a", "/face/?"): True,
    ("/face/a", "/face/{a,b}"): True,
    ("/face/*", "/face/jaw"): True,
    ("/face/*", "/face/jaw/open"): True,
    ("/face/*/open", "/face/a/b/open"): True,
    ("/face/?", "/face/a"): False,
    ("/face/[ab]", "/face/a"): False,
    ("/face/{a,b}", "/face/a"): False,
    ("/v1.0/*", "/v1x0/a"): True,
    ("/v1.0/a", "/v1x0/a"): False,
    ("/face(1)/*", "/face(1)/a"): False,
    ("/face(1)/a", "/face(1)/a"): True,
}
print("python-osc", version("python-osc"))
found = {pair: is_taken(*pair) for pair in expected}
for (mapped, sent), taken in found.items():
    print(f"mapped {mapped}, sent {sent}: {'taken' if taken else 'not taken'}")
if found != expected:
    sys.exit("changed")
END
echo "as described"
