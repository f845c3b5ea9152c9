"""Words with their seconds, tiers of labels, and what a transcript file says."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SpokenCue:
    """Words spoken between two instants in seconds."""

    start: float
    end: float
    text: str


@dataclass(frozen=True, slots=True)
class Tier:
    """A row of labels of a file, in the order of the file, with silences and noises.

    ``has_points`` if the labels are instants, whose start is their end; ``is_speech`` if the format says that the
    labels are words, whatever their name. ``kind`` is what the file says of the tier beside its name, ``parent`` the
    name of the tier of which the labels are parts or which they annotate, ``notes`` are sentences about its times.
    """

    name: str
    labels: tuple[SpokenCue, ...]
    has_points: bool = False
    is_speech: bool = False
    kind: str = ""
    parent: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Transcript:
    """Spoken words in the order of time, one a cue, and sentences about what was chosen, left out or estimated."""

    words: tuple[SpokenCue, ...]
    notes: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """All words."""
        return " ".join(word.text for word in self.words)
