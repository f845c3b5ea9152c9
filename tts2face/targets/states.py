"""States of a target, each with one sentence for people."""

from dataclasses import dataclass

CONNECTING, CONNECTED = "connecting", "connected"
LOST, CLOSED = "lost", "closed"


@dataclass(frozen=True, slots=True)
class TargetState:
    """One state of a target.

    Parameters
    ----------
    target
        Its kind and place, or the operator's name of it.
    state
        `CONNECTING`, `CONNECTED`, `LOST` or `CLOSED`.
    reason
        Why it is lost.
    retry_s
        Seconds until it is tried again.
    """

    target: str
    state: str
    reason: str = ""
    retry_s: float = 0.0

    @property
    def sentence(self) -> str:
        """One line that says it."""
        if self.state != LOST:
            return f"{self.target}: {self.state}"
        return f"{self.target}: lost: {self.reason}; it is tried again in {self.retry_s:g} s"
