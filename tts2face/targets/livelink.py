"""Live Link Face: packets of version 6, as Unreal Engine and open decoders of the app's stream read them.

Little-endian version; the device in 37 bytes; then big-endian: length and name of the subject, frame and its part,
rate and denominator, the number of values and the values: 52 weights, and yaw, pitch, roll of head and eyes in radians.
"""

import datetime
import struct
import uuid

from tts2face.interchange.exports.livelink import HEAD_SIGNS
from tts2face.targets.address import Address
from tts2face.targets.target import DatagramTarget
from tts2face.targets.tick import LiveFormat, Tick
from tts2face.types import HEAD_CHANNELS

PORT = 11_111  # on which Unreal Engine listens by default
VERSION, N_VALUES = 6, 61
SUBJECT = "subject"  # option: name under which the receiver lists the face
MAX_SUBJECT_BYTES = 64


class LiveLinkTarget(DatagramTarget):
    """The 52 weights with the angles of head and eyes, signed as in the product's files of Live Link Face."""

    def __init__(self, address: Address, format: LiveFormat) -> None:
        super().__init__(address, format)
        subject = address.options.get(SUBJECT, "tts2face").encode()[:MAX_SUBJECT_BYTES]
        subject = subject.decode(errors="ignore").encode()
        device = f"${uuid.uuid5(uuid.NAMESPACE_DNS, f'{subject!r}.tts2face')}".upper().encode()
        self._before = struct.pack("<i", VERSION) + device + struct.pack(">i", len(subject)) + subject
        self._rate = format.fps

    def datagrams(self, tick: Tick) -> list[bytes]:
        """One packet, whose frame number is the time of day, as the app's."""
        assert tick.weights is not None
        assert tick.eyes is not None
        now = datetime.datetime.now()
        seconds = (now - now.replace(hour=0, minute=0, second=0, microsecond=0)).total_seconds()
        frame, part = divmod(seconds * float(self._rate), 1.0)
        clock = struct.pack(">ifii", int(frame), part, self._rate.numerator, self._rate.denominator)
        head = [HEAD_SIGNS[name] * float(tick.head[HEAD_CHANNELS.index(name)]) for name in HEAD_SIGNS]
        values = [*tick.weights.tolist(), *head, *tick.eyes.tolist()]
        return [self._before + clock + struct.pack(f">B{N_VALUES}f", N_VALUES, *values)]
