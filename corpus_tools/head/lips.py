"""Lips that touch at rest: MakeHuman's stand half a millimetre to a millimetre apart beside the middle."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from corpus_tools.head.skin import Skin

Floats = NDArray[np.float64]

PRESS_MM = 0.12  # lips overlap by this at rest, so that no light falls between them
REACH_MM = 5.0  # how far from the line of contact the skin follows
N_COLUMNS = 61
MOUTH_BOX = ((-0.32, 0.32), (6.45, 6.75), (1.25, 1.75))  # around the lips on the source's base mesh
DEPTH_MM = 12.0  # behind the foremost place of a lip at its x begins the cavity; lips touch up to 10 mm behind it


def closed(skin: Skin) -> Skin:
    """The skin with lips that meet."""
    vertices = skin.vertices
    for _ in range(4):
        vertices = vertices + _closing(replace(skin, vertices=vertices))
    return replace(skin, vertices=vertices)


def lip_gaps(skin: Skin) -> tuple[Floats, Floats, Floats]:
    """Columns x (C,), and the upper and lower lip's edges there as (C, 2) of y and z, mm."""
    near = _mouth(skin)
    quads = skin.quads[near[skin.quads].all(axis=1)]
    edges = np.unique(np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1), axis=0)
    is_lower = lower_share(skin)[edges].mean(axis=1) > 0
    half = _half_width(skin)
    columns = np.linspace(-half, half, N_COLUMNS)
    upper, lower = (
        _rims(skin.vertices, edges[is_lower == low], columns, -1.0 if low else 1.0) for low in (False, True)
    )
    return columns, upper, lower


def lower_share(skin: Skin) -> Floats:
    """(N,) -1 on the upper lip, 1 on the lower, between at the corners."""
    moved = np.linalg.norm(skin.shapes["jawOpen"], axis=1)
    low, high = np.percentile(moved[_mouth(skin)], [5, 95])
    share: Floats = np.clip((moved - (low + high) / 2) / (0.18 * (high - low)), -1, 1)
    return share


def _mouth(skin: Skin) -> NDArray[np.bool_]:
    low, high = np.array(MOUTH_BOX).T
    inside: NDArray[np.bool_] = np.all((skin.base > low) & (skin.base < high), axis=1)
    return inside


def _half_width(skin: Skin) -> float:
    """Half the width of the slit: where upper and lower vertices are still apart when the jaw opens."""
    near, share = _mouth(skin), lower_share(skin)
    return 0.96 * float(np.abs(skin.vertices[near & (np.abs(share) > 0.9) & (skin.source_uv[:, 1] < 0.14), 0]).max())


def _rims(vertices: Floats, edges: NDArray[np.int64], columns: Floats, sign: float) -> Floats:
    """(C, 2) y and z of the lowest (sign 1) or highest (-1) place of a lip at each x; NaN where there is none."""
    rims = np.full((len(columns), 2), np.nan)
    ends = vertices[edges]
    for at, x in enumerate(columns):
        crossed = (ends[:, 0, 0] <= x) != (ends[:, 1, 0] <= x)
        if crossed.any():
            one, two = ends[crossed, 0], ends[crossed, 1]
            points = one + ((x - one[:, 0]) / (two[:, 0] - one[:, 0]))[:, None] * (two - one)
            points = points[points[:, 2] > points[:, 2].max() - DEPTH_MM]
            rims[at] = points[np.argmin(sign * points[:, 1]), 1:]
    return rims


def _closing(skin: Skin) -> Floats:
    """(N, 3) half a step towards contact on each lip."""
    columns, upper, lower = lip_gaps(skin)
    gap = np.nan_to_num(upper[:, 0] - lower[:, 0]) + PRESS_MM
    gap = gaussian_filter1d(gap, 1.0) * np.clip((1 - np.abs(columns) / columns.max()) / 0.06, 0, 1)
    share = lower_share(skin)
    x = skin.vertices[:, 0]
    moved = np.zeros_like(skin.vertices)
    for sign, rim in ((-1.0, upper), (1.0, lower)):
        line = np.stack(
            [np.interp(x, columns, np.nan_to_num(rim[:, k], nan=float(np.nanmean(rim[:, k])))) for k in (0, 1)], 1
        )
        off = np.linalg.norm((skin.vertices[:, 1:] - line) * [1.0, 0.7], axis=1)
        reach = np.exp(-((off / REACH_MM) ** 2)) * np.clip(sign * share, 0, 1) * (np.abs(x) < columns.max())
        moved[:, 1] += sign * 0.5 * reach * np.interp(x, columns, gap)
    return moved
