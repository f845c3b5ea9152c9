"""Tracks of visible articulation: targets of phones in time, with transitions between them."""

from collections.abc import Mapping

import numpy as np

from lexicon.articulation import TARGET_NAMES, VisibleTarget, visible_targets
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.numeric.arrays import FloatArray, smooth_gaussian, smoothstep

CLOCK_HZ = 200.0  # rate at which tracks are computed; they are interpolated at the frames
HOLD_SHARE = 0.5  # share of a phone, or of the half of a diphthong, in which its target is held
MAX_TRANSITION_S = 0.16  # lips round at most this long before a rounded phone is held (Perkell and Matthies 1992)
SMOOTHING_S = 0.012  # standard deviation of a Gaussian; short phones of fast speech fall short of their targets
# samples: four standard deviations
SMOOTHING_REACH = int(4 * SMOOTHING_S * CLOCK_HZ)
# Transition to and from a contact of the lip, which may begin while a neighbouring phone is held, and of the tongue.
CONTACT_EASE_S, TONGUE_EASE_S = 0.1, 0.07
LIP_CONTACTS = ("lip_contact", "incisor_contact")
EASES_S = {"tongue_out": TONGUE_EASE_S, "tongue_up": TONGUE_EASE_S}
MIN_CLOSURE_S = 0.04  # bilabials are closed at least this long: a frame lies within at 25 frames/s
# Lips stay as they are in shorter pauses, and meet in longer ones: those of which most recorded ones have a frame with
# closed lips (.17 to .4 s: 45 %, longer: 72 %; docs/decisions/190-pauses.md).
# lips touch in 45 % of recorded pauses of .17 to .4 s, in 72 % of longer ones (decision 190)
SHORT_PAUSE_S, LONG_PAUSE_S = 0.3, 0.4
CLOSING_S, PARTING_S = 0.12, 0.40  # longest closing after speech, and parting before it, in which speakers breathe in
PARTING_SHARE = 0.4  # of a short pause


def articulation_tracks(phones: PhoneSequence, times: FloatArray) -> Mapping[str, FloatArray]:
    """Tracks (T,) of each field of `lexicon.articulation.VisibleTarget` at T times in seconds, from 0 to 1.

    Notes
    -----
    The target of a phone is held in its middle; phones without a target of their own belong to the transition between
    their neighbours (look-ahead model of coarticulation, Henke 1966), which is limited to `MAX_TRANSITION_S`.
    """
    halves = _halves(phones)
    clock = np.arange(int(np.ceil(max(phones.end, times[-1], 0.0) * CLOCK_HZ)) + 2) / CLOCK_HZ
    tracks = {}
    for name in TARGET_NAMES:
        keys = [(start, end, getattr(target, name)) for start, end, target in halves]
        if name in LIP_CONTACTS:
            tracks[name] = _contact_track([(start, end) for start, end, value in keys if value], times)
            continue
        raw = _keyframe_track([key for key in keys if key[2] is not None], clock, EASES_S.get(name, MAX_TRANSITION_S))
        tracks[name] = np.interp(times, clock, smooth_gaussian(raw, SMOOTHING_S * CLOCK_HZ, SMOOTHING_REACH))
    return tracks


def seconds_from_closure(phones: PhoneSequence, times: FloatArray) -> FloatArray:
    """Time (T,) in seconds to the nearest closed span of a bilabial, 0 within it; infinite without bilabials.

    Each is closed in its middle, for at least `MIN_CLOSURE_S` and one frame.
    """
    frame_s = float(times[1] - times[0]) if len(times) > 1 else 0.0
    nearest = np.full(len(times), np.inf)
    for label, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        if visible_targets(label)[0].lip_contact > 0:
            # at least a frame, else a closure falls between two frames
            held_s = max(HOLD_SHARE * (end - start), MIN_CLOSURE_S, frame_s)
            nearest = np.minimum(nearest, np.maximum(np.abs(times - (start + end) / 2) - held_s / 2, 0.0))
    return nearest


def pause_closure(phones: PhoneSequence, times: FloatArray) -> FloatArray:
    """Closure (T,) of the lips in pauses: 1 where they meet, 0 in speech and in pauses below `SHORT_PAUSE_S`.

    Silence before the first phone and after the last counts as long.
    """
    closure = np.zeros(len(times))
    labels, edges = phones.phones, phones.edges
    first = 0
    while first < len(labels):
        last = first
        # silences side by side are one pause
        while last + 1 < len(labels) and labels[last + 1] == labels[first] == SILENCE:
            last += 1
        if labels[first] == SILENCE:
            start = -np.inf if first == 0 else float(edges[first])
            end = np.inf if last + 1 == len(labels) else float(edges[last + 1])
            size = smoothstep(np.array([end - start]), SHORT_PAUSE_S, LONG_PAUSE_S)[0]
            parting = min(PARTING_S, PARTING_SHARE * (end - start))
            closed = smoothstep((times - start) / CLOSING_S) * smoothstep((end - times) / parting)
            closure = np.maximum(closure, size * closed)
        first = last + 1
    return closure


def _halves(phones: PhoneSequence) -> list[tuple[float, float, VisibleTarget]]:
    """Held span and target of each phone, two for a phone with two halves, one for a pause."""
    found = []
    for label, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        first, last = visible_targets(label)
        parts = [(first, start, end)] if first == last else [(first, start, (start + end) / 2)]
        if first != last:
            parts.append((last, (start + end) / 2, end))
        for target, first_s, last_s in parts:
            margin = 0.0 if label == SILENCE else (1.0 - HOLD_SHARE) / 2 * (last_s - first_s)
            found.append((float(first_s + margin), float(last_s - margin), target))
    return found


def _contact_track(held: list[tuple[float, float]], times: FloatArray) -> FloatArray:
    """Contact (T,): 1 in held spans, with transitions of `CONTACT_EASE_S` on both sides."""
    track = np.zeros(len(times))
    for start, end in held:
        beyond = np.maximum(np.maximum(start - times, times - end), 0.0)
        track = np.maximum(track, smoothstep(beyond, CONTACT_EASE_S, 0.0))
    return track


def _keyframe_track(keys: list[tuple[float, float, float]], clock: FloatArray, longest: float) -> FloatArray:
    """Values at the clock: each held within its span, with cosine-like transitions of at most `longest` seconds.

    A longer transition rests at the smaller of its two values.
    """
    track = np.zeros(len(clock))
    for number, (start, end, value) in enumerate(keys):
        track[(clock >= start) & (clock <= end)] = value
        if number == 0:
            continue
        _, before, previous = keys[number - 1]
        between = (clock > before) & (clock < start)
        low = min(previous, value)
        falling = previous + (low - previous) * smoothstep(clock[between] - before, 0.0, min(longest, start - before))
        rising = low + (value - low) * smoothstep(clock[between] - start, -min(longest, start - before), 0.0)
        track[between] = np.maximum(falling, rising)
    return track
