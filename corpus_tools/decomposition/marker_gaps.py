"""Gaps in marker tracks: short ones are interpolated, long ones are left out of what is measured; both are said."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tts2face.numeric.arrays import FloatArray, Mask, true_runs

MAX_MARKER_GAP_S = 0.2  # motion in longer gaps cannot be interpolated reliably
MAX_QUOTED_MARKERS = 4  # markers quoted in a message
MAX_QUOTED_GAPS = 3


@dataclass(frozen=True, slots=True, eq=False)
class FilledTracks:
    """Tracks (T, M, 3) without gaps, the frames (T,) whose gaps are too long for it, and notes on both."""

    points: FloatArray
    left_out: Mask
    notes: tuple[str, ...]


def fill_marker_gaps(tracks: FloatArray, names: Sequence[str], fps: float) -> FilledTracks:
    """Tracks (T, M, 3), NaN in gaps, each with a place in some frame, without gaps.

    Notes
    -----
    Inner gaps by monotone cubic interpolation (PCHIP, Fritsch and Carlson 1980); gaps at the ends by the nearest value.
    """
    whole = tracks.copy()
    counts = dict[str, int]()
    notes = list[str]()
    left_out: Mask = np.zeros(len(tracks), np.bool_)
    for marker, name in enumerate(names):
        is_missing: Mask = np.asarray(np.isnan(tracks[:, marker]).any(axis=1))
        if not is_missing.any():
            continue
        is_long = find_long_gaps(is_missing, fps)
        if is_long.any():
            left_out |= is_long
            notes.append(describe_long_gaps(f"marker {name}", is_long, fps))
        whole[is_missing, marker] = _interpolate_gaps(tracks[:, marker], is_missing)
        if n_filled := int((is_missing & ~is_long).sum()):
            counts[name] = n_filled
    if len(notes) > MAX_QUOTED_MARKERS:
        notes[MAX_QUOTED_MARKERS:] = [f"so are times in which {len(notes) - MAX_QUOTED_MARKERS} more are hidden"]
    if counts:
        named = ", ".join(f"{name} ({count} frames)" for name, count in list(counts.items())[:MAX_QUOTED_MARKERS])
        more = f" and {len(counts) - MAX_QUOTED_MARKERS} more" if len(counts) > MAX_QUOTED_MARKERS else ""
        notes.append(f"gaps were filled in {named}{more}")
    return FilledTracks(whole, left_out, tuple(notes))


def find_long_gaps(is_missing: Mask, fps: float) -> Mask:
    """Frames (T,) of gaps, True in (T,), that are too long to be filled."""
    found: Mask = np.zeros(len(is_missing), np.bool_)
    for start, end in true_runs(is_missing):
        found[start:end] = (end - start) / fps > MAX_MARKER_GAP_S
    return found


def describe_long_gaps(what: str, is_long: Mask, fps: float) -> str:
    """A note on what is hidden in frames (T,) that are left out."""
    gaps = (true_runs(is_long) / fps).tolist()
    quoted = ", ".join(f"{start:.2f} to {end:.2f} s" for start, end in gaps[:MAX_QUOTED_GAPS])
    more = f" and {len(gaps) - MAX_QUOTED_GAPS} more times" if len(gaps) > MAX_QUOTED_GAPS else ""
    return f"the {what} is hidden from {quoted}{more}, which is left out: gaps up to {MAX_MARKER_GAP_S:g} s are filled"


def _interpolate_gaps(track: FloatArray, is_missing: Mask) -> FloatArray:
    """(G, 3) positions in the frames of gaps."""
    from scipy.interpolate import PchipInterpolator

    there = np.flatnonzero(~is_missing)
    if len(there) == 1:
        return np.repeat(track[there], is_missing.sum(), axis=0)
    # before the first and after the last place the marker is held
    at = np.clip(np.flatnonzero(is_missing), there[0], there[-1])
    return np.asarray(PchipInterpolator(there, track[there])(at))
