"""Mouth, cheeks and breath of gestures in a piece: a laugh opens the mouth between contacts of the lips."""

import numpy as np

from lexicon.sequence import PhoneSequence
from tts2face.gestures.movements import channel_values, pair_values, timed
from tts2face.gestures.stream import GestureValues
from tts2face.gestures.timeline import Timeline
from tts2face.lips.contacts import contact_rule
from tts2face.numeric.arrays import FloatArray, smoothstep

# Around a phone whose lips touch each other, or teeth: the mouth has no gesture so long before and behind it, and has
# it again after the easing. Closures lie up to 30 ms outside the edges (`tts2face.lips.contacts.CONTACT_MARGIN_S`).
SHUT_S, EASE_S = 0.05, 0.09


def mouth_gestures(timeline: Timeline, times: FloatArray, phones: PhoneSequence) -> GestureValues:
    """Opening of the mouth (T, 1), mm, and squints (T, 2) by gestures; empty where none moves these.

    Parameters
    ----------
    times : (T,)
        Seconds of the clip, of which the first is the beginning of the phones.
    """
    moving = timed(timeline.gestures, times)
    if not moving:
        return {}
    gap = np.maximum(channel_values(moving, "mouth", times), 0.0) * freedom_of_lips(times - times[0], phones)
    return {
        "mouth": gap[:, None].astype(np.float32),
        "squint": pair_values(moving, "squint", times).astype(np.float32),
    }


def freedom_of_lips(times: FloatArray, phones: PhoneSequence) -> FloatArray:
    """(T,) share by which lips may part at seconds of a piece: 0 in and beside contacts, 1 away from them."""
    free = np.ones(len(times))
    for label, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        if contact_rule(label) is not None:
            distance = np.maximum(float(start) - times, times - float(end))
            free = np.minimum(free, smoothstep(distance, SHUT_S, SHUT_S + EASE_S))
    return free


def breath_of_gestures(timeline: Timeline, times: FloatArray) -> FloatArray:
    """(T,) share of a full breath that gestures hold at T times."""
    return np.clip(channel_values(timed(timeline.gestures, times), "breath", times), 0.0, 1.2)
