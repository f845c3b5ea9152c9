"""Receivers of live targets in a process of their own: ``python -m tests.targets.receivers KIND PORT``.

Each prints lines of JSON: ``{"event": "ready"}``, and what has arrived.
"""

import asyncio
import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np

from tests.running import LoggedProcess

N_TOLD = 60  # pictures or messages after which a receiver says so
LOUD = 3000  # of 16-bit samples
TOKEN = "s3cret-token"


def tell(event: str, **fields: Any) -> None:
    sys.stderr.write(json.dumps({"event": event, **fields}) + "\n")
    sys.stderr.flush()


def listen(url: str, options: dict[str, str]) -> None:
    """A server of RTMP or RTSP: pictures, samples, and their times."""
    import av

    tell("ready")
    times: dict[str, list[float]] = {"video": [], "audio": []}
    loud = n_samples = 0.0
    levels: list[float] = []
    container = av.open(url, "r", options=options)
    tell("connected", streams=[stream.codec_context.name for stream in container.streams])
    comment = container.metadata.get("comment", "")
    try:
        for packet in container.demux():
            for frame in packet.decode():
                kind = "video" if isinstance(frame, av.VideoFrame) else "audio"
                if frame.time is not None:
                    times[kind].append(float(frame.time))
                if isinstance(frame, av.VideoFrame):
                    levels.append(float(frame.to_ndarray(format="gray").mean()))
                else:
                    samples = frame.to_ndarray().astype(np.float64)
                    loud, n_samples = max(loud, float(np.abs(samples).max())), n_samples + frame.samples
                if kind == "video" and len(times[kind]) == N_TOLD:
                    tell("sixty")
    except (OSError, ValueError) as error:
        tell("error", message=str(error))
    ends = {kind: (values[0], values[-1], len(values)) for kind, values in times.items() if values}
    tell(
        "received", times=ends, loudest=loud, n_samples=n_samples, comment=comment, levels=len(set(map(round, levels)))
    )


class WhipEndpoint:
    """A WHIP endpoint by aiortc, which demands the token."""

    def __init__(self, port: int) -> None:
        self._port, self._peers, self._tasks = port, [], []  # type: ignore[var-annotated]
        self._counts = {"video": 0, "audio": 0, "loud": 0}

    async def serve(self) -> None:
        from aiohttp import web

        application = web.Application()
        application.router.add_post("/w", self.offered)
        application.router.add_delete("/w/1", self.gone)
        runner = web.AppRunner(application)
        await runner.setup()
        await web.TCPSite(runner, "127.0.0.1", self._port).start()
        tell("ready")
        await asyncio.Event().wait()

    async def offered(self, request: Any) -> Any:
        from aiohttp import web
        from aiortc import RTCPeerConnection, RTCSessionDescription

        if request.headers.get("Authorization") != f"Bearer {TOKEN}":
            return web.Response(status=401, text="no")
        peer: Any = RTCPeerConnection()
        self._peers.append(peer)
        peer.on("track", lambda track: self._tasks.append(asyncio.ensure_future(self.take(track))))
        await peer.setRemoteDescription(RTCSessionDescription(await request.text(), "offer"))
        await peer.setLocalDescription(await peer.createAnswer())
        place = f"http://127.0.0.1:{self._port}/w/1"
        sdp = peer.localDescription.sdp
        return web.Response(status=201, text=sdp, content_type="application/sdp", headers={"Location": place})

    async def take(self, track: Any) -> None:
        from aiortc.mediastreams import MediaStreamError

        with suppress(MediaStreamError):
            while True:
                frame = await track.recv()
                self._counts[track.kind] += 1
                if track.kind == "audio":
                    self._counts["loud"] += bool(np.abs(frame.to_ndarray()).max() > LOUD)
                elif self._counts["video"] == N_TOLD:
                    tell("sixty", width=frame.width, height=frame.height)

    async def gone(self, _: Any) -> Any:
        from aiohttp import web

        tell("received", **self._counts)
        for peer in self._peers:
            await peer.close()
        return web.Response(text="ok")


class StudioServer:
    """A WebSocket that answers as VTube Studio does, and takes curves: counts, ids and tokens."""

    def __init__(self, port: int) -> None:
        self._port, self._n, self._asked = port, 0, 0

    async def serve(self) -> None:
        import websockets

        async with websockets.serve(self.answer, "127.0.0.1", self._port, compression=None):
            tell("ready")
            await asyncio.Event().wait()

    async def answer(self, socket: Any) -> None:
        tell("opened", authorization=socket.request.headers.get("Authorization", ""))
        async for text in socket:
            given = json.loads(text)
            if given.get("type") == "mark":
                tell("mark", notice=given["notice"])
                continue
            if given.get("type") == "curves":
                self.count(given)
                continue
            kind, data = given["messageType"], {}
            if kind == "AuthenticationTokenRequest":
                tell("agreed", name=given["data"]["pluginName"])
                data = {"authenticationToken": TOKEN}
            elif kind == "AuthenticationRequest":
                data = {"authenticated": given["data"]["authenticationToken"] == TOKEN}
            else:
                self.count(
                    {"found": given["data"]["faceFound"]}
                    | {one["id"]: one["value"] for one in given["data"]["parameterValues"]}
                )
            answer = {name: given[name] for name in ("apiName", "apiVersion", "requestID")}
            await socket.send(json.dumps(answer | {"messageType": kind.replace("Request", "Response"), "data": data}))
        tell("closed", n=self._n)

    def count(self, content: dict[str, Any]) -> None:
        self._n += 1
        if self._n in {1, N_TOLD}:
            tell("first" if self._n == 1 else "sixty", content=content)


@contextmanager
def receiver(kind: str, port: int) -> Iterator[LoggedProcess]:
    """A receiver that is ready, and ends with the block."""
    process = LoggedProcess("-m", "tests.targets.receivers", kind, str(port), environment={})
    try:
        process.wait_for_event("ready")
        yield process
    finally:
        if process.process.poll() is None:
            process.process.kill()
        process.process.wait()
        process.process.stdin.close()  # type: ignore[union-attr]


def main() -> None:
    kind, port = sys.argv[1], int(sys.argv[2])
    match kind:
        case "rtmp":
            listen(f"rtmp://127.0.0.1:{port}/live/key", {"listen": "1", "timeout": "60"})
        case "rtsp":
            listen(f"rtsp://127.0.0.1:{port}/live", {"rtsp_flags": "listen", "listen_timeout": "60"})
        case "whip":
            asyncio.run(WhipEndpoint(port).serve())
        case "sockets":
            asyncio.run(StudioServer(port).serve())


if __name__ == "__main__":
    main()
