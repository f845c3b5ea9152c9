"""A mouth that ends behind the lips: triangles of its inside that a face's light does not list, as none saw them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tts2face.models.baked_light import LIP_RING, BakedLight
from tts2face.models.face import Face
from tts2face.numeric.arrays import Float32Array, connected_pieces, smoothstep

# Where things lie, in widths of the opening of the lips from its middle: least and most aside, up or down, ahead, and
# behind. Skin that is seen from behind is that of the cheeks, through the corners of lips that fold.
INSIDE = (0.0, 0.7, 0.6, 0.1, 2.6)
CHEEKS = (0.4, 1.25, 0.4, 0.1, 1.2)
LEAST_AHEAD = -0.3  # of what is seen of teeth, gums and tongue at rest, of the length of its normal
WALL, DARK = (62.0, 24.0, 21.0), (17.0, 6.0, 5.5)  # colours of the walls at the lips, and where no light comes
LIT_DEPTH = 0.55  # widths of the opening behind the lips over which the walls darken


def close_mouth(face: Face, light: BakedLight, part_of: NDArray[np.int32]) -> BakedLight:
    """Light that lists the whole inside of the mouth, a closed bag behind the lips.

    The triangles that the baked poses show leave holes in other poses. The skin that is added lies in the dark,
    `BakedLight.is_inside`: pieces of skin that nothing saw and that reach into the mouth.

    Parameters
    ----------
    part_of : (F,)
        Part of each triangle of the face.
    """
    numbers = np.arange(len(face.triangles), dtype=np.int32)
    is_skin = np.isin(part_of, [n for n, part in enumerate(face.parts) if light.page_of.get(part.name) == 0])
    centres = _from_opening(face)[face.triangles].mean(axis=1)
    unseen = np.setdiff1d(numbers, light.triangles)
    skin = unseen[is_skin[unseen]]
    piece_of = connected_pieces(face.triangles[skin], len(face.vertices))[face.triangles[skin, 0]]
    skin = skin[np.isin(piece_of, piece_of[_lies_in(INSIDE, centres[skin])])]
    inner = unseen[np.isin(face.triangles[unseen], light.mouth_rows).all(axis=1)]
    a, b, c = face.vertices[face.triangles[inner]].transpose(1, 0, 2)
    outward = np.cross(b - a, c - a)
    inner = inner[outward[:, 2] > LEAST_AHEAD * np.linalg.norm(outward, axis=1)]
    fronts = np.union1d(skin, inner)
    backs = np.setdiff1d(~numbers[is_skin & _lies_in(CHEEKS, centres)], light.triangles)
    return replace(
        light,
        triangles=np.concatenate([light.triangles, fronts, backs]),
        is_inside=np.concatenate([light.is_inside, np.ones(len(fronts) + len(backs), bool)]),
    )


def wall_colours(face: Face) -> Float32Array:
    """(V, 3) colours of the skin of the inside: light falls on it from between the lips."""
    share = smoothstep(-_from_opening(face)[:, 2:], 0.0, LIT_DEPTH)
    colours: Float32Array = (np.array(WALL) * (1 - share) + np.array(DARK) * share).astype(np.float32)
    return colours


def _lies_in(box: tuple[float, ...], places: Float32Array) -> NDArray[np.bool_]:
    least, most, upright, ahead, behind = box
    aside = np.abs(places[:, 0])
    inside: NDArray[np.bool_] = (least <= aside) & (aside < most) & (np.abs(places[:, 1]) < upright)
    return inside & (-behind < places[:, 2]) & (places[:, 2] < ahead)


def _from_opening(face: Face) -> Float32Array:
    """Places (V, 3) of vertices from the middle of the opening of the lips, in widths of it."""
    at = {int(number): row for row, number in enumerate(face.landmarks)}
    rows = [at[number] for number in LIP_RING]
    ring = np.einsum("lc,lcx->lx", face.landmark_weights[rows], face.vertices[face.landmark_vertices[rows]])
    places: Float32Array = (face.vertices - ring.mean(axis=0)) / np.ptp(ring[:, 0])
    return places
