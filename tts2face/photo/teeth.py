"""Upper teeth of a person in a picture, between parted lips: seen from ahead, with what lips hide completed."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from lexicon.errors import DataError
from tts2face.face.landmarks import landmark_positions, scatter_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import UPPER_LIP_INNER_MID
from tts2face.numeric.arrays import FloatArray, Mask, Pixels, decode_srgb, encode_srgb, points_in_polygon, smoothstep
from tts2face.photo.camera import TO_CAMERA, PhotoCamera, find_camera
from tts2face.photo.found_face import FoundFace, PhotoReader
from tts2face.photo.lines import LEAST_LIP_BLUR_PX, InnerLips, cheapest_path, colours_at, find_lip_line, lab_at
from tts2face.photo.mesh import LIP_RINGS, grid_triangles
from tts2face.photo.mouth import CHEEKS, PICTURED, TEETH, MouthInside, MouthLight, MouthPlace, cheek_light, head_mouth
from tts2face.video.pose import rigid_points, similarity_transforms

UPPER = TEETH[0]  # of the head
HALF_WIDTH_MM, AROUND_MM = 26.0, 3.0  # that are searched: to either side, and above and below the opening
HIGHEST_MM, LOWEST_MM = 30.0, 35.0  # of the opening, over and under the edges of the head's teeth
COLUMN_MM, ROW_MM = 0.75, 0.25  # steps of the search
TEETH_BLUR = 0.003  # of the eye distance
BRIGHTER, LESS_RED, LIKE_TOOTH = 60.0, 8.0, (0.5, 1.5)  # than lips, of L and a in 8 bits: their sum shows teeth
LIP_HUE, GREY_BRIGHTER = (
    3.0,
    30.0,
)  # of a: lips that are less redder than cheeks, as in grey ones; L alone shows teeth
TOOTH = 0.5  # likeness from which something is a tooth
ARCH_STEP_MM = 2.0  # between places along the arch whose depths are measured, and to either side of them
LEAST_BRIGHT = (0.45, 0.65)  # of the brightest teeth
BRIGHTEST = 90  # per cent of what may be teeth are darker
OVER_EDGE_MM, UNDER_EDGE_MM = 2.0, 1.0  # that are compared across the edges of teeth
SEAM_GAIN = 0.6  # of a dark line, such as that between upper and lower teeth, over the change of colour at an edge
SEAM_DARKNESS = 25.0  # of L in 8 bits
EDGE_STIFFNESS = 0.5  # cost of a step of .01 of the eye distance
EYE_DISTANCE_MM = 87.0  # over which the steps of paths count
TOUCH_MM = 3.5  # from the upper lip, within which its teeth, or gums over them, begin
FRONT_MM = 8.0  # to either side of the middle: the incisors
LEAST_HEIGHT_MM, LEAST_AT_SIDE_MM, LEAST_WIDTH_MM = 3.5, 1.5, 28.0  # of teeth that are seen well enough
EDGE_LIMITS_MM = (-4.0, 16.0)  # of the incisors, from those of the head; drawn mouths lie high
GAP_LIKENESS = 0.3  # to teeth, of what parts upper from lower ones
GAP_MM = 2.0  # between teeth that are one row
INSETS_MM = np.array([1.0, 0.3])  # from lips, which shade teeth, and from edges, whose pixels are mixed
HIDDEN_MM = 2.0  # from the lower lip, within which teeth end in it
LONGER_MM = 5.0  # at most, than they are seen
CROWN_MM, GUM_FADE_MM, GUM_MM = 10.5, 2.0, 4.0  # height of a hidden tooth, over which gums begin, and of gums
JOIN_MM, JOIN_GAIN = 3.0, (0.6, 1.6)  # over which both sides are compared, where one goes on as the other's image
HIDDEN_BLUR_MM = 0.7  # along the row, above what is seen
NEARER_ALONG = 4.0  # times nearer are pixels above and below one another, for what is hidden
LIGHT_GAIN = (0.25, 4.0)  # between pictures of one person
SHEET_STEP_MM, SHEET_ROWS = 0.8, (0.0, 0.06, 0.12, 0.25, 0.5, 0.75, 1.0)  # of vertices, the rows from the edges up
ROUND_MM = 2.5  # of the corners of the last teeth
BEFORE_MM = 0.8  # the head's teeth and gums, in front of which they lie
BLUR_MM = 1.5  # of the colours whose light the opening changes
LIP_LIMITS_MM = (-5.0, -1.5)  # of the edges, from the line where the lips meet
UNLIKE, UNLIKE_PER_DEG = 0.042, 0.0012  # of the eye distance, between faces of one person, and more between poses:
# .007 in the median and .030 at most from the front, .044 at 21 degrees; of two people .011 to .060
TEXELS_A_PIXEL, TEXELS_MM = 1.3, (3.0, 10.0)  # of their picture: of each pixel, and of a millimetre


@dataclass(frozen=True, slots=True, eq=False)
class OwnTeeth:
    """Picture (h, w, 3) of upper teeth as if seen from ahead, and where they end.

    Attributes
    ----------
    left, top, step
        Place of the middle of the first texel, and from one to the next, mm: across from the middle of the upper lip,
        up in the axes of the head.
    across, edge : (N,), (N,)
        Places along the row, and the height of the edges of the teeth there.
    ends_in_lip
        Whether the lower lip hides the edges of the incisors.
    light, skin : (3,), (3,)
        Linear light of the teeth and of the cheeks.
    """

    picture: Pixels
    left: float
    top: float
    step: float
    across: FloatArray
    edge: FloatArray
    ends_in_lip: bool
    light: FloatArray
    skin: FloatArray

    @property
    def corner(self) -> tuple[int, int]:
        """Its left top pixel, where its own pixels are counted from."""
        return (0, 0)

    def in_light_of(self, skin: FloatArray) -> "OwnTeeth":
        """The teeth as they are beside cheeks of a linear light (3,)."""
        gain = np.clip(skin / self.skin, *LIGHT_GAIN)
        picture = encode_srgb(decode_srgb(self.picture / 255) * gain)
        return replace(self, picture=picture, light=self.light * gain, skin=self.skin * gain)

    def texels(self, across: FloatArray, up: FloatArray) -> FloatArray:
        """(N, 2) places in the picture of places along and up, mm."""
        return np.column_stack([(across - self.left) / self.step, (self.top - up) / self.step])


@dataclass(frozen=True, slots=True, eq=False)
class UpperTeeth:
    """Front of the upper teeth of a head: height of their edges, and depths (N,) at ways (N,) from the middle, mm."""

    edge: float
    ways: FloatArray
    depths: FloatArray

    @classmethod
    def of(cls, head: Face) -> "UpperTeeth":
        """Front of the upper teeth of a head."""
        part = next(part for part in head.parts if part.name == UPPER)
        teeth = head.vertices[np.unique(head.triangles[part.first : part.first + part.count])].astype(np.float64)
        ways = np.arange(0.0, np.abs(teeth[:, 0]).max(), ARCH_STEP_MM)
        depths = [teeth[np.abs(np.abs(teeth[:, 0]) - way) < ARCH_STEP_MM, 2].max() for way in ways]
        return cls(float(teeth[:, 1].min()), ways, gaussian_filter(np.array(depths), 1.0, mode="nearest"))

    def points(self, across: FloatArray, up: FloatArray) -> FloatArray:
        """(..., 3) points on the front of the teeth."""
        return np.stack([across, up, np.interp(np.abs(across), self.ways, self.depths)], axis=-1)


def find_teeth(pixels: Pixels, face: FoundFace, lips: InnerLips, camera: PhotoCamera, head: Face) -> OwnTeeth | None:
    """Upper teeth between the lips of a face in a picture (H, W, 3); None where too little of them is seen."""
    if lips.is_closed:
        return None
    arch = UpperTeeth.of(head)
    view = _View(pixels, face, lips, camera, arch)
    across = np.arange(-HALF_WIDTH_MM, HALF_WIDTH_MM + COLUMN_MM / 2, COLUMN_MM)
    up = view.heights(across)
    likeness, bright = view.likeness(across, up)
    edge, height, top = _edges(likeness, bright, up)
    is_row = _middle_row(height >= LEAST_AT_SIDE_MM, across)
    is_front = is_row & (np.abs(across) < FRONT_MM)
    if not is_front.any() or np.ptp(across[is_row]) < LEAST_WIDTH_MM:
        return None
    low, high = EDGE_LIMITS_MM
    upper, lower = view.opening(across, up)
    if (
        np.median(height[is_front]) < LEAST_HEIGHT_MM
        or not low < np.median(edge[is_front]) - arch.edge < high
        or np.median((upper - top)[is_front]) > TOUCH_MM
    ):
        return None
    ends_in_lip = bool(np.median((edge - lower)[is_front]) < HIDDEN_MM)
    return view.completed(across[is_row], edge[is_row], ends_in_lip=ends_in_lip)


def read_teeth(reader: PhotoReader, smile: str | Path, photo: str | Path, face: FoundFace, head: Face) -> OwnTeeth:
    """Upper teeth of a person in a second picture, a smile, beside the face that was found in a photo."""
    seen = reader.read(smile, with_open_eyes=False)
    pixels, found = seen.picture.pixels, seen.found
    apart_deg = float(np.hypot(*np.subtract(found.angles_deg, face.angles_deg)[:2]))
    if _unlikeness(found, face) > UNLIKE + UNLIKE_PER_DEG * apart_deg:
        raise DataError(f"{smile} shows another face than {photo}; give a smile of the same person")
    landmarks = scatter_landmarks(head, landmark_positions(head))
    teeth = find_teeth(pixels, found, find_lip_line(pixels, found), find_camera(found, landmarks), head)
    if teeth is None:
        raise DataError(f"no upper teeth are seen in {smile}; give a picture of a smile that shows them clearly")
    return teeth


def _unlikeness(face: FoundFace, other: FoundFace) -> float:
    """Distance of the rigid landmarks of two faces after a similarity, of the eye distance (root mean square)."""
    indices, _, weights = rigid_points()
    own, target = ((seen.landmarks * TO_CAMERA)[indices] / seen.eye_distance_px for seen in (face, other))
    turns, scales = similarity_transforms(own[None], target, weights)
    off = scales[0] * (own - weights @ own) @ turns[0].T - (target - weights @ target)
    return float(np.sqrt(weights @ (off**2).sum(axis=1)))


class _View:
    """Teeth of a picture in the axes of the head."""

    def __init__(self, pixels: Pixels, face: FoundFace, lips: InnerLips, camera: PhotoCamera, arch: UpperTeeth) -> None:
        self._pixels, self._camera, self._arch = pixels, camera, arch
        self._opening = np.concatenate([lips.upper, lips.lower[::-1]])[:, :2]
        self._blur = max(LEAST_LIP_BLUR_PX, TEETH_BLUR * face.eye_distance_px)
        places = face.landmarks[[number for ring in LIP_RINGS for number in ring[2:-2]], :2]
        self._lip = np.median(lab_at(pixels, places, self._blur), axis=0)
        cheeks = np.median(lab_at(pixels, face.landmarks[list(CHEEKS), :2], self._blur), axis=0)
        has_hue = self._lip[1] - cheeks[1] > LIP_HUE
        self._brighter = BRIGHTER if has_hue else GREY_BRIGHTER
        self._skin = cheek_light(pixels, face.landmarks)
        self._gum = np.median(self._sampled(places), axis=0)
        middle = camera.to_head(camera.depths_of(face.landmarks[[UPPER_LIP_INNER_MID]]))
        self._middle = float(middle[0, 0])

    def _places(self, across: FloatArray, up: FloatArray) -> FloatArray:
        """(R, C, 2) pixels of a grid of places along (C,) and up (R,), mm."""
        grid = np.stack(np.broadcast_arrays(across[None], up[:, None]), axis=-1).astype(np.float64)
        points = self._arch.points(grid[..., 0], grid[..., 1])
        points[..., 0] += self._middle
        return self._camera.to_pixels(points.reshape(-1, 3))[:, :2].reshape(grid.shape)

    def _sampled(self, places: FloatArray) -> FloatArray:
        """(..., 3) colours at pixels (..., 2)."""
        return colours_at(self._pixels.astype(np.float64), places)

    def _is_open(self, places: FloatArray) -> Mask:
        return points_in_polygon(places.reshape(-1, 2), self._opening).reshape(places.shape[:-1])

    def heights(self, across: FloatArray) -> FloatArray:
        """(R,) heights that are searched, downwards, mm: those of the opening at places across (C,)."""
        up = np.arange(self._arch.edge + HIGHEST_MM, self._arch.edge - LOWEST_MM, -ROW_MM)
        is_row = self._is_open(self._places(across, up)).any(axis=1)
        around = round(AROUND_MM / ROW_MM)
        rows = np.flatnonzero(is_row) if is_row.any() else np.arange(2 * around)
        return up[max(rows[0] - around, 0) : rows[-1] + around + 1]

    def likeness(self, across: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(R, C) likeness to teeth of what is seen between the lips, and its lightness."""
        places = self._places(across, up)
        colours = lab_at(self._pixels, places, self._blur)
        is_open = self._is_open(places)
        off = colours - self._lip
        alike = smoothstep(off[..., 0] / self._brighter - off[..., 1] / LESS_RED, *LIKE_TOOTH) * is_open
        bright = colours[..., 0]
        if (alike > TOOTH).any():
            brightest = float(np.percentile(bright[alike > TOOTH], BRIGHTEST))
            alike = alike * smoothstep(bright / brightest, *LEAST_BRIGHT)
        return alike, np.where(is_open, bright, np.nan)

    def opening(self, across: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Heights (C,) of the edges of the upper and the lower lip, mm."""
        is_open = self._is_open(self._places(across, up))
        first, last = is_open.argmax(axis=0), len(up) - 1 - is_open[::-1].argmax(axis=0)
        return up[first], up[last]

    def completed(self, across: FloatArray, edge: FloatArray, *, ends_in_lip: bool) -> OwnTeeth:
        """Teeth whose edges are seen at places (N,), with their mirror image beyond and gums above them."""
        step = 1 / float(np.clip(TEXELS_A_PIXEL * self._camera.scale, *TEXELS_MM))
        reach = float(np.abs(across).max())
        n = int(np.ceil(reach / step))
        columns: FloatArray = step * np.arange(-n, n + 1, dtype=np.float64)
        own = (columns >= across[0]) & (columns <= across[-1])
        line = np.interp(columns, across, edge)
        ends = np.where(
            columns > 0, edge[-1] - np.interp(-across[-1], across, edge), edge[0] - np.interp(-across[0], across, edge)
        )
        line = np.where(own, line, line[::-1] + ends)
        rows = np.arange(line.max() + CROWN_MM + GUM_MM, line.min() - LONGER_MM, -step)
        places = self._places(columns, rows)
        inset = np.maximum(INSETS_MM, 1 / self._camera.scale) / step
        over = rows[:, None] > line
        under_lip, over_edge = (distance_transform_edt(part) for part in (self._is_open(places) | ~over, over))
        is_seen = own & (under_lip > inset[0]) & (over_edge > inset[1])
        colours = self._sampled(places)
        mirrored = is_seen[:, ::-1] & ~own
        colours = np.where(mirrored[..., None], colours[:, ::-1] * _mirror_gain(colours, is_seen, columns), colours)
        known = is_seen | mirrored
        nearest = distance_transform_edt(
            ~known, sampling=(1.0, NEARER_ALONG), return_distances=False, return_indices=True
        )
        colours = colours[nearest[0], nearest[1]]
        soft = gaussian_filter(colours, (0, HIDDEN_BLUR_MM / step, 0))
        colours = np.where((known | ~over)[..., None], colours, soft)
        gum = smoothstep(rows[:, None] - line, CROWN_MM, CROWN_MM + GUM_FADE_MM) * ~known
        colours = colours * (1 - gum[..., None]) + self._gum * gum[..., None]
        shown = is_seen & (np.abs(columns) < FRONT_MM)
        return OwnTeeth(
            np.rint(colours).clip(0, 255).astype(np.uint8),
            float(columns[0]),
            float(rows[0]),
            step,
            columns,
            line,
            ends_in_lip,
            decode_srgb(np.median(colours[shown if shown.any() else known], axis=0) / 255),
            self._skin,
        )


def _mirror_gain(colours: FloatArray, is_seen: Mask, columns: FloatArray) -> float:
    """How bright colours (R, C, 3) of teeth are near the end of the side of which less is seen, over the other side."""
    shown = columns[is_seen.any(axis=0)]
    if not len(shown):
        return 1.0
    side = 1.0 if shown[-1] < -shown[0] else -1.0
    end = min(-shown[0], shown[-1])
    near = is_seen & (np.abs(columns) > end - JOIN_MM) & (np.abs(columns) <= end)
    own, other = near & (side * columns > 0), near & (side * columns < 0)
    if not (own.any() and other.any()):
        return 1.0
    return float(np.clip(colours[own].mean() / max(float(colours[other].mean()), 1.0), *JOIN_GAIN))


def teeth_and_tongue(head: Face, place: MouthPlace, light: MouthLight, teeth: OwnTeeth | None) -> list[MouthInside]:
    """Parts of a head's mouth, after a sheet with the picture of the person's own upper teeth, if there is one.

    The head's upper teeth give way to the sheet, and go on beside it at the height of its ends.
    """
    if teeth is None:
        return [head_mouth(head, place, light)]
    arch = UpperTeeth.of(head)
    n = max(2, round(float(np.ptp(teeth.across)) / SHEET_STEP_MM) + 1)
    across = np.linspace(teeth.across[0], teeth.across[-1], n)
    edge = np.interp(across, teeth.across, teeth.edge)
    line = float(np.median(edge[np.abs(across) < FRONT_MM]))
    low, high = place.lip[1] + np.array(LIP_LIMITS_MM)
    usual = float(place.to_face(np.array([0.0, arch.edge, 0.0]))[1])
    shift = float(np.clip(line, low, min(high, usual) if teeth.ends_in_lip else high)) - line
    if teeth.ends_in_lip and shift < 0:  # the teeth are where they are seen, and longer
        edge, shift = edge + shift, 0.0
    from_end = np.minimum(across - across[0], across[-1] - across)
    edge = edge + ROUND_MM * np.clip(1 - from_end / ROUND_MM, 0, 1) ** 2
    up = edge + np.array(SHEET_ROWS)[:, None] * (teeth.top - edge)
    ahead = place.to_face(arch.points(across / place.size, edge))[:, 2] + BEFORE_MM
    vertices = np.stack(np.broadcast_arrays(across + place.lip[0], up + shift, ahead), axis=-1).reshape(-1, 3)
    texels = teeth.texels(np.broadcast_to(across, up.shape).ravel(), up.ravel())
    soft = gaussian_filter(teeth.picture.astype(np.float64), (BLUR_MM / teeth.step, BLUR_MM / teeth.step, 0))
    parts = {PICTURED: grid_triangles(np.arange(up.size).reshape(up.shape)[::-1])}
    sheet = MouthInside(vertices, np.zeros((0, len(vertices), 3)), colours_at(soft, texels), parts, texels)
    rise = float(np.interp(ROUND_MM, from_end[: n // 2], edge[: n // 2])) + shift - usual
    others = head_mouth(head, place, replace(light, teeth=teeth.light), (vertices[0, 0], vertices[n - 1, 0], rise))
    return [sheet, others]


def _edges(likeness: FloatArray, bright: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Edge, height over it and top (C,) of the upper teeth in columns of likeness (R, C) at heights (R,), mm."""
    likeness = _first_run(likeness)
    over, under = round(OVER_EDGE_MM / ROW_MM), round(UNDER_EDGE_MM / ROW_MM)
    rows = np.arange(over, len(up) - under)
    sums = np.concatenate([np.zeros((1, likeness.shape[1])), np.cumsum(likeness, axis=0)])
    before = (sums[rows] - sums[rows - over]) / over
    behind = (sums[rows + under] - sums[rows]) / under
    seen = np.nan_to_num(bright)
    seam = np.minimum(seen[rows - under], seen[rows + under]) - seen[rows]
    seam = before * np.clip(seam / SEAM_DARKNESS, 0, 1)
    cost = behind - before - SEAM_GAIN * seam
    offsets = up[rows] / EYE_DISTANCE_MM
    edge = cheapest_path(np.ascontiguousarray(cost.T), offsets, EDGE_STIFFNESS) * EYE_DISTANCE_MM
    is_tooth = (likeness > TOOTH) & (up[:, None] > edge)
    top = np.where(is_tooth.any(axis=0), up[is_tooth.argmax(axis=0)], edge)
    return edge, is_tooth.sum(axis=0) * ROW_MM, top


def _first_run(likeness: FloatArray) -> FloatArray:
    """Likeness (R, C) of the first teeth from above alone: below them lie the lower ones, or the tongue."""
    has_begun = np.cumsum(likeness, axis=0) * ROW_MM >= LEAST_AT_SIDE_MM
    has_ended = np.logical_or.accumulate(has_begun & (likeness < GAP_LIKENESS), axis=0)
    return np.where(has_ended, 0.0, likeness)


def _middle_row(is_seen: Mask, across: FloatArray) -> Mask:
    """(C,) which columns belong to the row of teeth in the middle."""
    kept = np.zeros(len(across), bool)
    for side in (1, -1):
        last = 0.0
        for at in np.argsort(np.abs(across), kind="stable"):
            if side * across[at] >= 0 and is_seen[at] and abs(across[at]) - last <= GAP_MM + COLUMN_MM:
                kept[at], last = True, abs(across[at])
    return kept
