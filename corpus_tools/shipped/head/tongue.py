"""The tongue: MakeHuman's, with a narrow tip behind the lower incisors, and shapes that lift or put out the tip."""

import numpy as np

from corpus_tools.shipped.head.cage import Cage
from corpus_tools.shipped.head.jaw import Jaw
from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.subdivision import catmull_clark, triangulate
from tts2face.numeric.arrays import FloatArray, smoothstep

TONGUE_UP = "tongueUp"
FREE_MM = 34.0  # length of the part that narrows towards the tip
NARROWER, THINNER = 0.42, 0.50  # shares taken from width and thickness at the tip
FORWARD_MM, RAISED_MM = 4.0, 0.8  # displacement of the tip: it rests behind the edges of the lower incisors
FLATTENING = 0.72  # of the body, whose back otherwise hides the upper teeth
GROOVE_MM, GROOVE_WIDTH_MM = 0.8, 2.4
OUT_RISE_MM = 2.2  # the tip that is put out passes over the lower incisors
UP_MM, UP_FREE_MM = 12.2, 15.0  # rise of the tip's upper side, to the ridge with a jawOpen of 0.25, and its length
COLOUR, ROOT_COLOUR, TIP_COLOUR = (
    np.array([0.70, 0.34, 0.34]),
    np.array([0.56, 0.22, 0.22]),
    np.array([0.74, 0.39, 0.38]),
)
UNDERSIDE_LAG = 0.75  # of the rise that the lowest vertices lack: the underside of a raised tip faces forward
UNDERSIDE_COLOUR = np.array([0.92, 0.52, 0.50])  # seen in the shade, when the tip is up
MATERIAL = {"specular": 0.35, "shininess": 30.0, "wrap": 0.3}


def tongue_piece(cage: Cage, jaw: Jaw) -> HeadPart:
    """The tongue with the shapes ``jaw...``, ``tongueOut`` and ``tongueUp``."""
    used, quads = np.unique(cage.source.groups["helper-tongue"].corners, return_inverse=True)
    matrix, fine = catmull_clark(len(used), quads.reshape(-1, 4))
    source = matrix @ cage.vertices[used]
    points, tip = shape_tip(source)
    out = matrix @ cage.units["tongueOut"][used]
    out[:, 1] += OUT_RISE_MM * tip
    near = smoothstep(points[:, 2], points[:, 2].max() - UP_FREE_MM, points[:, 2].max())
    height = _height_in_tongue(points)
    up = np.outer(near * (1 - UNDERSIDE_LAG * (1 - height) / 2), [0.0, UP_MM, 2.0])
    depth = np.clip((points[:, 2].max() - points[:, 2]) / 45.0, 0, 1)[:, None]
    colour = COLOUR + (ROOT_COLOUR - COLOUR) * depth
    colour += (tip**2)[:, None] * (TIP_COLOUR - colour)
    below = smoothstep(-height, 0.0, 1.0) * tip
    colour += below[:, None] * (UNDERSIDE_COLOUR - colour)
    groove = np.exp(-((points[:, 0] / GROOVE_WIDTH_MM) ** 2)) * (tip < 0.9)
    return HeadPart(
        points,
        (MaterialSpan("tongue", triangulate(fine), MATERIAL),),
        colour * (1 - 0.12 * groove[:, None]),
        {**jaw.shapes(points), "tongueOut": out, TONGUE_UP: up},
    )


def _height_in_tongue(points: FloatArray) -> FloatArray:
    """(N,) height of vertices above the middle of the tongue's cross-section, -1 lowest to 1 highest."""
    bins = np.linspace(points[:, 2].min(), points[:, 2].max(), 40)
    near = [points[np.abs(points[:, 2] - z) < 3.0, 1] for z in bins]
    low, high = (np.interp(points[:, 2], bins, [pick(line) for line in near]) for pick in (np.min, np.max))
    height: FloatArray = (2 * points[:, 1] - low - high) / np.maximum(high - low, 1e-9)
    return height


def shape_tip(source: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Vertices (N, 3) with a tip, and the share (N,) of the tip, 0 at the body to 1 at its end."""
    points = source.copy()
    middle = float(np.median(points[:, 1]))
    points[:, 1] = middle + FLATTENING * (points[:, 1] - middle)
    front = float(points[:, 2].max())
    tip = np.clip(1 - (front - points[:, 2]) / FREE_MM, 0, 1)
    bins = np.linspace(front - FREE_MM, front, 18)
    axis = [points[np.abs(points[:, 2] - z) < 3.0, 1] for z in bins]
    centre = np.interp(points[:, 2], bins, [(line.min() + line.max()) / 2 for line in axis])
    is_top = points[:, 1] > centre
    points[:, 0] *= 1 - NARROWER * tip**2.2
    points[:, 1] = centre + (points[:, 1] - centre) * (1 - THINNER * tip**1.6) + RAISED_MM * tip
    dent = GROOVE_MM * np.exp(-((points[:, 0] / GROOVE_WIDTH_MM) ** 2)) * 4 * tip * (1 - tip)
    points[:, 1] -= np.where(is_top, dent, 0.0)
    points[:, 2] += FORWARD_MM * tip**1.5
    return points, tip
