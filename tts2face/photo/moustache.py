"""Lips under a moustache, which the tracker takes for an open mouth: what lies between its lines is hair."""

from dataclasses import replace

import numpy as np

from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_LOWER, OUTER_LIP_UPPER
from tts2face.numeric.arrays import FloatArray, Pixels
from tts2face.photo.found_face import FoundFace
from tts2face.photo.lines import LEAST_LIP_BLUR_PX, LIP_BLUR, N_LIP, InnerLips, find_lip_line, lab_at, spline_weights
from tts2face.photo.mouth import CHEEKS

MIDDLE = slice(10, 31)  # points of the lips that are compared
BETWEEN, ON_UPPER, ON_LOWER = (0.25, 0.4, 0.55, 0.7), (0.3, 0.6, 0.9), (0.3, 0.5, 0.7)  # of the ways across
SPREAD = np.array([22.0, 8.0, 8.0])  # of colours in Lab of 8 bits
# Of that spread: hair between the lines is like that on the upper lip, and this unlike cheeks and the lower lip. In 250
# painted moustaches and open mouths .12 to .75 finds 43 of 106 over shut lips, 3 of 87 over open ones; of open mouths
# without a moustache the least is 1.1.
MOST_UNLIKE, LEAST_UNLIKE = 0.75, 2.0
OVER_LIP = 0.025  # of the eye distance: lips meet above the edge of what is seen of the lower one (sd .010)
# Of it, hair over and lips under that line that go where lips are pressed; so shut lips are read as shut more often.
PRESSED = (0.03, -0.005)
PRESSED_GAP = 0.029  # of lips that touch but for hair: less than those of parted lips
CORNER_POINTS = 5  # over which that grows


def find_lips(pixels: Pixels, face: FoundFace) -> InnerLips:
    """Inner edges of the lips of a face in a picture (H, W, 3), as `find_lip_line`; under a moustache hardly parted."""
    lips = find_lip_line(pixels, face)
    if lips.is_closed or not _is_hair_between(pixels, face):
        return lips
    from_corner = np.minimum(np.arange(N_LIP), np.arange(N_LIP)[::-1])
    along = lips.lower[-1, :2] - lips.lower[0, :2]
    up = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    share = np.minimum(1, from_corner / CORNER_POINTS)
    upper, lower = lips.lower.copy(), lips.lower.copy()
    for line, more in zip((upper, lower), PRESSED, strict=True):
        line[:, :2] += ((OVER_LIP + more) * face.eye_distance_px * share)[:, None] * up
    return replace(lips, upper=upper, lower=lower, gap=PRESSED_GAP)


def _is_hair_between(pixels: Pixels, face: FoundFace) -> bool:
    """Whether what the tracker takes for the inside of a mouth goes on over the upper lip."""
    weights = spline_weights(len(INNER_LIP_UPPER), N_LIP)
    rows = (INNER_LIP_UPPER, INNER_LIP_LOWER, OUTER_LIP_UPPER, OUTER_LIP_LOWER)
    upper, lower, over, under = ((weights @ face.landmarks[list(row), :2])[MIDDLE] for row in rows)
    blur = max(LEAST_LIP_BLUR_PX, LIP_BLUR * face.eye_distance_px)

    def colours(first: FloatArray, last: FloatArray, shares: tuple[float, ...]) -> FloatArray:
        return lab_at(pixels, np.concatenate([first + share * (last - first) for share in shares]), blur)

    inside, hair, lip = (
        colours(upper, lower, BETWEEN),
        colours(over, upper, ON_UPPER),
        colours(lower, under, ON_LOWER),
    )
    cheeks = lab_at(pixels, face.landmarks[list(CHEEKS), :2], blur)
    return (
        _unlikeness(inside, hair) < MOST_UNLIKE
        and min(_unlikeness(inside, lip), _unlikeness(hair, cheeks)) > LEAST_UNLIKE
    )


def _unlikeness(colours: FloatArray, others: FloatArray) -> float:
    """Median distance of colours (N, 3) from the median of others (M, 3), of their spread."""
    off = (colours - np.median(others, axis=0)) / SPREAD
    return float(np.median(np.linalg.norm(off, axis=1)))
