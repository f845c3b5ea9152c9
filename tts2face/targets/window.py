"""A window that shows a live face, as ``--view`` shows a clip; it takes the thread that runs it."""

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

from lexicon.errors import InputError
from tts2face.models.light import Photographed
from tts2face.numeric.arrays import Float32Array
from tts2face.picture.display import require_display
from tts2face.targets.address import Address
from tts2face.targets.target import Target
from tts2face.targets.tick import LiveFormat, Tick

if TYPE_CHECKING:
    from tts2face.models.face import Face
    from tts2face.picture.options import Picture


class WindowTarget(Target):
    """Keeps the newest motion for a window; without pyvista or a display there is none (`BackendError`)."""

    def __init__(self, address: Address, format: LiveFormat) -> None:
        super().__init__(address, format)
        require_display("the target window", "choose another target")
        self._newest: tuple[Float32Array, Float32Array] | None = None
        self._ended = asyncio.Event()

    def send(self, tick: Tick) -> None:
        """Keep the motion of a tick."""
        self._newest = tick.motion, tick.head

    async def connect(self, on_connected: Callable[[], None]) -> None:
        """Wait for the end: the window is on this machine."""
        on_connected()
        await self._ended.wait()

    def end(self) -> None:
        """Stop at once."""
        self._ended.set()

    def take(self) -> tuple[Float32Array, Float32Array] | None:
        """Newest weights (K,) and head pose (6,), once."""
        newest, self._newest = self._newest, None
        return newest

    def show(self, face: "Face", picture: "Picture") -> None:
        """Show the face until the window is closed.

        Raises
        ------
        InputError
            The face is that of a photograph.
        """
        from tts2face.picture.window import LiveWindow

        if isinstance(face.light, Photographed):
            raise InputError("the target window shows heads; send the face of a photograph to another target")
        window = LiveWindow(face, picture, self.take)
        try:
            window.run()
        finally:
            window.close()
