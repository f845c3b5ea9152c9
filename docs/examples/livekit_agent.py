"""An agent with a face in a LiveKit room: it says, or has a language model answer, what is written in the room's chat.

    pip install '.[livekit]'
    livekit-server --dev
    python livekit_agent.py dev

LIVEKIT_URL (ws://localhost:7880), LIVEKIT_API_KEY and LIVEKIT_API_SECRET name the server; LLM_MODEL, OPENAI_BASE_URL
(http://localhost:11434/v1) and OPENAI_API_KEY a language model.
"""

import asyncio
import os

import numpy as np
from livekit import rtc
from livekit.agents import Agent, AgentSession, WorkerOptions, cli
from livekit.agents.voice.avatar import QueueAudioOutput
from livekit.agents.voice.room_io import RoomOptions, TextInputOptions
from openai import AsyncOpenAI

import tts2face
from tts2face.agents import LiveKitAvatar

RATE, face = 24_000, tts2face.Session(face="ada")


async def spoken(text):
    for piece in await asyncio.to_thread(lambda: list(face.stream_speech(text))):
        samples = np.int16(32767 * piece.clip.speech.waveform.resampled(RATE).samples)
        for block in np.array_split(samples, 1 + len(samples) // 2400):
            yield rtc.AudioFrame(block.tobytes(), RATE, 1, len(block))


async def answer(session, written):
    text = written.text
    if model := os.environ.get("LLM_MODEL"):
        asked = {"model": model, "messages": [{"role": "user", "content": text}]}
        text = (await AsyncOpenAI().chat.completions.create(**asked)).choices[0].message.content
    await session.interrupt()
    return session.say(text, audio=spoken(text))


async def show(session, room):
    avatar, audio = LiveKitAvatar(face, size="256x256"), QueueAudioOutput(sample_rate=RATE)
    await avatar.runner(room, audio).start()
    session.output.audio = audio
    return avatar


async def join(context):
    await context.connect()
    session = AgentSession()
    context.add_shutdown_callback((await show(session, context.room)).aclose)
    chat = RoomOptions(audio_input=False, audio_output=False, text_input=TextInputOptions(text_input_cb=answer))
    await session.start(Agent(instructions=""), room=context.room, room_options=chat)


if __name__ == "__main__":
    cli.run_app(WorkerOptions(entrypoint_fnc=join))
