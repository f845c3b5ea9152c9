"""Quality of the pictures of a movie that is seen while it is made: it falls before the movie falls behind."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quality:
    """Cost of pictures: whether they have all samples, or one a pixel; and of how many frames one is drawn."""

    has_all_samples: bool = True
    frame_step: int = 1


QUALITIES = (Quality(), Quality(False), Quality(False, 2), Quality(False, 3))  # at 30 frames a second: at least ten
CHECK_S = 0.25  # of the movie after which the quality may change
LOW_LEAD_S, HIGH_LEAD_S = 1.0, 2.0  # of the lead, below which the quality may fall, and beyond which it rises
LEAST_GAIN = 0.2  # of a second, by which the lead grows with each second of pictures; speech needs some time, too


class Pace:
    """Quality at which a movie is made as fast as it is seen.

    Parameters
    ----------
    lead
        Returns the seconds by which the movie is ahead of who sees it.
    """

    def __init__(self, lead: Callable[[], float]) -> None:
        self._lead = lead
        self._level = 0
        self._n_drawn = 0
        self._lead_before = 0.0

    @property
    def quality(self) -> Quality:
        """How frames are drawn at the moment."""
        return QUALITIES[self._level]

    def begin(self) -> None:
        """Begin to measure: what was done since the last frame was not drawing."""
        self._n_drawn = 0

    def advance(self, fps: float) -> None:
        """Note that a frame is in the movie; every `CHECK_S` of them the quality may change by one step."""
        if self._n_drawn == 0:
            self._lead_before = self._lead()
        self._n_drawn += 1
        if self._n_drawn <= CHECK_S * fps:
            return
        lead, self._n_drawn = self._lead(), 0
        if lead < LOW_LEAD_S and lead - self._lead_before < LEAST_GAIN * CHECK_S:
            self._level = min(self._level + 1, len(QUALITIES) - 1)
        elif lead > HIGH_LEAD_S:
            self._level = max(self._level - 1, 0)
