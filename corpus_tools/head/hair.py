"""Short hair: the scalp raised to a cap, strands in its texture, and loose locks along its outline."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.noise import value_noise
from corpus_tools.head.piece import MaterialSpan, Piece
from tts2face.numeric import smoothstep

Floats = NDArray[np.float64]

MIDDLE = np.array([0.0, 25.0, -72.0])  # of the skull, mm
CROWN = np.array([14.0, 122.0, -98.0])  # strands run from here
# The hairline: height y in mm by the angle from the front about the skull's middle, in degrees.
LINE_DEG = np.array([0, 18, 34, 48, 58, 66, 74, 84, 98, 108, 122, 140, 160, 180])
LINE_Y = np.array([64, 62, 60, 55, 44, 26, 2, -6, 14, -6, -42, -60, -70, -72])
EAR = (np.array([80.0, -8.0, -72.0]), np.array([26.0, 30.0, 17.0]))  # |x|, y, z: no hair grows there
SOFT_MM = 7.0  # width of the hairline
MATERIAL = {"specular": 0.06, "shininess": 9.0, "wrap": 0.2, "texture": 0}
LOCK_MATERIAL = {"specular": 0.08, "shininess": 9.0, "wrap": 0.2}


@dataclass(frozen=True, slots=True)
class Haircut:
    """A haircut: thickness in mm on top, at the sides and at the nape, and the number of loose locks."""

    top: float = 13.0
    side: float = 8.0
    nape: float = 3.5
    n_locks: int = 620


def hair_share(places: Floats) -> Floats:
    """(P,) 1 where hair grows, 0 where it does not, for positions (P, 3) on the default skin, mm."""
    off = places - MIDDLE
    angle = np.degrees(np.arctan2(np.abs(off[:, 0]), off[:, 2]))
    line = np.interp(angle, LINE_DEG, LINE_Y)
    ragged = 1.6 * np.sin(0.55 * places[:, 0] + 0.31 * places[:, 2]) + 1.1 * np.sin(
        1.3 * places[:, 0] - 0.9 * places[:, 2]
    )
    share = smoothstep(places[:, 1] + ragged - line, -SOFT_MM / 2, SOFT_MM / 2)
    mirrored = np.column_stack([np.abs(places[:, 0]), places[:, 1:]])
    ear = np.linalg.norm((mirrored - EAR[0]) / EAR[1], axis=1)
    grown: Floats = share * smoothstep(ear, 0.92, 1.12)
    return grown


def hair_thickness(places: Floats, cut: Haircut, generator: np.random.Generator) -> Floats:
    """(P,) height of the hair above the skin, mm."""
    up = smoothstep(places[:, 1], 20, 110)
    back = smoothstep(-places[:, 2], 120, 190) * (1 - up)
    full = cut.side + (cut.top - cut.side) * up + (cut.nape - cut.side) * back
    inner = _inner_share(places)
    clumps = 1 + 0.22 * value_noise(strand_field(places, 9.0, 40.0), 1.0, generator)
    return full * inner * clumps


def _inner_share(places: Floats) -> Floats:
    """(P,) share of the full thickness, which increases from the hairline."""
    lowered = places.copy()
    lowered[:, 1] -= 13.0
    return 0.12 * hair_share(places) + 0.88 * hair_share(places) * hair_share(lowered)


def strand_field(places: Floats, width_mm: float, length_mm: float) -> Floats:
    """(P, 3) coordinates in which noise of size 1 has the width and length of a strand that runs from the crown."""
    off = places - CROWN
    axis = (CROWN - MIDDLE) / np.linalg.norm(CROWN - MIDDLE)
    ahead = np.array([0, 0, 1.0]) - axis[2] * axis
    ahead /= np.linalg.norm(ahead)
    aside = np.cross(ahead, axis)
    turn = np.arctan2(off @ aside, off @ ahead)
    far = np.linalg.norm(off, axis=1)
    swirl = turn + 0.004 * far
    around = 75.0  # mm, about the skull's radius, where strand widths are exact
    return np.column_stack([around * np.cos(swirl) / width_mm, around * np.sin(swirl) / width_mm, far / length_mm])


def strand_colour(places: Floats, colour: Floats, generator: np.random.Generator) -> Floats:
    """(P, 3) colour of the hair at positions (P, 3)."""
    fine = value_noise(strand_field(places, 1.6, 38.0), 1.0, generator)
    broad = value_noise(strand_field(places, 6.0, 55.0), 1.0, generator)
    light = 1 + 0.34 * fine + 0.22 * broad
    warm = np.array([1.06, 1.0, 0.92])
    return np.clip(colour * light[:, None] * np.where(fine[:, None] > 0.4, warm, 1.0), 0.02, 1)


def lock_piece(
    surface: tuple[Floats, Floats, Floats], share: Floats, cut: Haircut, colour: Floats, generator: np.random.Generator
) -> Piece:
    """Loose locks on the cap: bent blades along the strands.

    `surface` holds points, normals, and the points' positions on the default skin, (N, 3) each.
    """
    skin_points, normals, default = surface
    chance = share * (share > 0.5)
    roots = generator.choice(len(skin_points), cut.n_locks, p=chance / chance.sum())
    place, normal = skin_points[roots], normals[roots]
    offset = place - CROWN
    flow = offset - (offset * normal).sum(axis=1, keepdims=True) * normal
    flow /= np.maximum(np.linalg.norm(flow, axis=1, keepdims=True), 1e-6)
    aside = np.cross(normal, flow)
    flow = flow + generator.normal(0, 0.25, (len(roots), 1)) * aside
    length = generator.uniform(12, 26, (len(roots), 1))
    width = generator.uniform(0.35, 0.9, (len(roots), 1))
    start = place - 0.5 * normal + generator.normal(0, 1.5, (len(roots), 1)) * aside
    mid = start + 0.4 * length * flow + generator.uniform(0.4, 1.4, (len(roots), 1)) * normal
    tip = start + length * flow + generator.uniform(-1.8, 0.8, (len(roots), 1)) * normal
    points = np.stack([start, mid + width * aside, mid - width * aside, tip], 1)
    one = np.array([(0, 1, 2), (1, 3, 2)])
    shades = strand_colour(default[roots], colour, generator)
    return Piece(
        points.reshape(-1, 3),
        (MaterialSpan("hair_locks", (one + 4 * np.arange(len(roots))[:, None, None]).reshape(-1, 3), LOCK_MATERIAL),),
        np.repeat(shades, 4, axis=0),
    )
