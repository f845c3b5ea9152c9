"""Sharpness of a photograph in the mouth that is put into it: what is seen between the lips is blurred as eyes are."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.models.landmarks import LID_RINGS
from tts2face.models.photo_view import PhotoView
from tts2face.numeric.arrays import FloatArray

AGAIN_PX = 1.0  # standard deviation of a blur by which edges are compared
STRONG = 97.0  # per cent of gradients around the eyes are less than those of edges
AROUND = 0.15  # of the width of both eyes, around them
MOST_PX = 6.0  # of the blur of a photograph
DRAWN_PX = 0.5  # blur of what is drawn
SHARE = 0.6  # of the missing blur: with all of it openings are read less well (r .946 for .962 without)
LEAST_PX = 0.5  # blur that is seen
REACH, LEAST_SIDE_PX = 3.0, 2  # blurs around an outline, and least side of what is blurred


def photograph_blur(face: Face, view: PhotoView, pixels: NDArray[np.uint8]) -> float:
    """Standard deviation, pixels, of the blur of the eyes in a photograph (H, W, 3).

    Source: Zhuo and Sim 2011, defocus map estimation from a single image: edges are compared with blurred ones.
    """
    from scipy.ndimage import gaussian_filter

    rings = [*LID_RINGS[0], *LID_RINGS[1]]
    corners, weights = face.landmark_vertices[rings], face.landmark_weights[rings]
    points = np.einsum("lc,lcx->lx", weights, face.vertices[corners]) @ view.view[:, :3].T + view.view[:, 3]
    places = points[:, :2] * (view.lens[0] / points[:, 2:]) + view.lens[1:3]
    around = AROUND * float(np.ptp(places[:, 0]))
    low = np.maximum(places.min(axis=0) - around, 0).astype(int)
    high = np.maximum(places.max(axis=0) + around, low + 4).astype(int)
    grey = pixels[low[1] : high[1], low[0] : high[0]].mean(axis=2)
    if min(grey.shape) < 4:
        return 0.0
    own, again = (np.hypot(*np.gradient(part)) for part in (grey, gaussian_filter(grey, AGAIN_PX)))
    strong = own > np.percentile(own, STRONG)
    if not strong.any():
        return 0.0
    ratio = float(np.median(own[strong] / np.maximum(again[strong], 1e-3)))
    return min(AGAIN_PX / float(np.sqrt(max(ratio**2 - 1, 1e-6))), MOST_PX)


def missing_blur(blur_px: float) -> float:
    """Blur that what is drawn lacks beside a photograph of some blur in pixels of the picture; 0 where none is seen."""
    missing = SHARE * np.sqrt(max(blur_px**2 - DRAWN_PX**2, 0.0))
    return float(missing) if missing >= LEAST_PX else 0.0


def blur_within(outline: FloatArray, blur_px: float, pixels: NDArray[np.uint8]) -> None:
    """Blur a picture (H, W, 3 or 4) within an outline (N, 2), pixels, and at its edge, in place."""
    from PIL import Image, ImageDraw, ImageFilter

    reach = REACH * blur_px
    low = np.maximum(np.floor(outline.min(axis=0) - reach), 0).astype(int)
    high = np.minimum(np.ceil(outline.max(axis=0) + reach), pixels.shape[1::-1]).astype(int)
    if (high - low).min() < LEAST_SIDE_PX:
        return
    part = np.s_[low[1] : high[1], low[0] : high[0]]
    drawn = Image.fromarray(pixels[part])
    mask = Image.new("L", drawn.size)
    corners = [(across, down) for across, down in (outline - low - 0.5).tolist()]
    draw = ImageDraw.Draw(mask)
    draw.polygon(corners, fill=255)
    draw.line([*corners, corners[0]], fill=255, width=max(1, round(2 * blur_px)))
    blur = ImageFilter.BoxBlur((float(np.sqrt(12 * blur_px**2 + 1)) - 1) / 2)  # of the same standard deviation
    pixels[part] = np.asarray(Image.composite(drawn.filter(blur), drawn, mask.filter(blur)))
