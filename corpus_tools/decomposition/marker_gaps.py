"""Gaps in marker tracks: short ones are interpolated and reported, long ones rejected."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.numeric.arrays import FloatArray, true_runs

MAX_MARKER_GAP_S = 0.2  # motion in longer gaps cannot be interpolated reliably
MARKER_SET_ADVICE = "give a marker set without it"
MAX_QUOTED_MARKERS = 4  # markers quoted in a message


def fill_marker_gaps(tracks: FloatArray, names: Sequence[str], fps: float) -> tuple[FloatArray, tuple[str, ...]]:
    """Tracks without gaps, and a note on the filled gaps.

    Parameters
    ----------
    tracks : (T, M, 3)
        NaN in gaps.

    Notes
    -----
    Inner gaps by monotone cubic interpolation (PCHIP, Fritsch and Carlson 1980); gaps at the ends by the nearest value.
    """
    whole, counts = tracks.copy(), {}
    for marker, name in enumerate(names):
        is_missing = np.asarray(np.isnan(tracks[:, marker]).any(axis=1))
        if not is_missing.any():
            continue
        check_gap(f"marker {name}", is_missing, fps)
        whole[is_missing, marker] = _interpolate_gaps(tracks[:, marker], is_missing)
        counts[name] = int(is_missing.sum())
    if not counts:
        return whole, ()
    named = ", ".join(f"{name} ({count} frames)" for name, count in list(counts.items())[:MAX_QUOTED_MARKERS])
    more = f" and {len(counts) - MAX_QUOTED_MARKERS} more" if len(counts) > MAX_QUOTED_MARKERS else ""
    return whole, (f"gaps were filled in {named}{more}",)


def check_gap(what: str, is_missing: NDArray[np.bool_], fps: float) -> None:
    """Check that gaps, True in (T,), are short enough to be filled; errors as `fill_marker_gaps`."""
    if is_missing.all():
        raise DataError(f"the {what} is never visible; {MARKER_SET_ADVICE}, or capture it again")
    start, end = max(true_runs(is_missing).tolist(), key=lambda gap: gap[1] - gap[0], default=(0, 0))
    if (end - start) / fps > MAX_MARKER_GAP_S:
        raise DataError(
            f"the {what} is hidden for {(end - start) / fps:.2f} s from {start / fps:.2f} s on, and gaps up to "
            f"{MAX_MARKER_GAP_S:g} s can be filled; fill it in the capture software, or {MARKER_SET_ADVICE}"
        )


def _interpolate_gaps(track: FloatArray, is_missing: NDArray[np.bool_]) -> FloatArray:
    """(G, 3) positions in the frames of gaps."""
    from scipy.interpolate import PchipInterpolator

    there = np.flatnonzero(~is_missing)
    if len(there) == 1:
        return np.repeat(track[there], is_missing.sum(), axis=0)
    # before the first and after the last place the marker is held
    at = np.clip(np.flatnonzero(is_missing), there[0], there[-1])
    return np.asarray(PchipInterpolator(there, track[there])(at))
