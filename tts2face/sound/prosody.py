"""How a voice speaks a sentence: rate, pitch, range and formants."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Prosody:
    """Rate, pitch and colour of a sentence; those of single words are their `lexicon.tones.Tone`.

    Parameters
    ----------
    rate
        Factor of the speaking rate.
    pitch
        Semitones added to F0.
    range
        Factor of the distances of F0 from its median, in semitones.
    formants
        Factor of the frequencies of the formants: of a shorter vocal tract above 1.
    """

    rate: float = 1.0
    pitch: float = 0.0
    range: float = 1.0
    formants: float = 1.0

    def combined(self, other: "Prosody") -> "Prosody":
        """Both at once."""
        return Prosody(
            self.rate * other.rate, self.pitch + other.pitch, self.range * other.range, self.formants * other.formants
        )


PLAIN_PROSODY = Prosody()
