"""Texture of the talker's skin; unseen parts take the head's texture in the talker's tint."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.hair_region import OTHER_HUE
from corpus_tools.dense.light_colour import linear_light, log_colour
from corpus_tools.dense.mesh_fit import face_landmarks, part_vertices
from corpus_tools.dense.skin_canvas import SkinCanvas, soften_edges
from corpus_tools.dense.skin_colour import SkinColours, welded_normals
from corpus_tools.dense.texels import Texels, blur
from tts2face.models.face import Face, Texture
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT
from tts2face.numeric.arrays import FloatArray, encode_light, smoothstep

LUMA = np.array([0.299, 0.587, 0.114])  # ITU-R BT.601
SKIN_LUMA = 0.72  # of the head's median skin; darker texels are brows, lashes, nostrils or hair
LASH_LUMA = (55.0, 115.0)  # of the head's texture: roots of lashes alone, and skin alone
TINT_REACH_MM = 14.0  # reach over which unseen skin takes the tint of the seen skin beside it
TINT_BOUNDS = (0.35, 1.6)
SHADE_BOUNDS = (0.75, 1.35)  # limits of the shading correction; more would amplify noise at the rim
BROW_LANDMARKS = (105, 66, 334, 296)  # upper edges
NOSE_BASE = 2  # landmark; beside the face, strands are searched for above it, since a beard is below
# Above the brows, and beside the outer corners of the eyes: dark texels count as hair from the first, fully from the
# second.
FRINGE_MM = (2.0, 7.0)
STRAND_TEXELS = 25  # about 4 mm of the forehead, for the shadow around a strand
FRINGE_HUE = (1.0, 1.6)  # of `OTHER_HUE` from the median skin: up to the first skin, from the second hair
FRINGE_LUMA = (0.78, 0.95)  # of the median skin: up to the first hair, from the second skin
EVEN_TEXELS, EVEN_SHARE = 50.0, 0.7  # about 8 mm, Gaussian; share of slow variations of log B/G that is removed
TINT_BLOCK = 24  # texels along a side of the squares over which the tint of seen skin is averaged: about 4 mm
SHARP_TEXELS, SHARP_GAIN = 4.0, 0.7  # unsharp masking, Gaussian of this deviation
COVERED_TEXELS, FEW_FREE = (90.0, 40.0, 18.0), 0.02  # Gaussians around covered skin; share that counts little
LINE_TEXELS, LINE_KEPT = 14.0, 0.35  # Gaussian of the skin around a line, about 2 mm; share of its depth that is kept
LINE_SKIN = (0.7, 0.85)  # of the median skin's luminance: up to the first no skin, from the second skin
LINE_DEPTHS = (0.35, 0.7)  # logarithms: up to the first lines, from the second hair, lashes and nostrils
MIN_TEXEL_WEIGHT = 0.02  # of the largest weight: texels below it are blended


def paint_skin(face: Face, canvas: SkinCanvas, skin: SkinColours, *, keeps_lines: bool = True) -> Face:
    """The face with the talker's texture."""
    side, seen = len(canvas.texture), canvas.texels.at(skin.rows)
    base = canvas.texture[canvas.texels.rows, canvas.texels.columns].astype(np.float64)
    share = canvas.share[skin.rows] * smoothstep(skin.weight / skin.weight.max(), 0.0, MIN_TEXEL_WEIGHT)
    own = _remove_shading(seen.interpolate(welded_normals(face)), skin.colour, share)
    own = _even_yellow(seen, side, own, share)
    share = soften_edges(_remove_fringe(face, (seen, side), own, share), seen, side)
    tint = np.ones(base.shape)
    tinted = np.flatnonzero(~canvas.in_mouth)
    dark = 1.0 - smoothstep(base[tinted] @ LUMA, *LASH_LUMA)[:, None]
    factors = _skin_tint(face, seen, own / np.maximum(base[skin.rows], 1.0), (share, base[skin.rows] @ LUMA))
    tint[tinted] = canvas.texels.at(tinted).interpolate(factors) * (1 - dark) + dark
    colour = base * tint
    own = sharpen(own if keeps_lines else soften_lines(own, share, seen, side), share, seen, side)
    colour[skin.rows] = share[:, None] * own + (1 - share)[:, None] * colour[skin.rows]
    return replace(face, textures=(Texture(_fill_texture(canvas.texture, canvas.texels, colour)), *face.textures[1:]))


