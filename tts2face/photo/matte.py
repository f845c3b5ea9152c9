"""The person and the background of an opaque photograph, which goes on behind the person.

A segmentation network reads who is seen; colours refine it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tts2face.models.landmarks import FACE_OVAL
from tts2face.numeric.arrays import Float32Array, FloatArray, IntArray, Mask, Pixels, dot_products, smoothstep
from tts2face.photo.photograph import Photograph

Network = Callable[[Float32Array], Sequence[Float32Array]]

SIDE = 256  # of the network's input
AROUND = 3.0  # of the eye distance, around the oval of the face, that the network reads besides the whole picture
SHIFT = 0.04  # of its side, by which a second reading of that part differs
PART_FADE = 0.08  # of the part's side, over which its reading becomes that of the whole picture
WHOLE_WEIGHT = 1e-3  # of the whole picture where the parts are read
WORK_EYES_PX, WORK_SIDE_PX = 100.0, 800.0  # most eye distance and side of the picture in which the matte is found
SURE = 0.97  # share from which a place is the person's, and below 1 minus which it is the background's
PERSON_WITHIN, BACKGROUND_WITHOUT = 0.03, 0.05  # of the eye distance, kept from there
RIM_REACH = 0.3  # of the eye distance, from where the share is half: beyond it is the background
SPREADS = (1.2, 0.3, 0.08)  # of the eye distance: blurs by which sure colours are spread, the last one counts most
LEAST_KNOWN = 0.02  # share of sure colours below which wider blurs count
COLOUR_NOISE = 10.0  # of 255, besides that of the colours around
READING_NOISE = 0.1  # of a share that is read
LEAST, MOST = 0.05, 0.95  # cover that counts as none and as whole
IN_PERSON = 0.3  # cover that joins places to the person's face
HEAD_AROUND, HEAD_END = 1.5, 0.3  # of the eye distance, around the oval of the face and below the chin: the head
MOST_DEVIATION = (
    0.11  # sum over the head, of the squared eye distance; three of four bad mattes of composites have more
)
LEAST_FACE, LEAST_BACKGROUND = 0.9, 0.02  # mean share of the person in the face, and of the background around the head
AROUND_RIM = 0.03  # of the eye distance beyond the rim, where the person may still be seen faintly
RIM_NOISE = 25.0  # of 255: how faintly
BACKGROUND_CHANGE = 0.005  # of that of the person, by which its colour changes where both are mixed
PAINT_EYES_PX, PAINT_REACH_PX = 50.0, 3.0  # eye distance in which what is nearest goes on, and from how far
HALF_KNOWN = 0.5  # share of a pixel from which its colour is known
AGREED = 12.0  # of 255: difference of the colours of one thing
LEAST_AGREED = 0.02  # weight of what is nearest
GAP = 0.3  # of the eye distance: a gap over which a line weighs half as much as over none
STANDS_OUT_REACH = 0.3  # of the eye distance, from whose mean colour lines stand out


@dataclass(frozen=True, slots=True, eq=False)
class MatteReading:
    """Share (H, W) of a person in the pixels of a picture, and its standard deviation (H, W) over the readings."""

    share: Float32Array
    deviation: Float32Array


def part_background(picture: Photograph, landmarks: FloatArray, scale: float, network: Network) -> Photograph:
    """Picture with the person as its opaque part and the background behind; as it is if they are too much alike.

    Parameters
    ----------
    picture
        An opaque one.
    landmarks : (478, 2 or more)
        Of the person's face, pixels.
    scale
        Distance of the outer eye corners, pixels.
    network
        Shares (1, 256, 256, 1) of a person in pixels (1, 256, 256, 3) from 0 to 1.
    """
    import cv2

    height, width = picture.pixels.shape[:2]
    shrink = min(1.0, WORK_EYES_PX / scale, WORK_SIDE_PX / max(height, width))
    size = (max(2, round(width * shrink)), max(2, round(height * shrink)))
    small = cv2.resize(picture.pixels, size, interpolation=cv2.INTER_AREA) if shrink < 1 else picture.pixels
    places = (landmarks[:, :2] + 0.5) * np.array(size) / (width, height) - 0.5
    scale *= shrink
    oval = np.zeros(small.shape[:2], np.uint8)
    cv2.fillPoly(oval, [np.rint(places[list(FACE_OVAL)]).astype(np.int32)], 1)
    reading = read_person(small, places, scale, network)
    if _is_doubtful(reading, oval > 0, scale):
        return picture
    cover, of_person = _cover(small, reading.share, oval > 0, scale)
    cover = _joined(cover, oval > 0, RIM_REACH * scale)
    around = _grown(cover > 0, AROUND_RIM * scale)
    behind = _paint_hole(small, around, scale)
    layers = [of_person.clip(0, 255).astype(np.uint8), behind]
    if shrink < 1:
        cover = np.asarray(cv2.resize(cover, (width, height)))
        around = np.asarray(cv2.resize(around.astype(np.uint8), (width, height))) > 0
        layers = [np.asarray(cv2.resize(layer, (width, height)), np.uint8) for layer in layers]
    return _layered(picture, cover, around, layers)


def read_person(pixels: Pixels, places: FloatArray, scale: float, network: Network) -> MatteReading:
    """Mean of the network's readings of a picture and of two parts of it around a face, each also mirrored."""
    height, width = pixels.shape[:2]
    oval = places[list(FACE_OVAL)]
    low = np.clip(oval.min(axis=0) - AROUND * scale, 0, (width - 2, height - 2)).astype(int)
    high = np.clip(oval.max(axis=0) + AROUND * scale, low + 2, (width, height)).astype(int)
    shift = np.rint(SHIFT * (high - low)).astype(int)
    parts = [(low, high), (np.maximum(low - shift, 0), np.minimum(high + shift, (width, height)))]
    shares = np.zeros((6, height, width), np.float32)
    weights = np.full((6, height, width), WHOLE_WEIGHT, np.float32)
    for number, ((left, top), (right, bottom)) in enumerate([((0, 0), (width, height)), *parts]):
        rows, columns = slice(top, bottom), slice(left, right)
        for at, step in ((2 * number, 1), (2 * number + 1, -1)):
            shares[at, rows, columns] = _read(pixels[rows, columns][:, ::step], network)[:, ::step]
        if number:
            weight = _fading(top, bottom, height)[:, None] * _fading(left, right, width)
            weights[2 * number : 2 * number + 2] = 0
            weights[2 * number : 2 * number + 2, rows, columns] = weight
    weights[:2] = np.maximum(1 - weights[2:].max(axis=0), WHOLE_WEIGHT)
    weights /= weights.sum(axis=0)
    share = (weights * shares).sum(axis=0)
    return MatteReading(share, np.sqrt((weights * (shares - share) ** 2).sum(axis=0)))


