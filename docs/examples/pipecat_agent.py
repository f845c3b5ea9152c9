"""A voice agent with a face in Pipecat, without a cloud: it answers the lines of standard input; its film is agent.mp4.

    pip install '.[pipecat]'
    python pipecat_agent.py

It says what it reads; with LLM_MODEL, OPENAI_BASE_URL (http://localhost:11434/v1) and OPENAI_API_KEY a language model
answers. In place of `Film` any transport of Pipecat shows the face to others (docs/agents.md).
"""

import asyncio
import os
import sys

import av
import numpy as np
from openai import AsyncOpenAI
from pipecat.frames.frames import EndFrame, OutputImageRawFrame, TTSAudioRawFrame, TTSSpeakFrame
from pipecat.pipeline.pipeline import Pipeline
from pipecat.pipeline.worker import PipelineWorker
from pipecat.processors.frame_processor import FrameProcessor
from pipecat.workers.runner import WorkerRunner

import tts2face
from tts2face.agents import PipecatFace


class Film(FrameProcessor):
    async def process_frame(self, frame, direction):
        await super().process_frame(frame, direction)
        if isinstance(frame, OutputImageRawFrame):
            picture = av.VideoFrame.from_ndarray(np.frombuffer(frame.image, np.uint8).reshape(256, 256, 3))
            film.mux(pictures.encode(picture))
            self.number = getattr(self, "number", -1) + 1
        elif isinstance(frame, TTSAudioRawFrame):  # of the picture before it
            block = av.AudioFrame.from_ndarray(np.frombuffer(frame.audio, np.int16)[None], "s16", "mono")
            block.sample_rate, block.pts = 48_000, self.number * 1600
            film.mux(sound.encode(block))
        await self.push_frame(frame, direction)


async def main():
    face = PipecatFace(tts2face.Session(face="ada"), size="256x256", speaks_text=True)
    worker, runner = PipelineWorker(Pipeline([face, Film()])), WorkerRunner()
    await runner.add_workers(worker)
    running = asyncio.create_task(runner.run())
    while line := await asyncio.to_thread(sys.stdin.readline):
        if model := os.environ.get("LLM_MODEL"):
            asked = {"model": model, "messages": [{"role": "user", "content": line}]}
            line = (await AsyncOpenAI().chat.completions.create(**asked)).choices[0].message.content
        await worker.queue_frame(TTSSpeakFrame(line))
    await worker.queue_frame(EndFrame())
    await running


with av.open("agent.mp4", "w") as film:
    pictures = film.add_stream("libx264", 30, width=256, height=256, pix_fmt="yuv420p")
    sound = film.add_stream("aac", 48_000, layout="mono")
    asyncio.run(main())
    film.mux([*pictures.encode(), *sound.encode()])
