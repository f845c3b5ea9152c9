#!/usr/bin/env bash
# pipecat-ai 1.14.0: an output transport plays sound in blocks of 40 ms and keeps what is left of the last block. Only a
# TTSStoppedFrame makes it play the rest: of 110 ms of sound 80 are heard, of 30 ms nothing, although an EndFrame
# follows, which ends a pipeline after all that was queued. That holds for OutputAudioRawFrame, which no speech service
# makes and after which no TTSStoppedFrame is expected (a beep, a recording), too. With the frame all of it is heard.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 200 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet pipecat-ai==1.14.0
cat > "$work/play.py" <<'END'
import asyncio
import sys
from importlib.metadata import version

from loguru import logger
from pipecat.frames.frames import OutputAudioRawFrame, SpeechOutputAudioRawFrame, TTSAudioRawFrame, TTSStoppedFrame
from pipecat.tests.utils import SleepFrame, run_test
from pipecat.transports.base_output import BaseOutputTransport
from pipecat.transports.base_transport import TransportParams

logger.remove()
RATE = 24_000


class Speaker(BaseOutputTransport):
    """An output that keeps what it is told to play."""

    def __init__(self):
        super().__init__(TransportParams(audio_out_enabled=True, audio_out_sample_rate=RATE))
        self.played = b""

    async def start(self, frame):
        await super().start(frame)
        await self.set_transport_ready(frame)

    async def write_audio_frame(self, frame):
        self.played += frame.audio
        return True


async def heard(kind, milliseconds, *ends):
    """Milliseconds of a sound without zeros that are played before the pipeline has ended."""
    speaker = Speaker()
    sound = b"\x01\x01" * (milliseconds * RATE // 1000)
    frames = [kind(audio=sound, sample_rate=RATE, num_channels=1), *ends, SleepFrame(sleep=1.0)]
    await run_test(speaker, frames_to_send=frames, send_end_frame=True)
    return speaker.played.count(1) // 2 * 1000 // RATE


async def main():
    print("pipecat-ai", version("pipecat-ai"))
    holds = True
    for kind in (OutputAudioRawFrame, SpeechOutputAudioRawFrame, TTSAudioRawFrame):
        for milliseconds, cut in ((30, 0), (110, 80), (120, 120)):
            found = await heard(kind, milliseconds), await heard(kind, milliseconds, TTSStoppedFrame())
            print(f"{kind.__name__} of {milliseconds} ms: {found[0]} ms played, before TTSStoppedFrame {found[1]}")
            holds &= found == (cut, milliseconds)
    return holds


if not asyncio.run(main()):
    sys.exit("changed")
END
"$work/environment/bin/python" "$work/play.py"
echo "as described"