def _is_doubtful(reading: MatteReading, face: Mask, scale: float) -> bool:
    """Whether readings of the head differ much, or do not show the face (H, W), or nothing beside it."""
    rows, columns = np.flatnonzero(face.any(axis=1)), np.flatnonzero(face.any(axis=0))
    is_head = np.zeros(face.shape, bool)
    around = round(HEAD_AROUND * scale)
    top, left = max(rows[0] - around, 0), max(columns[0] - around, 0)
    is_head[top : rows[-1] + round(HEAD_END * scale), left : columns[-1] + around] = True
    return (
        float(reading.deviation[is_head].sum()) > MOST_DEVIATION * scale**2
        or float(reading.share[face].mean()) < LEAST_FACE
        or float((reading.share[is_head] < 1 - SURE).mean()) < LEAST_BACKGROUND
    )


def _fading(first: int, end: int, length: int) -> Float32Array:
    """(end - first,) weights of a part of a side: less towards its ends, unless they are those of the side."""
    away = np.arange(end - first) + 0.5
    ways = [way for way, is_inside in ((away, first > 0), (away[::-1], end < length)) if is_inside]
    return smoothstep(np.min([np.full(end - first, np.inf), *ways], axis=0) / (end - first), 0, PART_FADE).astype(
        np.float32
    )


