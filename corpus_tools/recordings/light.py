"""Light and sharpness of the face in pictures: whether its parts can be distinguished."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, FACE_OVAL
from tts2face.video.media import TimedFrame

INTERVAL_S = 0.5  # between the pictures that are measured
EYE_PX = 60.0  # larger faces are reduced to this distance of the outer eye corners: finer detail is not needed
LUMA = np.array([0.299, 0.587, 0.114], np.float32)  # of red, green and blue (ITU-R BT.601)
OVEREXPOSED = 250  # of 255
SHRINK = 0.9  # of the oval of the face, whose border is background and hair
DARK_QUANTILE, BRIGHT_QUANTILE = 0.05, 0.95
FINE_PX, COARSE_PX = 1.0, 2.0  # of the two Gaussians whose difference is the detail
MEASURES = ("brightness", "contrast", "glare", "sharpness")


def measure_light(
    frames: Iterable[TimedFrame], points: NDArray[np.float32], times: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Measures (N, 5) of every `INTERVAL_S` of a video with a face: the time in seconds, then `MEASURES`.

    Parameters
    ----------
    points : (T, 478, 3)
        Landmarks in pixels at ``times`` (T,), NaN without a face.
    """
    rows, next_s = [], -np.inf
    for frame in frames:
        at = int(np.argmin(np.abs(times - frame.time)))
        if frame.time >= next_s and not np.isnan(points[at, 0, 0]):
            rows.append((frame.time, *face_light(frame.pixels, points[at])))
            next_s = frame.time + INTERVAL_S
    return np.array(rows, np.float32).reshape(-1, 1 + len(MEASURES))


def face_light(pixels: NDArray[np.uint8], points: NDArray[np.floating]) -> tuple[float, float, float, float]:
    """Brightness, contrast, glare and sharpness of a face.

    Parameters
    ----------
    pixels : (H, W, 3)
    points : (478, 3)
        Landmarks in pixels.

    Returns
    -------
    brightness
        Mean luma of the face in 8-bit levels.
    contrast
        Difference of the 95 % and the 5 % quantile of the luma, in 8-bit levels.
    glare
        Share of the face that is overexposed.
    sharpness
        Deviation of the detail between 1 and 2 px, at `EYE_PX`, over the contrast.
    """
    import cv2

    eyes = float(np.linalg.norm(points[EYE_OUTER_LEFT, :2] - points[EYE_OUTER_RIGHT, :2]))
    scale = min(1.0, EYE_PX / max(eyes, 1.0))
    oval = points[list(FACE_OVAL), :2]
    low = np.maximum(np.floor(oval.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(oval.max(axis=0)).astype(int) + 1, pixels.shape[1::-1])
    if (high - low < 2 / scale).any():
        return 0.0, 0.0, 0.0, 0.0  # outside of the picture
    luma = pixels[low[1] : high[1], low[0] : high[0]].astype(np.float32) @ LUMA
    size = [max(1, round(float(side) * scale)) for side in high - low]
    small = cv2.resize(luma, size, interpolation=cv2.INTER_AREA) if scale < 1 else luma
    outline = ((oval.mean(axis=0) + SHRINK * (oval - oval.mean(axis=0)) - low) * scale).round().astype(np.int32)
    mask = cv2.fillConvexPoly(np.zeros(small.shape[:2], np.uint8), outline, 1).astype(bool)
    if not mask.any():
        return 0.0, 0.0, 0.0, 0.0
    skin = small[mask]
    dark, bright = np.quantile(skin, [DARK_QUANTILE, BRIGHT_QUANTILE])
    detail = (cv2.GaussianBlur(small, (0, 0), FINE_PX) - cv2.GaussianBlur(small, (0, 0), COARSE_PX))[mask]
    contrast = float(bright - dark)
    return float(skin.mean()), contrast, float((skin >= OVEREXPOSED).mean()), float(detail.std() / max(contrast, 1.0))
