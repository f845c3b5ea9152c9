#!/usr/bin/env bash
# aiortc 1.16.0: a sound track whose frames are longer than 20 ms loses sound although every packet arrives. It cuts a
# frame into packets of Opus of 20 ms and gives all of them the time of the first one, as if they were parts of one
# picture; the receiver joins packets of one time. Of frames of 40 ms (one per picture at 25 a second) half of the
# sound is heard, of 60 ms a third. Frames of 20 ms, or of 10 ms, are whole.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index; loads 60 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: aiortc==1.16.0 av==18.1.0 numpy==2.4.6
"$work/environment/bin/python" - <<'END'
import asyncio
import sys
from fractions import Fraction
from importlib.metadata import version

import av
import numpy as np
from aiortc import MediaStreamTrack, RTCConfiguration, RTCPeerConnection
from aiortc.mediastreams import MediaStreamError

RATE, SECONDS = 48_000, 3


class Tone(MediaStreamTrack):
    """A tone in frames of one length, in step with the clock; ends after some seconds."""

    kind = "audio"

    def __init__(self, n_samples):
        super().__init__()
        self.n_samples, self.at, self.begin = n_samples, 0, None

    async def recv(self):
        now = asyncio.get_running_loop().time
        self.begin = self.begin or now()
        await asyncio.sleep(max(0.0, self.begin + self.at / RATE - now()))
        if self.at >= SECONDS * RATE:
            self.stop()
            raise MediaStreamError
        samples = 9000 * np.sin((np.arange(self.n_samples) + self.at) * 0.06)
        frame = av.AudioFrame.from_ndarray(samples.astype(np.int16)[None], format="s16", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = RATE, self.at, Fraction(1, RATE)
        self.at += self.n_samples
        return frame


async def hear(track, lengths):
    try:
        while True:
            lengths.append((await track.recv()).samples)
    except MediaStreamError:
        pass


async def share(n_samples):
    """Parts of packets, and of sound, of a track that reach the other side of a connection."""
    sender, receiver = (RTCPeerConnection(RTCConfiguration([])) for _ in range(2))
    lengths, tasks, tone = [], [], Tone(n_samples)
    receiver.on("track", lambda track: tasks.append(asyncio.ensure_future(hear(track, lengths))))
    sender.addTrack(tone)
    await sender.setLocalDescription(await sender.createOffer())
    await receiver.setRemoteDescription(sender.localDescription)
    await receiver.setLocalDescription(await receiver.createAnswer())
    await sender.setRemoteDescription(receiver.localDescription)
    await asyncio.sleep(SECONDS + 3)
    reports = await receiver.getReceivers()[0].getStats()
    (n_packets,) = (report.packetsReceived for report in reports.values() if report.type == "inbound-rtp")
    await sender.close()
    await receiver.close()
    await asyncio.gather(*tasks)
    return n_packets * RATE // 50 / tone.at, sum(lengths) / tone.at


async def main():
    print("aiortc", version("aiortc"), "av", version("av"))
    holds = True
    for milliseconds, expected in ((10, 1), (20, 1), (40, 1 / 2), (60, 1 / 3)):
        packets, heard = await share(milliseconds * RATE // 1000)
        print(f"frames of {milliseconds} ms: {packets:.0%} of the packets arrive, {heard:.0%} of the sound is heard")
        holds &= packets > 0.95 and abs(heard - expected) < 0.08
    return holds


if not asyncio.run(main()):
    sys.exit("changed")
END
echo "as described"
