"""Summary of a talker's contents."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lexicon.sequence import SILENCE
from tts2face.models.talker import Talker

PHONES_PER_LINE = 10  # phones on a line
COUNTED_KEYS = frozenset({"refused", "phones_recognised"})  # in the metadata; shown as counts


@dataclass(frozen=True, slots=True)
class Description:
    """Summary of a talker.

    ``phones`` are phones with their counts, most frequent first; ``n_triphones`` the number of different triphones;
    ``variances`` those of the modes in mm^2, of which the first ``n_speech`` belong to the mouth.
    """

    n_utterances: int
    minutes: float
    fps: float
    phones: tuple[tuple[str, int], ...]
    n_triphones: int
    n_speech: int
    variances: tuple[float, ...]
    metadata: Mapping[str, Any]

    def text(self) -> str:
        """The summary as text."""
        about = [f"{key + ':':<13}{self.metadata[key]}" for key in self.metadata if key not in COUNTED_KEYS]
        recognised = self.metadata.get("phones_recognised", [])
        counts = [f"{phone} {count}" for phone, count in self.phones]
        rows = ["  " + "  ".join(counts[at : at + PHONES_PER_LINE]) for at in range(0, len(counts), PHONES_PER_LINE)]
        refused = self.metadata.get("refused", [])
        return "\n".join(
            [
                *about,
                f"utterances:  {self.n_utterances} ({self.minutes:.1f} minutes at {self.fps:g} frames/s)",
                *([f"recognised:  {len(recognised)} utterances without a transcript"] if recognised else []),
                f"refused:     {len(refused)}",
                *(f"  {name}: {reason}" for name, reason in refused),
                f"triphones:   {self.n_triphones}",
                f"phones:      {len(self.phones)} different, {sum(count for _, count in self.phones)} spoken",
                *rows,
                f"mouth modes: {_variance_text(self.variances[: self.n_speech])}",
                f"other modes: {_variance_text(self.variances[self.n_speech :])}",
            ]
        )


def describe(talker: Talker) -> Description:
    """Summarise a talker."""
    phones: Counter[str] = Counter()
    triphones: set[tuple[str, ...]] = set()
    for utterance in talker.utterances:
        labels = (SILENCE, *utterance.phones.phones, SILENCE)
        phones.update(label for label in labels if label != SILENCE)
        triphones.update(triple for triple in zip(labels, labels[1:], labels[2:], strict=False) if triple[1] != SILENCE)
    n_frames = sum(len(utterance.shape) for utterance in talker.utterances)
    return Description(
        len(talker.utterances),
        n_frames / talker.fps / 60.0,
        talker.fps,
        tuple(sorted(phones.items(), key=lambda item: (-item[1], item[0]))),
        len(triphones),
        talker.model.n_speech,
        tuple(float(variance) for variance in np.asarray(talker.model.spread, np.float64) ** 2),
        dict(talker.metadata),
    )


def _variance_text(variances: tuple[float, ...]) -> str:
    """Number of modes and the cumulative share of their variance."""
    if not variances:
        return "0"
    total = np.cumsum(variances) / (sum(variances) or 1.0)
    marks = [n for n in (1, 2, 4, 8, 16) if n < len(variances)]
    return f"{len(variances)}; of their variance " + ", ".join(f"{total[n - 1]:.1%} in the first {n}" for n in marks)
