#!/usr/bin/env bash
# PyLiveLinkFace 0.1 (with timecode 1.5.1): the frame numbers of Live Link Face that it sends run forwards and
# backwards. Within a second the number comes from the microseconds behind the last whole millisecond, of which a
# timecode makes a part of a second: packets at 60 a second, on time, have the numbers 0, 40, 20, 0, 40, 20 ..., and
# others at other moments. The rate that it sends is right for 60 only: numerator and denominator are 30 and 0 for 30
# frames a second, 24 and 0 for 24, 120 and 2 (which is 60) for 120. A receiver must not order faces by these times.
# The 61 values are right.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet PyLiveLinkFace==0.1 timecode==1.5.1 numpy==2.4.6
"$work/environment/bin/python" - <<'END'
import datetime
import struct
import sys
from importlib.metadata import version
from unittest import mock

from pylivelinkface import FaceBlendShape, PyLiveLinkFace, pylivelinkface

BEGIN = datetime.datetime(2026, 1, 1, 10)


def sent(face, moment):
    """Frame number, rate's numerator and denominator, and values of a packet at a moment."""
    with mock.patch.object(pylivelinkface.datetime, "datetime", mock.Mock(now=lambda: moment)):
        packet = face.encode()
    (n_letters,) = struct.unpack_from("!i", packet, 41)
    frame, _, numerator, denominator, _ = struct.unpack_from("!ifiib", packet, 45 + n_letters)
    return frame, numerator, denominator, struct.unpack_from("!61f", packet, 62 + n_letters)


face = PyLiveLinkFace(fps=60)
face.set_blendshape(FaceBlendShape.JawOpen, 0.5, no_filter=True)
packets = [sent(face, BEGIN + datetime.timedelta(seconds=number / 60)) for number in range(61)]
frames = [packet[0] - packets[0][0] for packet in packets]
rates = {fps: sent(PyLiveLinkFace(fps=fps), BEGIN)[1:3] for fps in (24, 30, 60, 120)}
print("PyLiveLinkFace", version("PyLiveLinkFace"), "timecode", version("timecode"))
print("frame numbers of the packets of 1 s:", *frames)
print("rates as numerator and denominator:", rates)
holds = frames == [0, 40, 20] * 20 + [60]
holds &= rates == {24: (24, 0), 30: (30, 0), 60: (60, 1), 120: (120, 2)}
holds &= packets[0][3][FaceBlendShape.JawOpen.value] == 0.5
if not holds:
    sys.exit("changed")
END
echo "as described"