def _remove_shading(normals: FloatArray, colour: FloatArray, share: FloatArray) -> FloatArray:
    """Colours (P, 3) without the shading that depends on the surface normal.

    Source: the shading of a matt surface under distant light is nearly a quadratic function of its normal (Ramamoorthi
    and Hanrahan 2001); each colour channel has its own.
    """
    visible = np.flatnonzero(share > 0.5)
    brightness = colour[visible] @ LUMA
    lit = visible[brightness > SKIN_LUMA * np.median(brightness)]
    terms = np.column_stack([_shading_terms(normals), np.ones(len(normals))])
    slopes = np.linalg.lstsq(terms[lit], np.log(np.maximum(colour[lit], 1.0)), rcond=None)[0]
    shade = np.exp((terms - terms[lit].mean(axis=0)) @ slopes)
    flat: FloatArray = colour / np.clip(shade, *SHADE_BOUNDS)
    return flat


def _even_yellow(texels: Texels, side: int, own: FloatArray, share: FloatArray) -> FloatArray:
    """Colours (P, 3) with less of the yellow and blue that vary slowly over skin: light of lamps and walls.

    Redness, which varies over a face by nature, and luminance stay.
    """
    colours = log_colour(own)
    luma = own @ LUMA
    weight = share * (luma > SKIN_LUMA * np.median(luma[share > 0.5]))
    usual = np.median(colours[weight > 0.5, 2])
    planes = np.column_stack([weight, weight * (colours[:, 2] - usual)])
    near, off = texels.blurred(planes, side, EVEN_TEXELS).T
    colours[:, 2] -= EVEN_SHARE * off / np.maximum(near, 0.1)
    return 255.0 * encode_light(linear_light(colours))


def _shading_terms(normals: FloatArray) -> FloatArray:
    x, y, z = normals.T
    return np.column_stack([x, y, z, x * y, x * z, y * z, x * x - y * y])


def _remove_fringe(face: Face, skin: tuple[Texels, int], own: FloatArray, share: FloatArray) -> FloatArray:
    """Shares (P,) without the strands of hair over the forehead and beside the eyes."""
    from scipy.ndimage import minimum_filter

    texels, side = skin
    marks = face_landmarks(face, face.vertices)
    places = texels.interpolate(face.vertices.astype(np.float64))
    above = places[:, 1] - float(marks[list(BROW_LANDMARKS), 1].max())
    beside = np.abs(places[:, 0]) - float(np.abs(marks[[EYE_OUTER_RIGHT, EYE_OUTER_LEFT], 0]).mean())
    beside[places[:, 1] < marks[NOSE_BASE, 1]] = 0.0
    luma = own @ LUMA
    usual = float(np.median(luma[share > 0.5]))
    hue = log_colour(own)[:, 1:]
    off = np.linalg.norm(hue - np.median(hue[share > 0.5], axis=0), axis=1) / OTHER_HUE
    clear = smoothstep(luma / usual, *FRINGE_LUMA) * (1.0 - smoothstep(off, *FRINGE_HUE))
    near = 1.0 - np.maximum(smoothstep(above, *FRINGE_MM), smoothstep(beside, *FRINGE_MM))
    picture = np.ones((side, side), np.float32)
    picture[texels.rows, texels.columns] = np.maximum(clear, near)
    grown = blur(minimum_filter(picture, STRAND_TEXELS), STRAND_TEXELS / 3)
    return np.asarray(share * grown[texels.rows, texels.columns])


