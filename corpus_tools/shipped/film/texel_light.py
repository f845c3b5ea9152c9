"""Fit of a face's light in texels: its pages at rest, and how they change with turns of the head and cameras."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion, distance_transform_edt, gaussian_filter, map_coordinates

from corpus_tools.dense.texels import find_texels
from corpus_tools.shipped.film.pose_light import FAR, SKIN, PoseLight
from tts2face.models.baked_light import BLACK_SHARE, HairTint, quantised
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, smoothstep
from tts2face.picture.baked.interpolation import yaw_and_pitch_deg

SKIN_FLOOR = (34.0, 12.0, 11.0)  # of the texels: nothing of a face is black
SKIN_LIT, FAR_LIT, BLACK_LIT = 0.05, 0.06, 0.02  # displayed light below which a texel was hidden from the bake
TURN_SIDE, TURN_BLUR = 256, 1.1  # texels; the shadows of hair are soft, what is left of noise is not
DRAWN_MARGIN = 2  # texels
NO_CHANGE, CHANGE = 1.0, 3.0  # of 255, in any turn or camera
RELIT = 4.0, 12.0  # of 255, of skin with another haircut
STEP = 0.75  # of 255, of changes: finer ones are noise, which cannot be packed


def principal_modes(changes: FloatArray, number: int) -> tuple[FloatArray, FloatArray]:
    """Principal modes (C, ...) of changes (P, ...), and their weights (P, C)."""
    u, s, v = np.linalg.svd(changes.reshape(len(changes), -1), full_matrices=False)
    n = min(number, len(s))
    return v[:n].reshape(n, *changes.shape[1:]), u[:, :n] * s[:n]


def _shrunk(maps: NDArray[np.floating]) -> FloatArray:
    """(P, s, s, 3) means of squares of maps (P, S, S, 3); s is `TURN_SIDE`, of which S need be no multiple."""
    shared = math.gcd(maps.shape[1], TURN_SIDE)
    n = maps.shape[1] // shared
    finer = maps.repeat(TURN_SIDE // shared, axis=1).repeat(TURN_SIDE // shared, axis=2)
    means: FloatArray = finer.reshape(len(maps), TURN_SIDE, n, TURN_SIDE, n, 3).mean(axis=(2, 4)).astype(np.float64)
    return means


def _far_changes(poses: PoseLight) -> FloatArray:
    """(T + C + 1, 3, s s) changes of the second page from rest."""
    shrunk = _shrunk(poses.far - poses.far[:1]) * 255
    return shrunk.transpose(0, 3, 1, 2).reshape(len(shrunk), 3, -1)


def _skin_turns(poses: PoseLight, light: NDArray[np.floating]) -> FloatArray:
    """(N, 3, s s) changes of the skin's light (N, S, S, 3) from rest, without noise."""
    changes = gaussian_filter(_shrunk(light - poses.skin[:1]) * 255, (0, TURN_BLUR, TURN_BLUR, 0))
    return np.asarray(changes.transpose(0, 3, 1, 2).reshape(len(light), 3, -1))


