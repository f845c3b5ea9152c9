"""Sentences for benchmarks: made by a small grammar whose words hold every English phone."""

import numpy as np

SUBJECTS = (
    "the young chef", "my brother Tom", "a tall giraffe", "each visitor", "our noisy neighbour", "the third witness",
    "Professor Hughes", "some good oil", "that measure", "a bear with bushy fur",
)  # fmt: skip
VERBS = (
    "usually pushes", "could have bought", "thinks about", "slowly carved", "should repair", "joyfully watched",
    "put away", "never shared", "often takes", "has found",
)  # fmt: skip
OBJECTS = (
    "five big maps", "the beige garage", "a box of matches", "those cheap shoes", "one hundred oysters", "his vision",
    "the warm bathwater", "a yellow jacket", "the cookbook", "two paper boats",
)  # fmt: skip
ENDINGS = (
    "before noon.", "in the park, as they say.", "while singing.", "for a very good reason.", "near the south beach.",
    "with much pleasure.", "every other Thursday.", "at the edge of the forest.",
)  # fmt: skip


def sentences(n: int, seed: int = 0) -> list[str]:
    """The first n sentences of a seed."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(n):
        parts = [choices[int(rng.integers(len(choices)))] for choices in (SUBJECTS, VERBS, OBJECTS, ENDINGS)]
        made.append(" ".join(parts)[0].upper() + " ".join(parts)[1:])
    return made
