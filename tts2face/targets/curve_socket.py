"""A WebSocket of curves: each frame as JSON, in the form of the service's live streams (docs/http.md)."""

from collections.abc import Callable
from json import dumps

from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.storage.marks import mark_fields
from tts2face.targets.address import TOKEN_VARIABLE, Address
from tts2face.targets.sockets import connected
from tts2face.targets.target import ConnectedTarget
from tts2face.targets.tick import LiveFormat, Tick
from tts2face.types import HEAD_CHANNELS

TOKEN = "token"  # option: file of a Bearer token


class CurveSocketTarget(ConnectedTarget):
    """An event ``mark``, then ``curves``, of which the first one names weights and head channels."""

    has_curves = True

    def __init__(self, address: Address, format: LiveFormat) -> None:
        super().__init__(address, format)
        self._token = address.secret(TOKEN, TOKEN_VARIABLE)

    async def deliver(self, on_connected: Callable[[], None]) -> None:
        """Connect, and send the newest frame whenever the one before has been taken."""
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else None
        async with connected(self.address.url, headers) as socket:
            await socket.send(dumps({"type": "mark", **mark_fields(self.mark)}))
            on_connected()
            names: dict[str, object] = {"names": ARKIT_SHAPES, "head_names": HEAD_CHANNELS}
            while ticks := await self.outbox.take():
                await socket.send(self._text(ticks[-1], names))
                names = {}

    def _text(self, tick: Tick, names: dict[str, object]) -> str:
        assert tick.weights is not None
        rows = [[round(float(value), 4) for value in row] for row in (tick.weights, tick.head)]
        content = {"type": "curves", "begin": round(tick.seconds, 4), "fps": float(self.format.fps), **names}
        return dumps(content | {"weights": rows[:1], "head": rows[1:]}, separators=(",", ":"))