def _skin_tint(
    face: Face, texels: Texels, ratio: FloatArray, share_and_luma: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """(V, 3) tint factors for the head's skin: those of the nearest seen texels, blended with the median."""
    from scipy.spatial.distance import cdist

    share, luma = share_and_luma
    skin = np.flatnonzero((share > 0.3) & (luma > SKIN_LUMA * np.median(luma[share > 0.3])))
    logs = np.log(np.clip(ratio[skin], *TINT_BOUNDS))
    usual = np.median(logs, axis=0)
    logs = np.clip(logs, usual - 0.35, usual + 0.35)
    logs, places = texels.at(skin).block_means(
        TINT_BLOCK, logs, texels.at(skin).interpolate(face.vertices.astype(np.float64))
    )
    used = part_vertices(face, ("skin",))
    near = np.exp(-((cdist(face.vertices[used], places) / TINT_REACH_MM) ** 2))
    mixed = (near @ logs + 0.5 * usual) / (near.sum(axis=1, keepdims=True) + 0.5)
    factors = np.ones((len(face.vertices), 3))
    factors[used] = np.exp(mixed)
    return factors


def without_covered(
    colour: FloatArray, is_covered: NDArray[np.bool_], blurred: Callable[[FloatArray, float], FloatArray]
) -> FloatArray:
    """Colours (P, 3) whose covered ones (P,) are those of the free skin around them.

    `blurred` gives means (P, D) of values (P, D) around each place, of a spread in texels.
    """
    found, free = colour.copy(), ~is_covered[:, None]
    known = np.concatenate([free, free * colour], axis=1).astype(np.float64)
    around = np.median(colour[~is_covered], axis=0)
    for spread in COVERED_TEXELS:
        share, *sums = blurred(known, spread).T
        around = (np.transpose(sums) + FEW_FREE * around) / (share[:, None] + FEW_FREE)
    found[is_covered] = around[is_covered]
    return found


def soften_lines(colour: FloatArray, share: FloatArray, texels: Texels, side: int) -> FloatArray:
    """Colours (P, 3) whose skin has fainter lines: what is darker than skin around it, but not as dark as a brow."""
    light = np.log(np.maximum(colour @ LUMA, 1.0))
    around = _mean_around(light[:, None], share, texels, side, LINE_TEXELS)[:, 0]
    is_skin = smoothstep(np.exp(around) / np.exp(np.median(around[share > 0.5])), *LINE_SKIN)
    depth = np.clip(around - light, 0.0, None)
    kept = 1.0 - (1.0 - LINE_KEPT) * is_skin * share * (1.0 - smoothstep(depth, *LINE_DEPTHS))
    return np.asarray(colour * np.exp((1.0 - kept) * depth)[:, None])


def sharpen(colour: FloatArray, share: FloatArray, texels: Texels, side: int) -> FloatArray:
    """Sharpened colours (P, 3), which compensate the blur of averaging over frames with tracking noise."""
    smooth = _mean_around(colour, share, texels, side, SHARP_TEXELS)
    return np.asarray(colour + SHARP_GAIN * share[:, None] * (colour - smooth))


def _mean_around(values: FloatArray, share: FloatArray, texels: Texels, side: int, spread: float) -> FloatArray:
    """Means (P, D) of values (P, D) over the texels around each, weighted by a share (P,)."""
    sums = texels.blurred(np.column_stack([share, share[:, None] * values]), side, spread)
    mean: FloatArray = sums[:, 1:] / np.maximum(sums[:, :1], 1e-3)
    return mean


def _fill_texture(texture: NDArray[np.uint8], texels: Texels, colour: FloatArray) -> NDArray[np.uint8]:
    """The texture with new texels; those off the surface take the nearest colour on it."""
    from scipy.ndimage import distance_transform_edt

    picture = texture.astype(np.float64)
    known = np.zeros(texture.shape[:2], bool)
    picture[texels.rows, texels.columns], known[texels.rows, texels.columns] = colour, True
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    filled: NDArray[np.uint8] = np.rint(np.clip(picture[tuple(nearest)], 0, 255)).astype(np.uint8)
    return filled
