"""The background of a photograph goes on behind the person before it."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Pixels = NDArray[np.uint8]
Mask = NDArray[np.bool_]

PAINT_EYES_PX, PAINT_REACH_PX = 50.0, 3.0  # eye distance in which what is nearest goes on, and from how far
HALF_KNOWN = 0.5  # share of a pixel from which its colour is known
AGREED = 12.0  # of 255: difference of the colours of one thing
LEAST_AGREED = 0.02  # weight of what is nearest
GAP = 0.3  # of the eye distance: a gap over which a line weighs half as much as over none
STANDS_OUT_REACH = 0.3  # of the eye distance, from whose mean colour lines stand out


def paint_hole(pixels: Pixels, hole: Mask, scale: float) -> Pixels:
    """Picture (H, W, 3) whose surroundings go on in a hole (H, W); `scale` is an eye distance, pixels.

    Rows and columns whose colours at both ends of the hole agree go on between these, as door frames do, and those
    that stand out before others; elsewhere what is nearest does.
    """
    import cv2

    known = 1 - hole.astype(np.float32)
    side = 2 * round(STANDS_OUT_REACH * scale) + 1
    share = np.maximum(cv2.blur(known, (side, side)), 1e-3)
    mean = cv2.blur(pixels * known[..., None], (side, side)) / share[..., None]
    stands_out = (1 + ((pixels - mean) ** 2).sum(axis=2) / AGREED**2).astype(np.float32)
    found = _nearest(pixels, known, scale)
    down, across = np.nonzero(hole)
    sums, weights = LEAST_AGREED * found[down, across].astype(np.float32), np.full((len(down), 1), LEAST_AGREED)
    for colours, weight in (
        _between(pixels, ~hole, stands_out, (down, across), scale),
        _between(pixels.swapaxes(0, 1), ~hole.T, stands_out.T, (across, down), scale),
    ):
        sums, weights = sums + weight * colours, weights + weight
    found[down, across] = (sums / weights).clip(0, 255)
    return found


def _between(
    pixels: Pixels, free: Mask, stands_out: Floats, places: tuple[NDArray[np.int64], NDArray[np.int64]], scale: float
) -> tuple[Floats, Floats]:
    """Colours (N, 3) on the way between the free ends of rows around places (N,), (N,), and their weights (N, 1)."""
    line, at = places
    columns = np.arange(free.shape[1])
    before = np.maximum.accumulate(np.where(free, columns, 0), axis=1)[line, at]
    after = np.minimum.accumulate(np.where(free, columns, columns[-1])[:, ::-1], axis=1)[:, ::-1][line, at]
    first, last = (pixels[line, end].astype(np.float32) for end in (before, after))
    weight = np.exp(-((first - last) ** 2).sum(axis=1) / (6 * AGREED**2)) * (free[line, before] & free[line, after])
    weight *= np.minimum(stands_out[line, before], stands_out[line, after]) / (GAP + (after - before) / scale)
    share = ((at - before) / np.maximum(after - before, 1))[:, None]
    return ((1 - share) * first + share * last).astype(np.float32), weight[:, None].astype(np.float32)


def _nearest(pixels: Pixels, known: Floats, scale: float) -> Pixels:
    """Picture (H, W, 3) whose nearest surroundings go on where it is not known (H, W), in a smaller picture.

    Source: Bertalmio, Bertozzi and Sapiro 2001, Navier-Stokes, fluid dynamics, and image and video inpainting.
    """
    import cv2

    shrink = min(1.0, PAINT_EYES_PX / scale)
    size = tuple(max(2, round(side * shrink)) for side in pixels.shape[1::-1])
    share = cv2.resize(known, size, interpolation=cv2.INTER_AREA)
    sums = cv2.resize(pixels * known[..., None], size, interpolation=cv2.INTER_AREA)
    small = (sums / np.maximum(share, 1e-3)[..., None]).clip(0, 255).astype(np.uint8)
    painted = cv2.inpaint(small, (share < HALF_KNOWN).astype(np.uint8), PAINT_REACH_PX, cv2.INPAINT_NS)
    return np.asarray(cv2.resize(painted, pixels.shape[1::-1], interpolation=cv2.INTER_CUBIC))
