"""Options of lip synthesis from exemplars."""

from dataclasses import dataclass

from lexicon.errors import InputError
from lexicon.values.fields import check_fields


@dataclass(frozen=True, slots=True)
class ExcludedToken:
    """A recorded token that is not used: its utterance, and the seconds of the utterance at which it begins."""

    utterance: str
    start: float

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisOptions:
    """Options of text-driven synthesis.

    Parameters
    ----------
    context
        Number of phones on either side that enter the context score.
    k
        Number of exemplars averaged for each phone.
    duration
        Weight of duration differences in the score; 0 to ignore durations.
    sharpness
        Weight of an exemplar is ``exp(-sharpness s)`` for a score that is lower than the best one by s.
    overlap
        Whether exemplars extend into the neighbouring phones, so that three phones contribute at each time.
    precision
        Exponent of the inverse variance by which overlapping exemplars are weighted; 0 for equal weights.
    align
        Whether exemplars are time-warped to the best one before they are averaged.
    network
        Weight of the talker's phone network, if it has one, against the exemplars; 0 for exemplars only.
    amplitude
        Factor of the motion relative to the talker's mean speaking pose, which compensates the shrinkage by averaging.
    smoothing_s
        Standard deviation in seconds of the final Gaussian smoothing; 0 for none.
    contacts
        Whether lip contacts of the exemplars are enforced in the result, and further visible articulation on a mesh:
        contact of the lower lip with the teeth, the tongue, and lips that meet in pauses.
    articulation
        Factor of rounding, spreading and opening by phone class; None for the face's own. Other than `amplitude`, it
        does not change the talker's parameters.

    Raises
    ------
    InputError
        A value has another type, or a number lies outside its range.
    """

    context: int = 3
    k: int = 30
    duration: float = 0.6
    sharpness: float = 3.0
    overlap: bool = True
    precision: float = 1.5
    align: bool = True
    network: float = 0.5
    amplitude: float = 1.14
    smoothing_s: float = 0.01
    contacts: bool = True
    articulation: float | None = None

    def __post_init__(self) -> None:
        """Reject other types and numbers outside their range; `context` and `k` are checked by the search."""
        check_fields(self)
        for name in ("duration", "sharpness", "precision", "amplitude", "smoothing_s"):
            value = getattr(self, name)
            if not 0 <= value < 100:
                raise InputError(f"{name} must be 0 or more and below 100, not {value}")
        if not 0 <= self.network <= 1:
            raise InputError(f"the share of the networks must lie from 0 to 1, not {self.network}")


THEOBALD_2007 = SynthesisOptions(
    # section 3.3 as published (`--synthesis theobald2007`, decision 007)
    context=4, k=10, duration=0.0, sharpness=0.0, overlap=False, precision=0.0, align=True, network=0.0,
    amplitude=1.0, smoothing_s=0.02, contacts=False,
)  # fmt: skip
METHOD_OPTIONS = {"exemplar": SynthesisOptions(), "theobald2007": THEOBALD_2007}
