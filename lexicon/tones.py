"""How a word is said beside its sentence: emphasis, pitch, range and contour."""

from dataclasses import dataclass

Contour = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Tone:
    """Addition of a word to its sentence; the level is that of the runs of a text (`lexicon.marked_text`).

    Parameters
    ----------
    emphasis
        1 strong, 0.6 moderate, 0 none, -1 reduced.
    pitch
        Semitones added.
    range
        Factor of the distances of F0 from the median of the sentence.
    contour
        Points of a broken line: share of the time of its words, 0 to 1, and semitones added there. Successive words of
        one contour have it together.
    """

    emphasis: float = 0.0
    pitch: float = 0.0
    range: float = 1.0
    contour: Contour = ()


EVEN = Tone()
