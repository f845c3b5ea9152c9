"""Places of tasks in a synthesis process, and the share of them that a key has."""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from typing import Any

from tts2face.picture.sound_stream import SOUND_KINDS
from tts2face.picture.streamed_movie import MOVIE_KINDS
from tts2face.serving.service.messages import Work

# Shares of a core of a stream in real time, rounded up.
MOVIE_COST = 1.0
LINES_COST = 0.2
SOUND_COST = 0.1
LIVE_COST = 0.02  # of a live stream, which mostly waits for a sentence
# Tasks of each cost that one process makes at a time. They bound its memory (a movie takes 37 MB, a live stream less
# than 1 MB); computing is shared by turns.
PLACES = {MOVIE_COST: 8, LINES_COST: 10, SOUND_COST: 20, LIVE_COST: 1000}
MOST_BEGUN = 1.25  # times as many may have begun, with those that wait for their readers
MOST_BEGUN_BY_SHARE = 1.5  # likewise, for keys that have less than their share of the places


def work_cost(work: Work, *, is_live: bool = False) -> float:
    """Share of a core that a task takes; `is_live`: it gets inputs while it is made."""
    if is_live:
        return LIVE_COST
    if work.format in SOUND_KINDS:
        return SOUND_COST
    return MOVIE_COST if work.format in MOVIE_KINDS else LINES_COST


@dataclass(slots=True, eq=False)
class Place:
    """Of a task in a process; while the task waits for its reader, another one can begin."""

    cost: float
    key: str
    process: Any
    is_paused: bool = False


class Places:
    """Places of the tasks that have begun in one process."""

    def __init__(self) -> None:
        self.begun: list[Place] = []

    @property
    def load(self) -> float:
        """Share of a core that the tasks take."""
        return sum(place.cost for place in self.begun)

    def of(self, cost: float) -> list[Place]:
        """Those of one cost."""
        return [place for place in self.begun if place.cost == cost]

    def take(self, cost: float, key: str, process: Any) -> Place:
        """Place of a task that begins."""
        self.begun.append(Place(cost, key, process))
        return self.begun[-1]

    def has_room(self, cost: float, *, has_less: bool) -> bool:
        """Whether a task can begin; `has_less`: its key has less than its share of the places."""
        begun = self.of(cost)
        if has_less:
            return len(begun) < MOST_BEGUN_BY_SHARE * PLACES[cost]
        n_made = sum(not place.is_paused for place in begun)
        return n_made < PLACES[cost] and len(begun) < MOST_BEGUN * PLACES[cost]


def has_less_than_share(processes: Sequence[Places], cost: float, key: str, waiting: Set[str]) -> bool:
    """Whether a key has begun fewer tasks of a cost than there are places for each key that has or awaits some.

    Parameters
    ----------
    waiting
        Keys that await some.
    """
    holders = [place.key for places in processes for place in places.of(cost)]
    n_keys = len({key, *holders, *waiting})
    return holders.count(key) < max(1, len(processes) * PLACES[cost] // n_keys)
