"""An avatar whose text a language model writes word by word: sound and 52 ARKit weights a frame over a WebSocket.

    pip install '.[service]'
    tts2face serve --port 8880
    python live_stream.py ws://localhost:8880 "Hello there, how are you? I am well. We were away."

Sentences are spoken as soon as they are complete. The sound becomes `live.wav`; the weights, which an avatar would take
as they come, become `live.csv`. All messages: docs/http.md.
"""

import asyncio
import csv
import json
import sys
import wave

import websockets


async def write_words(connection, text):
    for word in text.split():
        await connection.send(json.dumps({"type": "text", "text": f"{word} "}))
        await asyncio.sleep(0.05)
    await connection.send(json.dumps({"type": "end"}))


def curve_rows(event):
    """Weights of a message: frame i is due at begin + i / fps on the clock of the stream."""
    if "names" in event:
        yield ["seconds", *event["names"]]
    for number, weights in enumerate(event["weights"]):
        yield [round(event["begin"] + number / event["fps"], 4), *weights]


async def show(connection, sound, table):
    async for message in connection:
        if isinstance(message, bytes):
            sound.writeframes(message)
            continue
        event = json.loads(message)
        if event["type"] == "speech":
            if not sound.getnframes():
                sound.setparams((1, 2, event["rate"], 0, "NONE", ""))
            print(f"{event['begin']:5.2f} s  {event['text']}")
        elif event["type"] == "curves":
            table.writerows(curve_rows(event))
        elif event["type"] == "error":
            print(event["message"])


async def main(url, text):
    async with websockets.connect(f"{url}/v1/stream", max_size=None) as connection:
        await connection.send(json.dumps({"type": "start", "style": "delighted", "fps": 30, "with_idle": False}))
        with wave.open("live.wav", "wb") as sound, open("live.csv", "w", newline="") as file:
            await asyncio.gather(write_words(connection, text), show(connection, sound, csv.writer(file)))


asyncio.run(main(*sys.argv[1:]))
