#!/usr/bin/env bash
# aiortc 1.16.0: a picture track of an odd width or height ends at its first picture when H.264 is agreed on (libx264
# refuses odd sizes of yuv420p). The only sign is a traceback in the log: both connections stay "connected", the
# transceiver "sendonly", the receiver's track "live", and no picture comes. The sender's track is "ended" and
# `RTCRtpSender.track` is None; no event of the connection tells it. VP8 sends the same pictures.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index; loads 60 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: aiortc==1.16.0 av==18.1.0 numpy==2.4.6
"$work/environment/bin/python" - <<'END'
import asyncio
import logging
import sys
from fractions import Fraction
from importlib.metadata import version

import av
import numpy as np
from aiortc import MediaStreamTrack, RTCConfiguration, RTCPeerConnection, RTCRtpSender
from aiortc.mediastreams import MediaStreamError

logging.getLogger("aiortc").setLevel(logging.CRITICAL)


class Pictures(MediaStreamTrack):
    """Grey pictures of one size, 25 a second."""

    kind = "video"

    def __init__(self, width, height):
        super().__init__()
        self.pixels, self.number = np.full((height, width, 3), 128, np.uint8), 0

    async def recv(self):
        await asyncio.sleep(0.04)
        frame = av.VideoFrame.from_ndarray(self.pixels, format="rgb24")
        frame.pts, frame.time_base = 3600 * self.number, Fraction(1, 90_000)
        self.number += 1
        return frame


async def see(track, seen):
    try:
        while True:
            seen.append(await track.recv())
    except MediaStreamError:
        pass


async def send(kind, width, height):
    """Whether pictures arrive, and the states of both sides after 3 s."""
    sender, receiver = (RTCPeerConnection(RTCConfiguration([])) for _ in range(2))
    seen, tasks = [], []
    receiver.on("track", lambda track: tasks.append(asyncio.ensure_future(see(track, seen))))
    source = sender.addTrack(Pictures(width, height))
    track, (transceiver,) = source.track, sender.getTransceivers()
    codecs = RTCRtpSender.getCapabilities("video").codecs
    transceiver.setCodecPreferences([codec for codec in codecs if codec.mimeType == kind])
    await sender.setLocalDescription(await sender.createOffer())
    await receiver.setRemoteDescription(sender.localDescription)
    await receiver.setLocalDescription(await receiver.createAnswer())
    await sender.setRemoteDescription(receiver.localDescription)
    await asyncio.sleep(3)
    states = (sender.connectionState, receiver.connectionState, transceiver.currentDirection)
    tracks = (receiver.getReceivers()[0].track.readyState, track.readyState, source.track is None)
    await sender.close()
    await receiver.close()
    await asyncio.gather(*tasks)
    return len(seen) > 0, *states, *tracks


WORKS = (True, "connected", "connected", "sendonly", "live", "live", False)
STOPS = (False, "connected", "connected", "sendonly", "live", "ended", True)


async def main():
    print("aiortc", version("aiortc"), "av", version("av"))
    holds = True
    for kind in ("video/H264", "video/VP8"):
        for width, height in ((64, 64), (65, 64), (64, 65)):
            found = await send(kind, width, height)
            print(f"{kind} {width} x {height}: {found}")
            holds &= found == (STOPS if kind == "video/H264" and (width, height) != (64, 64) else WORKS)
    return holds


if not asyncio.run(main()):
    sys.exit("changed")
END
echo "as described"