def drawn_texels(face: Face, triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(2 s s,) texels of change of both pages that any of these triangles of the face shows, ``~t`` for a back."""
    numbers = np.unique(np.where(triangles < 0, ~triangles, triangles))
    part_names = np.repeat([part.name for part in face.parts], [part.count for part in face.parts])[numbers]
    uv = np.zeros((len(face.vertices), 2)) if face.uv is None else face.uv.astype(np.float64)
    found = np.zeros((2, TURN_SIDE, TURN_SIDE), bool)
    for page, parts in zip(found, (SKIN, FAR), strict=True):
        own = face.triangles[numbers[np.isin(part_names, parts)]].astype(np.int64)
        texels = find_texels(uv, own, TURN_SIDE)
        page[texels.rows, texels.columns] = True
        page[:] = binary_dilation(page, iterations=DRAWN_MARGIN)
    return found.ravel()


def camera_changes(poses: PoseLight, drawn: NDArray[np.bool_]) -> FloatArray:
    """(C, 3, 2 s s) changes of both pages from the cameras, in texels (2 s s,) that are drawn."""
    skin = _skin_turns(poses, poses.skin_from)
    return _clear(np.concatenate([skin, _far_changes(poses)[-len(skin) :]], axis=2), drawn)


def relit_skin(own: PoseLight, worn: PoseLight) -> FloatArray:
    """(s s,) share of the texels of the skin whose light at rest is another with another haircut."""
    apart = np.abs(_shrunk(worn.skin[:1])[0] - _shrunk(own.skin[:1])[0]).max(axis=2) * 255
    share: FloatArray = smoothstep(gaussian_filter(apart, TURN_BLUR), *RELIT)
    return share.ravel()


def turn_changes(
    poses: PoseLight, drawn: NDArray[np.bool_], number: int
) -> tuple[FloatArray, NDArray[np.int8], NDArray[np.float32]]:
    """Turns (T, 2) of the head, so many modes (A, 3, n) of the change of both pages, and their weights (T, A)."""
    turned = np.asarray(poses.heads.any(axis=1))
    n = int(turned.sum())
    changes = _clear(np.concatenate([_skin_turns(poses, poses.skin[turned]), _far_changes(poses)[1 : n + 1]], 2), drawn)
    below = np.zeros((n, 3, TURN_SIDE * (TURN_SIDE // BLACK_SHARE)))
    modes, weights = principal_modes(np.concatenate([changes, below], axis=2), number)
    steps, sizes = quantised(modes, least=STEP / np.abs(weights).max(axis=0))
    return (
        np.array([yaw_and_pitch_deg(head) for head in poses.heads[turned]]),
        steps,
        (weights * sizes).astype(np.float32),
    )


def _clear(changes: FloatArray, drawn: NDArray[np.bool_]) -> FloatArray:
    """Changes (N, 3, n) without those of texels that are not drawn (n,) or hardly change in any of them."""
    return np.asarray(changes * drawn * smoothstep(np.abs(changes).max(axis=(0, 1)), NO_CHANGE, CHANGE))


def rest_pages(poses: PoseLight, share: FloatArray, light: FloatArray) -> NDArray[np.uint8]:
    """(2, S, S, 3) pages at rest; the skin has a share (s, s) of light (s, s, 3) of other poses."""
    return np.stack([_skin_page(poses, share, light), _filled(poses.far_rest, FAR_LIT)])


def tint_of(poses: PoseLight) -> HairTint:
    """The hair in its other colours."""
    pages = np.stack([_filled(item, BLACK_LIT) for item in poses.far_other])
    return HairTint(poses.other_colours, pages, poses.other_vertices)


def _filled(page: NDArray[np.floating], least: float, keeps: NDArray[np.bool_] | None = None) -> NDArray[np.uint8]:
    """Page (S, S, 3) of displayed light, 0 to 255, whose hidden texels take the light of the nearest lit ones."""
    lit = binary_erosion(page.max(axis=2) > least)
    nearest = distance_transform_edt(~lit, return_distances=False, return_indices=True)
    filled = page[tuple(nearest)]
    if keeps is not None:
        filled[keeps] = page[keeps]
    pixels: NDArray[np.uint8] = np.rint(np.clip(filled, 0, 1) * 255).astype(np.uint8)
    return pixels


def _skin_page(poses: PoseLight, share: FloatArray, light: FloatArray) -> NDArray[np.uint8]:
    """Colours of the skin at rest, with a share (s, s) of light (s, s, 3) of other poses."""
    side = poses.skin_rest.shape[0]
    share, larger = (
        _enlarged(share, side),
        np.stack([_enlarged(channel, side) for channel in np.moveaxis(light, 2, 0)], 2),
    )
    page = np.maximum(poses.skin_rest, np.array(SKIN_FLOOR) / 255)
    page = page + share[..., None] * (larger - page)
    return _filled(page, SKIN_LIT, share > 0.5)


def _enlarged(values: FloatArray, side: int) -> FloatArray:
    """(S, S) values (s, s) between their places."""
    places = (np.arange(side) + 0.5) * values.shape[0] / side - 0.5
    found: FloatArray = map_coordinates(values, np.meshgrid(places, places, indexing="ij"), order=1, mode="nearest")
    return found
