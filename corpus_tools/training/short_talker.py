"""A talker from less material than stands alone: the chosen adaptation of a base, and what to record next."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from corpus_tools.measures.fingerprints import find_same, fingerprint_observations, fingerprint_talker
from corpus_tools.recordings.observation import Observation
from corpus_tools.training.adapt_talker import (
    Base,
    adapted_talker,
)
from corpus_tools.training.choose_adaptation import ChosenAdaptation, choose_adaptation
from lexicon.phones import ARPABET
from lexicon.sequence import SILENCE
from tts2face.models.talker import NOT_STATED, Talker
from tts2face.models.talker_file import load_talker
from tts2face.types import Progress, ignore_progress

MIN_OWN_MINUTES = 10.0  # from here on a talker needs only the networks of a base
NO_BASE = "none"
MIN_TOKENS = 3  # of a phone; with fewer it is recommended for recording
MIN_CONTEXTS = 3  # different pairs of neighbours of a phone, likewise
MAX_LISTED = 12  # phones recommended at once, the rarest first
# Words with each phone, by its ARPABET name.
EXAMPLES = {
    "AA": "father", "AE": "cat", "AH": "cup", "AO": "law", "AW": "how", "AY": "my", "B": "bee", "CH": "chair",
    "D": "do", "DH": "this", "EH": "bed", "ER": "bird", "EY": "day", "F": "fee", "G": "go", "HH": "he", "IH": "sit",
    "IY": "see", "JH": "joy", "K": "key", "L": "low", "M": "me", "N": "no", "NG": "sing", "OW": "go", "OY": "boy",
    "P": "pea", "R": "red", "S": "so", "SH": "she", "T": "tea", "TH": "think", "UH": "book", "UW": "two", "V": "van",
    "W": "we", "Y": "yes", "Z": "zoo", "ZH": "vision",
}  # fmt: skip
STATED_BY_BOTH = ("sources", "licence", "attribution")


@dataclass(frozen=True, slots=True, eq=False)
class ShortTalker:
    """A talker with the utterances of the recordings first (``n_own``) and those of the base behind them.

    ``notes`` state what to expect of it.
    """

    talker: Talker
    n_own: int
    chosen: ChosenAdaptation
    notes: tuple[str, ...]


def needs_base(observations: Sequence[Observation]) -> bool:
    """Whether the recordings are shorter than `MIN_OWN_MINUTES`."""
    return sum(len(observation.landmarks) / observation.fps for observation in observations) < 60.0 * MIN_OWN_MINUTES


def learn_short_talker(
    observations: Sequence[Observation],
    base: str,
    *,
    metadata: Mapping[str, Any],
    on_progress: Progress = ignore_progress,
) -> ShortTalker:
    """The talker of the observed recordings, completed by a base talker.

    Parameters
    ----------
    observations
        Of one person at one frame rate, from `observe` or from landmarks of another source.
    base
        Shipped talker by name, or path of a ``.talker`` file.

    Raises
    ------
    InputError
        There is no such talker.
    DataError
        The base is damaged.
    """
    known = load_talker(base)
    indexed = Base.of(known)
    chosen = choose_adaptation(indexed, observations, on_progress=on_progress)
    talker = adapted_talker(indexed, observations, chosen.adaptation, metadata)
    stated = {
        **metadata,
        **statements_of_both(metadata, indexed.talker.metadata),
        "base": _base_metadata(indexed, chosen),
    }
    notes = (chosen.message, *_known_recordings(known, base, observations))
    return ShortTalker(replace(talker, metadata=stated), len(observations), chosen, notes)


def _known_recordings(known: Talker, base: str, observations: Sequence[Observation]) -> tuple[str, ...]:
    """A note if the base was learnt from some of the recordings, whose held-out figures are then too good."""
    same = find_same(fingerprint_talker(known), fingerprint_observations(observations))
    if not same:
        return ()
    return (
        f"the base {base} was learnt from {len(same)} of these recordings ({same[0][0]}, there as {same[0][1]}): the "
        f"expected figures are too high; give another base, or `--base {NO_BASE}`",
    )


def recording_advice(observations: Sequence[Observation]) -> tuple[str, ...]:
    """Advice for the next recordings: English phones that are rare in the recordings, and phones in few contexts."""
    counts: Counter[str] = Counter()
    contexts: dict[str, set[tuple[str, str]]] = {}
    for observation in observations:
        labels = (SILENCE, *observation.phones.phones, SILENCE)
        for before, label, behind in zip(labels, labels[1:], labels[2:], strict=False):
            counts[label] += 1
            contexts.setdefault(label, set()).add((before, behind))
    spoken = {name: counts[ARPABET[name]] for name in EXAMPLES}
    rare = sorted((name for name in EXAMPLES if spoken[name] < MIN_TOKENS), key=lambda name: (spoken[name], name))
    narrow = [name for name in EXAMPLES if name not in rare and len(contexts.get(ARPABET[name], ())) < MIN_CONTEXTS]
    advice = []
    if rare:
        listed = ", ".join(f"{name} as in {EXAMPLES[name]} ({spoken[name]})" for name in rare[:MAX_LISTED])
        advice.append(f"record words with these phones next (times spoken so far): {listed}")
    if narrow:
        advice.append(f"record these phones between other phones: {', '.join(narrow)}")
    return tuple(advice)


def statements_of_both(own: Mapping[str, Any], base: Mapping[str, Any]) -> dict[str, str]:
    """Sources, licence and attribution of the recordings and of the base."""
    return {
        name: f"recordings: {own.get(name, NOT_STATED)}; base: {base.get(name, NOT_STATED)}" for name in STATED_BY_BOTH
    }


def _base_metadata(base: Base, chosen: ChosenAdaptation) -> dict[str, Any]:
    held_out = {
        name: [round(score.opening, 3), round(score.width, 3), round(score.cost, 3)]
        for name, score in chosen.alternatives.items()
    }
    return {
        "name": base.talker.metadata.get("name", NOT_STATED),
        "trust": chosen.adaptation.trust,
        "penalty": chosen.adaptation.penalty,
        "gain": [round(item, 4) for item in chosen.adaptation.gain],
        "held_out": held_out,
    }
