"""Teeth of a drawn character: each arch one lit surface with faint seams, tied to the line between the lips."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from corpus_tools.dense.grids import grid_triangles
from corpus_tools.shipped.drawn.character import DrawnCharacter
from corpus_tools.shipped.head.cage import Cage
from corpus_tools.shipped.head.head import COVERED_POSES, ReferenceHead, cover_in_pose
from corpus_tools.shipped.head.jaw import Jaw
from corpus_tools.shipped.head.lips import lip_front
from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.retreat import add_retreat
from corpus_tools.shipped.head.skin import HeadSkin
from corpus_tools.shipped.head.teeth import (
    COVER_MM,
    LOWER,
    UPPER,
    Arch,
    arch_path,
    fit_teeth,
    follow_lips,
    gum_piece,
    keep_behind,
)
from tts2face.numeric.arrays import FloatArray, smoothstep

N_ALONG = 145
# A tooth's section: height above the edge and way outwards in mm of a crown of `CROWN_MM`, share of a seam's depth.
SECTION = (
    (0.35, -3.0, 0.0), (-0.05, -1.6, 0.2), (0.05, -0.7, 0.6), (0.8, -0.15, 1.0), (3.2, 0.0, 1.0), (7.0, -0.25, 0.8),
    (11.5, -0.9, 0.5),
)  # fmt: skip
CROWN_MM = 10.6
UPPER_GAIN = 2.0  # of the upper crowns, so that no gum shows in an open smile
ARCH_GAIN = 1.12  # of the arch's breadth
SHOWN_MM = {"upper": -4.2, "lower": -2.4}  # of the biting edges over the line between the lips
CURVE_SHARE, CURVE_X_MM = 0.6, 26.0  # of the curve of that line which the edges follow, and how far from the middle
FRONT_X_MM = 19.0  # half the part of the line that its curve is fitted to
SEAM_MM, SEAM_SHARE, SEAM_DEPTH_MM = 0.45, 0.40, 0.10
CORNER_MM, CORNER_REACH_MM = 0.18, 0.9  # rounding of the crowns' corners
BACK_LOWER = 0.12  # share by which the rearmost crowns are lower
SHADE = (1.0, 1.0, 0.96, 0.88, 0.76, 0.62)  # brightness of the crowns from the middle
SEAM_TINT, GUM = np.array([0.928, 0.911, 0.897]), np.array([0.80, 0.46, 0.46])
TEETH_MATERIAL = {"specular": 0.30, "shininess": 40.0, "wrap": 0.5}
GUM_MATERIAL = {"specular": 0.25, "shininess": 30.0, "wrap": 0.4}


def teeth_pieces(
    cage: Cage, skin: HeadSkin, reference: ReferenceHead, jaw: Jaw, character: DrawnCharacter
) -> tuple[HeadPart, HeadPart]:
    """Upper and lower arch of a character's cage, behind its skin; `reference` is that of a person."""
    pieces = []
    ahead = lip_front(skin.vertices, reference.lips) - lip_front(reference.skin.vertices, reference.lips)
    for arch, name in ((replace(UPPER, heights=UPPER_GAIN * UPPER.heights), "upper"), (LOWER, "lower")):
        strip = cage.group(f"helper-{name}-teeth")
        piece = _arch_piece(arch, name, character)
        points = fit_teeth(piece.vertices, reference.cage.vertices[strip], cage.vertices[strip])
        points = _follow_line(follow_lips(points, piece.vertices, ahead), name, skin, reference.lips)
        points = _smooth_cover(points, keep_behind(points, skin.vertices, COVER_MM[name]))
        pose, cover = COVERED_POSES[name]
        points = _smooth_cover(points, cover_in_pose(points, skin, jaw, pose, cover))
        moved = add_retreat(points, jaw.shapes(points), skin, reference.lips) if name == "lower" else {}
        pieces.append(HeadPart(points, piece.spans, piece.colours, moved))
    upper, lower = pieces
    return upper, replace(lower, vertices=lower.vertices - [0.0, 0.0, character.teeth_back])


