"""How lip motion is made from exemplars."""

from dataclasses import dataclass

from lexicon.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisOptions:
    """Options of text-driven synthesis.

    Parameters
    ----------
    context
        Phones either side that judge an exemplar.
    k
        Exemplars averaged for each phone.
    duration
        Weight of unlike durations against the context score; 0 leaves durations out.
    sharpness
        An exemplar whose score is lower by s counts ``exp(-sharpness s)`` as much as the best one.
    overlap
        Exemplars reach into their neighbours, so that each instant is told by three phones; else they stand edge to
        edge.
    precision
        Where exemplars overlap, each counts by its inverse variance to this power; 0 = all alike.
    align
        Exemplars are warped onto the best one so that events coincide before they are averaged.
    network
        Share of the talker's networks, where it has some, in what the exemplars tell; 0 leaves them out.
    articulation
        Factor on the motion about the talker's mean speaking pose; averaging shrinks what it averages.
    smoothing_s
        Standard deviation of the Gaussian that smooths the whole, seconds; 0 = none.
    contacts
        Lips that close in the exemplars of a phone made with the lips close in the result.

    Raises
    ------
    InputError
        A number lies outside its range.
    """

    context: int = 3
    k: int = 30
    duration: float = 0.6
    sharpness: float = 3.0
    overlap: bool = True
    precision: float = 1.5
    align: bool = True
    network: float = 0.5
    articulation: float = 1.14
    smoothing_s: float = 0.01
    contacts: bool = True

    def __post_init__(self) -> None:
        """Refuse numbers outside their range; `context` and `k` are checked by the search."""
        for name in ("duration", "sharpness", "precision", "articulation", "smoothing_s"):
            value = getattr(self, name)
            if not 0 <= value < 100:
                raise InputError(f"{name} must be 0 or more and below 100, not {value}")
        if not 0 <= self.network <= 1:
            raise InputError(f"the share of the networks must lie from 0 to 1, not {self.network}")


THEOBALD_2007 = SynthesisOptions(
    context=4, k=10, duration=0.0, sharpness=0.0, overlap=False, precision=0.0, align=True, network=0.0,
    articulation=1.0, smoothing_s=0.02, contacts=False,
)  # fmt: skip
METHOD_OPTIONS = {"exemplar": SynthesisOptions(), "theobald2007": THEOBALD_2007}
