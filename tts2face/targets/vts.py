"""VTube Studio: its input parameters, of the newest frame whenever the answer to the one before is there.

Source: the API's documentation (github.com/DenchiSoft/VTubeStudio, MIT). The token that the user grants there is kept
only with the option ``keep``.
"""

import asyncio
import os
from collections.abc import Callable, Mapping
from functools import cache
from json import dumps
from pathlib import Path
from typing import Any

import numpy as np

from lexicon.errors import DataError
from lexicon.values.json_text import parse_json
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.numeric.arrays import FloatArray
from tts2face.storage.files import write_atomically
from tts2face.storage.user_folders import user_data
from tts2face.targets.sockets import connected
from tts2face.targets.target import ConnectedTarget, TargetLostError
from tts2face.targets.tick import Tick
from tts2face.types import HEAD_CHANNELS

PORT = 8001  # of its API by default
KEEP = "keep"  # option: the token is kept in the user's folder
PLUGIN = {"pluginName": "tts2face", "pluginDeveloper": "tts2face"}
AGREE_S = 120.0  # for which the user is waited for
ANSWER_S = 5.0
PRIVATE, PRIVATE_FOLDER = 0o600, 0o700
ERROR_KIND = "APIError"
TABLE = Path(__file__).with_name("vts.tsv")


class VtsTarget(ConnectedTarget):
    """Parameters of the face, mouth, eyes and brows, which a model's own settings connect with its drawing."""

    has_curves = True

    async def deliver(self, on_connected: Callable[[], None]) -> None:
        """Connect with a token that is kept or granted, and send frames."""
        async with connected(self.address.url) as socket:
            await self._enter(socket)
            on_connected()
            while ticks := await self.outbox.take():
                values = [{"id": name, "value": value} for name, value in parameters(ticks[-1]).items()]
                data = {"faceFound": True, "mode": "set", "parameterValues": values}
                await _ask(socket, "InjectParameterData", data)

    @property
    def token_file(self) -> Path:
        """File of the token that is kept for this place."""
        name = "".join(letter if letter.isalnum() else "-" for letter in f"{self.address.host}-{self.address.port}")
        return user_data() / "vtube-studio" / f"{name}.token"

    async def _enter(self, socket: Any) -> None:
        """Authenticate, with the user's agreement in VTube Studio where no token is valid."""
        token = _kept_token(self.token_file) if KEEP in self.address.options else ""
        if token and await _is_valid(socket, token):
            return
        granted = await _ask(socket, "AuthenticationToken", PLUGIN, AGREE_S)
        token = str(granted.get("authenticationToken", ""))
        if not await _is_valid(socket, token):
            raise TargetLostError("VTube Studio grants a token and refuses it; allow the plugin tts2face there")
        if KEEP in self.address.options:
            self.token_file.parent.mkdir(mode=PRIVATE_FOLDER, parents=True, exist_ok=True)
            write_atomically(self.token_file, token.encode())
            os.chmod(self.token_file, PRIVATE)


def _kept_token(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except (OSError, ValueError):  # none is kept, or it is damaged: another one is granted
        return ""


async def _is_valid(socket: Any, token: str) -> bool:
    answer = await _ask(socket, "Authentication", PLUGIN | {"authenticationToken": token})
    return answer.get("authenticated") is True


async def _ask(socket: Any, kind: str, data: Mapping[str, Any], seconds: float = ANSWER_S) -> Mapping[str, Any]:
    """Data of the answer to a request; other messages are left out, and a refusal is a `TargetLostError`."""
    await socket.send(dumps({
        "apiName": "VTubeStudioPublicAPI", "apiVersion": "1.0", "requestID": kind, "messageType": f"{kind}Request",
        "data": data,
    }))  # fmt: skip
    async with asyncio.timeout(seconds):
        while True:
            try:
                answer = parse_json(await socket.recv(), "an answer of VTube Studio")
            except DataError as wrong:
                raise TargetLostError(str(wrong)) from wrong
            content = answer.get("data") if isinstance(answer, dict) else None
            if not isinstance(content, dict):
                raise TargetLostError("it does not answer as VTube Studio does")
            if answer.get("messageType") == ERROR_KIND:
                raise TargetLostError(f"VTube Studio refuses {kind}: {str(content.get('message'))[:200]}")
            if answer.get("requestID") == kind:
                return content


def parameters(tick: Tick) -> dict[str, float]:
    """Values of VTube Studio's parameters."""
    names, matrix, limits = parameter_matrix()
    assert tick.weights is not None
    given = np.concatenate([[1.0], tick.weights, np.degrees(tick.head[:3])])
    values = (matrix @ given).clip(limits[:, 0], limits[:, 1])
    return dict(zip(names, values.round(4).tolist(), strict=True))


@cache
def parameter_matrix() -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Names (P,), factors (P, 1 + 52 + 3) of constant, weights and angles, and limits (P, 2) of `TABLE`."""
    sources = ("1", *ARKIT_SHAPES, *HEAD_CHANNELS[:3])
    lines = [line.split("\t") for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    names = tuple(dict.fromkeys(row[0] for row in lines[1:]))
    matrix, limits = np.zeros((len(names), len(sources))), np.zeros((len(names), 2))
    for name, source, factor, low, high in lines[1:]:
        matrix[names.index(name), sources.index(source)] = float(factor)
        limits[names.index(name)] = float(low), float(high)
    return names, matrix, limits
