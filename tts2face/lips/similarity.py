"""Visual similarity of phones on the talker's face (T07 section 3.3, Table 1)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.lips.tokens import Tokens, sample_tokens

N_TOKEN_SAMPLES = 5  # per token
SAMPLED_PART = (
    0.2,
    0.8,
)  # sampled part of a phone; outside of it, a corpus of few words reflects the neighbours
PRIOR_TOKENS = 10.0  # number of tokens at which half of a phone's spread is that of all phones
SHARPNESS = 1.4  # similarity at the mean distance between phones is exp(-SHARPNESS); 1 to 3 give similar motion


@dataclass(frozen=True, slots=True, eq=False)
class PhoneSimilarity:
    """Visual similarity of P phones: `matrix` (P, P) in [0, 1], symmetric, 1 on the diagonal."""

    phones: tuple[str, ...]
    matrix: NDArray[np.float64]

    def nearest(self, phone: str, n: int = 3) -> list[tuple[str, float]]:
        """The n most similar other phones, most similar first, as in T07 Table 1."""
        row = self.matrix[self.phones.index(phone)]
        order = [at for at in np.argsort(-row, kind="stable") if self.phones[at] != phone]
        return [(self.phones[at], float(row[at])) for at in order[:n]]


def token_samples(tokens: Tokens) -> NDArray[np.float32]:
    """(N, `N_TOKEN_SAMPLES`, D) speech parameters of every token, evenly over its `SAMPLED_PART` part."""
    steps = np.linspace(*SAMPLED_PART, N_TOKEN_SAMPLES)
    starts, ends = tokens.spans[:, 1:2], tokens.spans[:, 2:3]
    positions = (starts + (ends - starts) * steps) * tokens.fps
    bounds = np.stack([tokens.first_frame[tokens.utterance], tokens.first_frame[tokens.utterance + 1]], axis=1)
    samples = np.zeros((*positions.shape, tokens.frames.shape[1]), np.float32)
    sample_tokens(tokens.frames, bounds, positions, samples)
    return samples


def phone_similarity(
    samples: NDArray[np.floating], phone: NDArray[np.integer], phones: tuple[str, ...], spread: NDArray[np.floating]
) -> PhoneSimilarity:
    """Similarity of phones from their tokens' trajectories.

    Parameters
    ----------
    samples : (N, S, D)
        Each token's trajectory resampled to S instants.
    phone : (N,)
        Index into `phones` of each token.
    phones : P labels
        A phone without a token is similar to itself only.
    spread : (D,)
        Standard deviation of each parameter over all frames; above 0.

    Raises
    ------
    InputError
        The arrays do not fit each other, or a spread is not above 0.

    Notes
    -----
    ``d(p, q)^2 = sum_sd a_d g_sd (M_psd - M_qsd)^2 / sum_sd a_d g_sd``: M are mean trajectories in units of `spread`;
    ``a_d`` is the parameter's share of the face's motion (its variance); ``g_sd`` its consistency, the inverse of the
    phones' own variance there, so that a parameter that coarticulation moves freely counts little. Similarity is
    ``exp(-SHARPNESS d / mean d)``.
    """
    if samples.ndim != 3 or phone.shape != samples.shape[:1] or spread.shape != samples.shape[2:]:
        raise InputError(
            f"samples (N, S, D), phone (N,) and spread (D,) do not fit: {samples.shape}, {phone.shape}, {spread.shape}"
        )
    if not (spread > 0).all():
        raise InputError(f"every parameter's spread must be above 0; number {int(np.argmin(spread))} is not")
    counts = np.bincount(phone, minlength=len(phones)).astype(np.float64)
    mean, variance = _phone_statistics(samples / spread, phone, counts)
    share = np.square(spread.astype(np.float64))
    consistency = 2.0 / (variance[:, None] + variance[None, :])
    weight = share * consistency
    squared = (weight * np.square(mean[:, None] - mean[None, :])).sum((2, 3)) / weight.sum((2, 3))
    distance = np.sqrt(squared)
    has_tokens = counts > 0
    between = distance[np.ix_(has_tokens, has_tokens)]
    scale = between.sum() / max(1, has_tokens.sum() * (has_tokens.sum() - 1))
    similarity = np.exp(-SHARPNESS * distance / (scale if scale > 0 else 1.0))
    matrix = np.where(np.outer(has_tokens, has_tokens), similarity, 0.0)
    np.fill_diagonal(matrix, 1.0)
    return PhoneSimilarity(phones, matrix)


def _phone_statistics(
    z: NDArray[np.floating], phone: NDArray[np.integer], counts: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(P, S, D) mean and variance of the tokens of each phone; few tokens borrow the variance within all phones."""
    members = [np.flatnonzero(phone == label) for label in range(len(counts))]
    sums = np.stack([z[rows].sum(axis=0, dtype=np.float64) for rows in members])  # `np.add.at` takes 20 times as long
    mean = sums / np.maximum(counts, 1.0)[:, None, None]
    scatter = np.stack([np.square(z[rows] - mean[label]).sum(axis=0) for label, rows in enumerate(members)])
    # a parameter without spread would have infinite weight
    pooled = scatter.sum(0) / max(1, len(z)) + 1e-6
    n = counts[:, None, None]
    return mean, (scatter + PRIOR_TOKENS * pooled) / (n + PRIOR_TOKENS)
