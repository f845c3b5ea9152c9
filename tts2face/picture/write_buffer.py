"""A stream that collects what an encoder writes until it is taken."""

import io


class WriteBuffer(io.RawIOBase):
    """Write-only stream without positions, so that encoders never go back."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, content: object) -> int:
        """Append bytes."""
        part = bytes(content)  # type: ignore[call-overload]
        self._parts.append(part)
        return len(part)

    def take(self) -> bytes:
        """Return the bytes written since the last call."""
        taken = b"".join(self._parts)
        self._parts.clear()
        return taken