def _follow_line(points: FloatArray, name: str, skin: HeadSkin, ring: NDArray[np.int64]) -> FloatArray:
    """An arch (N, 3) whose edge lies `SHOWN_MM` over the line between the lips, and follows a share of its curve."""
    line = skin.vertices[ring]
    front = line[np.abs(line[:, 0]) < FRONT_X_MM]
    curve = np.polyfit(front[:, 0], front[:, 1], 2)
    teeth = points[: N_ALONG * len(SECTION)]
    middle = teeth[np.abs(teeth[:, 0]) < 5, 1]
    edge = middle.min() if name == "upper" else middle.max()
    moved = points.copy()
    moved[:, 0] *= ARCH_GAIN
    bend = CURVE_SHARE * curve[0] * np.minimum(moved[:, 0] ** 2, CURVE_X_MM**2)
    moved[:, 1] += float(curve[2]) + SHOWN_MM[name] - edge + bend
    return moved


def _smooth_cover(points: FloatArray, covered: FloatArray) -> FloatArray:
    """Teeth (N, 3) that retreat as far as `covered`, but along the arch: by vertex the retreat makes a wave."""
    n_teeth = N_ALONG * len(SECTION)
    lack = (covered - points)[:n_teeth, 2].reshape(N_ALONG, len(SECTION)).min(axis=1)
    moved = covered.copy()
    moved[:n_teeth] = points[:n_teeth]
    moved[:n_teeth, 2] += np.repeat(gaussian_filter1d(minimum_filter1d(lack, 13), 6), len(SECTION))
    return moved


def _arch_piece(arch: Arch, name: str, character: DrawnCharacter) -> HeadPart:
    """Teeth and gum of an arch; its two spans are ``teeth_<name>`` and ``gums_<name>``."""
    tooth_colour, seams = np.array(character.palette.teeth), character.seams
    path, total = arch_path(arch.curve), arch.widths.sum()
    along = np.linspace(-total, total, N_ALONG)
    bounds = np.concatenate([[0], np.cumsum(arch.widths)])
    tooth = np.clip(np.searchsorted(bounds, np.abs(along), side="right") - 1, 0, 5)
    within = (np.abs(along) - bounds[tooth]) / arch.widths[tooth]
    off_seam = np.minimum(within, 1 - within) * arch.widths[tooth]  # mm
    seam = np.exp(-((off_seam / SEAM_MM) ** 2))
    seam[np.abs(along) < 0.3] = 1
    corner = CORNER_MM * seams * np.exp(-((off_seam / CORNER_REACH_MM) ** 2))
    height = arch.heights[0] * (1 - BACK_LOWER * np.abs(along) / total) / CROWN_MM
    light = np.interp(np.abs(along), bounds[:-1] + arch.widths / 2, SHADE)[:, None]
    place, normal = path.at(along)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    rows, colours = [], []
    for up, out, share in SECTION:
        flat = place + (out - SEAM_DEPTH_MM * seams * seam * share)[:, None] * normal
        over_edge = (corner if up < 0.1 else 0.0) + up * height
        rows.append(np.column_stack([flat[:, 0], arch.edge_y + arch.up * over_edge, flat[:, 1]]))
        enamel = tooth_colour * (1 - (1 - SEAM_TINT) * (SEAM_SHARE * seams * seam * share)[:, None])
        colours.append(enamel * light * (1 - 0.06 * smoothstep(np.array([up]), 3, 10)))
    points = np.stack(rows, axis=1).reshape(-1, 3)
    gum = gum_piece(path, arch, GUM)
    spans = (
        MaterialSpan(f"teeth_{name}", _facing_front(points), TEETH_MATERIAL),
        MaterialSpan(f"gums_{name}", gum.spans[0].triangles + len(points), GUM_MATERIAL),
    )
    return HeadPart(
        np.concatenate([points, gum.vertices]),
        spans,
        np.concatenate([np.stack(colours, axis=1).reshape(-1, 3), gum.colours]),
    )


def _facing_front(points: FloatArray) -> NDArray[np.int64]:
    """Triangles of an arch whose front teeth face the viewer."""
    triangles = grid_triangles(N_ALONG, len(SECTION))
    a, b, c = points[triangles].transpose(1, 0, 2)
    is_front = np.abs(points[triangles][:, :, 0]).max(axis=1) < 6
    return triangles if np.cross(b - a, c - a)[is_front, 2].sum() > 0 else triangles[:, ::-1]