def _read(part: Pixels, network: Network) -> Float32Array:
    """Share (h, w) of a person in the pixels of a part (h, w, 3) of a picture."""
    import cv2

    small = cv2.resize(np.ascontiguousarray(part), (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    found = np.asarray(network(small[None].astype(np.float32) / 255)[0]).reshape(SIDE, SIDE)
    return np.asarray(cv2.resize(found, part.shape[1::-1], interpolation=cv2.INTER_CUBIC)).clip(0, 1)


def _cover(pixels: Pixels, share: Float32Array, face: Mask, scale: float) -> tuple[Float32Array, Float32Array]:
    """Cover (H, W) by a person whose share is read, and its colours (H, W, 3) spread over the picture.

    Where the colours around a pixel tell person and background apart, its own colour says how they are mixed in it.
    `face` (H, W) surely shows the person.
    """
    person = _grown(share > SURE, -PERSON_WITHIN * scale) | face
    background = _grown(share < 1 - SURE, -BACKGROUND_WITHOUT * scale) | ~_grown(share > IN_PERSON, RIM_REACH * scale)
    background &= ~face
    colours = pixels.astype(np.float32)
    of_person, person_variance = _spread(colours, person, scale)
    behind, variance = _spread(colours, background, scale)
    apart = of_person - behind
    squared = dot_products(apart, apart) + 1
    mixed = (dot_products(colours - behind, apart) / squared).clip(0, 1)
    noise = mixed**2 * person_variance + (1 - mixed) ** 2 * variance + COLOUR_NOISE**2
    left = colours - behind - mixed[..., None] * apart
    noise += dot_products(left, left)
    trust = READING_NOISE**2 / (READING_NOISE**2 + noise / squared)
    cover = np.where(person, 1, np.where(background, 0, trust * mixed + (1 - trust) * share))
    return ((cover - LEAST) / (MOST - LEAST)).clip(0, 1).astype(np.float32), of_person


def _joined(cover: Float32Array, face: Mask, reach: float) -> Float32Array:
    """Cover (H, W) of the place that is joined to the face, and of its rim."""
    import cv2

    _, labels = cv2.connectedComponents((cover > IN_PERSON).astype(np.uint8))
    inside = labels[face]
    own = labels == np.bincount(inside[inside > 0], minlength=1).argmax()
    is_rim = (cover <= IN_PERSON) & _grown(own, reach)
    return np.where(own | is_rim, cover, 0).astype(np.float32)


def _layered(picture: Photograph, cover: Float32Array, near: Mask, layers: Sequence[Pixels]) -> Photograph:
    """Picture in two layers (H, W, 3), whose colours of person and background near the person are given and changed.

    Where both are mixed they give the picture: mainly the person's are changed, which move with the rim.
    """
    person, background = layers
    np.copyto(person, picture.pixels, where=((cover == 1) | ~near)[..., None])
    np.copyto(background, picture.pixels, where=~near[..., None])
    every, own, other = (layer.reshape(-1, 3) for layer in (picture.pixels, person, background))
    beside = np.flatnonzero(near & (cover == 0))
    behind = other[beside].astype(np.float32)
    missing = every[beside] - behind
    other[beside] = np.rint(behind + np.sign(missing) * np.maximum(np.abs(missing) - RIM_NOISE, 0))
    rim = np.flatnonzero((cover > 0) & (cover < 1))
    share = cover.ravel()[rim, None]
    rest = (1 - share) * BACKGROUND_CHANGE
    colours, of_person, behind = (layer[rim].astype(np.float32) for layer in (every, own, other))
    missing = (colours - share * of_person - (1 - share) * behind) / (share**2 + rest * (1 - share))
    own[rim] = np.rint(of_person + share * missing).clip(0, 255)
    other[rim] = np.rint(behind + rest * missing).clip(0, 255)
    return replace(picture, pixels=person, alpha=np.rint(255 * cover).astype(np.uint8), behind=background)


def _grown(mask: Mask, way: float) -> Mask:
    """A mask grown by a way in pixels, or shrunk."""
    import cv2

    size = 2 * max(1, round(abs(way))) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    change = cv2.dilate if way > 0 else cv2.erode
    return np.asarray(change(mask.astype(np.uint8), kernel)) > 0


def _spread(colours: Float32Array, known: Mask, scale: float) -> tuple[Float32Array, Float32Array]:
    """Colours (H, W, 3) spread from where they are known, by narrower blurs where these reach, and their variance."""
    import cv2

    weight = known.astype(np.float32)
    values = np.concatenate([colours, dot_products(colours, colours)[..., None]], axis=2)
    found = np.broadcast_to(values[known].mean(axis=0) if known.any() else values.mean(axis=(0, 1)), values.shape)
    for spread in SPREADS:
        side = 2 * max(1, round(spread * scale)) + 1
        sums, share = values * weight[..., None], weight
        for _ in range(2):
            sums, share = (cv2.blur(part, (side, side), borderType=cv2.BORDER_REPLICATE) for part in (sums, share))
        found = (sums + LEAST_KNOWN * found) / (share + LEAST_KNOWN)[..., None]
    variance = np.maximum(found[..., 3] - dot_products(found[..., :3], found[..., :3]), 0) / 3
    return found[..., :3].astype(np.float32), variance.astype(np.float32)


def _paint_hole(pixels: Pixels, hole: Mask, scale: float) -> Pixels:
    """Picture (H, W, 3) whose surroundings go on in a hole (H, W); `scale` is an eye distance, pixels.

    Rows and columns whose colours at both ends of the hole agree go on between these, as door frames do, and those
    that stand out before others; elsewhere what is nearest does.
    """
    import cv2

    known = 1 - hole.astype(np.float32)
    side = 2 * round(STANDS_OUT_REACH * scale) + 1
    share = np.maximum(cv2.blur(known, (side, side)), 1e-3)
    mean = cv2.blur(pixels * known[..., None], (side, side)) / share[..., None]
    off = pixels - mean
    stands_out = (1 + dot_products(off, off) / AGREED**2).astype(np.float32)
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
    pixels: Pixels, free: Mask, stands_out: Float32Array, places: tuple[IntArray, IntArray], scale: float
) -> tuple[Float32Array, Float32Array]:
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


def _nearest(pixels: Pixels, known: Float32Array, scale: float) -> Pixels:
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
