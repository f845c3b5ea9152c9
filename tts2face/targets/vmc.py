"""VMC protocol: OSC messages to programs of VRM avatars (VSeeFace, VMagicMirror, Unity, Blender).

Sources: Virtual Motion Capture Protocol (protocol.vmc.info), Open Sound Control 1.0 (opensoundcontrol.org).
"""

import struct
from collections.abc import Sequence

import numpy as np

from tts2face.face.deformation import head_rotation
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.interchange.exports.vowels import VowelProjection, blinks, vowel_projection
from tts2face.numeric.arrays import Float32Array, FloatArray, matrix_quaternion
from tts2face.targets.address import Address
from tts2face.targets.target import DatagramTarget
from tts2face.targets.tick import LiveFormat, Tick

PORT = 39_539  # on which receivers of the protocol listen by default
MAX_DATAGRAM_BYTES = 1400  # below what Ethernet carries in one piece
AT_ONCE = struct.pack(">Q", 1)  # time tag of a bundle; receivers hold back what is dated ahead
VOWELS = "vowels"  # option: the names below in place of the 52
# Presets of VRM 0, which receivers of both versions know.
VRM_NAMES = {
    "aa": "A", "ih": "I", "ou": "U", "ee": "E", "oh": "O", "blink": "Blink", "blinkLeft": "Blink_L",
    "blinkRight": "Blink_R",
}  # fmt: skip


def osc_message(address: str, tags: str, *values: str | float) -> bytes:
    """A message of OSC 1.0: strings end with zeros and fill four bytes, numbers are big-endian."""
    packed = [_osc_string(str(value)) if tag == "s" else struct.pack(f">{tag}", value)
              for tag, value in zip(tags, values, strict=True)]  # fmt: skip
    return _osc_string(address) + _osc_string(f",{tags}") + b"".join(packed)


def _osc_string(text: str) -> bytes:
    content = text.encode()
    return content + bytes(4 - len(content) % 4)


def osc_bundles(messages: Sequence[bytes]) -> list[bytes]:
    """Bundles of at most `MAX_DATAGRAM_BYTES`, in the order of their messages."""
    head = _osc_string("#bundle") + AT_ONCE
    bundles, content = [], head
    for message in messages:
        element = struct.pack(">i", len(message)) + message
        if len(content) + len(element) > MAX_DATAGRAM_BYTES:
            bundles.append(content)
            content = head
        content += element
    return [*bundles, content]


class VmcTarget(DatagramTarget):
    """The 52 weights by names with a capital first letter, or vowels and blinks, with the head's bone."""

    def __init__(self, address: Address, format: LiveFormat) -> None:
        super().__init__(address, format)
        self._vowels: VowelProjection | None = vowel_projection() if VOWELS in address.options else None
        names = VRM_NAMES.values() if self._vowels else (name[0].upper() + name[1:] for name in ARKIT_SHAPES)
        # of each frame only the last four bytes of these messages differ
        self._heads = [osc_message("/VMC/Ext/Blend/Val", "sf", name, 0.0)[:-4] for name in names]
        self._before = osc_message("/VMC/Ext/OK", "i", 1)
        self._apply = osc_message("/VMC/Ext/Blend/Apply", "")

    def datagrams(self, tick: Tick) -> list[bytes]:
        """State, time, head, weights, and the order to apply them, which is in the last datagram."""
        assert tick.weights is not None
        values = tick.weights if self._vowels is None else self._vowel_weights(tick.weights, self._vowels)
        bone = osc_message("/VMC/Ext/Bone/Pos", "sfffffff", "Head", 0.0, 0.0, 0.0, *unity_rotation(tick.head))
        weights = [head + struct.pack(">f", value) for head, value in zip(self._heads, values.tolist(), strict=True)]
        time = osc_message("/VMC/Ext/T", "f", tick.seconds)
        return osc_bundles([self._before, time, bone, *weights, self._apply])

    def _vowel_weights(self, weights: Float32Array, vowels: VowelProjection) -> FloatArray:
        rows = weights[None].astype(np.float64)
        found = vowels.weights(rows) | blinks(rows)
        return np.concatenate([found[name] for name in VRM_NAMES])


def unity_rotation(head: Float32Array) -> tuple[float, ...]:
    """Quaternion x, y, z, w of a head pose in Unity's axes: left-handed, x mirrored as UniVRM mirrors glTF's axes."""
    pitch, yaw, roll = (float(angle) for angle in head[:3])
    x, y, z, w = (float(value) for value in matrix_quaternion(head_rotation(pitch, yaw, roll)))
    return x, -y, -z, w
