"""Lids of a photograph: pictures of each eye shut, and sheets that come forward as the lid comes down.

Lashes move; the skin that they leave behind does not: a picture of the shut eye lies still, behind the skin and behind
the eye, and each of its rows comes before them as the lashes pass it. So glasses and hair stay where they are, and the
crease above an open eye goes.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from tts2face.numeric.arrays import FloatArray, IntArray, Pixels, smoothstep
from tts2face.photo.lines import BELOW, LidLines, colours_at, lab_at
from tts2face.photo.mesh import BAND_ROWS, grid_triangles

CHEEKS = ((50, 205, 101, *BELOW[0]), (280, 425, 330, *BELOW[1]))  # and the skin below the eye
BROWS = ((46, 53, 52, 65, 55), (276, 283, 282, 295, 285))  # lower edges, from the outer end to the inner one
TOP_SHARE, TOP_LIMITS = 0.8, (0.06, 0.16)  # of the way to the brow, and of the eye distance: where a shut lid begins
OVER_LASHES = 0.02  # of the eye distance, at least, between them and there
UNDER = 0.06  # of the eye distance below the lower margin, where it ends
AT_CORNER = 0.35  # of the height of lashes in the corners of the eye
LEAST_PX = 0.5  # of a way
BESIDE = (0.11, 0.05)  # of the eye distance beside the outer and the inner corner, over which it ends
MARGIN = 0.16  # around the eye, of the picture
FADE = (0.72, 1.0)  # of the ways to top and end, over which the picture's own skin comes back
TOP_ROWS, UNDER_ROWS = (0.8, 0.9, 1.0, 1.1), (0.8, 1.0, 1.2, 1.5)  # of these ways, where skin is measured
COLOUR_BLUR = 0.012  # of the eye distance, as of all blurs
LIKE_SKIN = np.array([45.0, 14.0, 14.0])  # of Lab in 8 bits: glasses, hair and brows are farther from the skin
LEAST_LIKE, LEAST_SHARE = 1e-3, 0.2  # weight of what is unlike, and the mean weight from which the rows above count
RIDGE = np.array([1e-3, 0.05, 0.2])  # of a line of colours along the lid, of second order
LOWER_SHARE = (0.0, 0.8)  # of the way down, over which the colours become those below the eye
LASH_SHADE, ROUND_LIGHT = 0.22, 0.03  # of the light: lost towards the lashes, and won in the middle of the lid
LINE_WIDTH, LINE_LEAST_PX = 0.010, 0.7  # of the shadow between shut lids
LINE_TAPER = 0.12  # of the width of the eye, over which it begins and ends
LINE_DARKNESS = (0.2, 0.8)  # limits of its share of the light
DARK_LASHES = 25  # per cent of what lies at the upper margin are darker than its lashes
CHANGED = (0.3, 0.7)  # of the height of the lashes, over which what is above them becomes the lid
LASHES_TAPER = 0.1  # of the width of the eye, at either side
# below the eye, where the grain of skin is taken; its blur; sd
GRAIN_FROM = 0.30
GRAIN_BLUR = 0.012
MOST_GRAIN = 2.5
LID_MEETING = 0.0  # of the opening of an eye from its lower lid, where the lids meet
FOLD_AT, MOST_FOLD_SHADE = (
    (0.0, 0.03),
    0.35,
)  # above the lashes, of the eye distance: the fold; and the most shade there
SHADED_ABOVE, SHADED_BELOW = (
    (0.2, 0.9),
    (0.0, 0.8),
)  # of the ways from the top and down the eye, over which shade varies
FORWARD_MM, EYE_FORWARD_MM = 8.0, 10.0  # way of a sheet in a whole blink, over skin and over the eye
LASHES_MM = 0.4  # behind the skin, in which the lashes that move lie at rest
LASHES_INTO = 0.006  # of the eye distance, by which their picture is taken from above the margin, beside the eye
ABOVE_COME, BELOW_COME = (
    (0.10, 0.26),
    (0.82, 0.12),
)  # of a blink, when the sheets come at the margins, and to their ends
SIDE_COMES = 0.5  # beside the corners
FIRST_COME, LAST_COME = 0.06, 0.95  # of a blink, within which the sheet over the eye comes
ABOVE_GRID, BELOW_GRID = np.linspace(1, 0, 5), np.array([0.0, 0.5, 1.0])  # rows of the ways to top and end
SIDE_GRID = np.array([1.0, 0.5])  # of the ways beside the corners
EYE_GRID = np.array([-0.2, 0.0, 0.25, 0.5, 0.75, 1.0, 1.2])  # of the opening
EYE_OVERLAP = 0.02  # of the eye distance, beyond the margins


@dataclass(frozen=True, slots=True, eq=False)
class LidPicture:
    """A picture (h, w, 3), whose left top pixel lies at a corner."""

    picture: Pixels
    corner: tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class LidFrame:
    """Lines of an eye and ways from them, pixels.

    Attributes
    ----------
    upper, lower : (25, 2)
        Margins, from the outer corner to the inner one.
    up : (2,)
    lashes : (25,)
        From the upper margin to their end.
    over, below : (C, 2)
        The margins, and beyond the corners of the eye.
    top, under : (C,)
        From there to the end of the lid above, and to its end below.
    cheek : (N, 2)
        Places on skin.
    """

    upper: FloatArray
    lower: FloatArray
    up: FloatArray
    lashes: FloatArray
    over: FloatArray
    below: FloatArray
    top: FloatArray
    under: FloatArray
    cheek: FloatArray
    scale: float

    @classmethod
    def of(cls, landmarks: FloatArray, lids: LidLines, eye: int, scale: float) -> "LidFrame":
        """Lines of the person's right (0) or left eye; `scale` is the eye distance."""
        upper, lower = lids.upper[eye][:, :2], lids.lower[eye][:, :2]
        along = (upper[-1] - upper[0]) / np.linalg.norm(upper[-1] - upper[0])
        up = np.array([along[1], -along[0]])
        up *= -np.sign(up[1])
        outer, inner = (np.outer(SIDE_GRID, way * scale * along) for way in BESIDE)
        over, below = (np.concatenate([line[0] - outer, line, line[-1] + inner[::-1]]) for line in (upper, lower))
        at = (over - over[0]) @ along
        bow = np.sin(np.pi * at / at[-1]).clip(0, 1) ** 0.5
        brow = landmarks[list(BROWS[eye]), :2] - over[0]
        room = np.interp(at, brow @ along, brow @ up) - (over - over[0]) @ up
        least, most = (share * scale for share in TOP_LIMITS)
        top = np.maximum(np.clip(TOP_SHARE * room, least, most), lids.fold + OVER_LASHES * scale)
        of_lashes = AT_CORNER + (1 - AT_CORNER) * np.sin(np.linspace(0, np.pi, len(upper))).clip(0, 1) ** 0.5
        return cls(
            upper=upper,
            lower=lower,
            up=up,
            lashes=lids.fold * of_lashes,
            over=over,
            below=below,
            top=np.maximum(top * bow, LEAST_PX),
            under=np.maximum(UNDER * scale * bow, LEAST_PX),
            cheek=landmarks[list(CHEEKS[eye]), :2],
            scale=scale,
        )

    @property
    def meeting(self) -> FloatArray:
        """(25, 2) where the margins of shut lids meet."""
        return self.lower + LID_MEETING * (self.upper - self.lower)

    @property
    def opening(self) -> FloatArray:
        """(25,) height of the eye."""
        found: FloatArray = (self.upper - self.lower) @ self.up
        return np.maximum(found, 1e-3)


@dataclass(frozen=True, slots=True, eq=False)
class ShutEye:
    """Pictures of an eye that is shut and of its lashes, and the change (R, 25, 3) of their colours on their way there.

    Rows of lashes are those of `BAND_ROWS` from above, and the margin. The lid is as dark as its fold above the open
    eye; in a whole blink it gains ``light`` (h, w, 3).
    """

    picture: LidPicture
    lashes: LidPicture
    change: FloatArray
    light: FloatArray

    def light_at(self, places: FloatArray) -> FloatArray:
        """(N, 3) what the lid gains at pixels (N, 2)."""
        return colours_at(self.light, places - self.picture.corner)


def shut_eye(pixels: Pixels, frame: LidFrame) -> ShutEye:
    """An eye of a picture (H, W, 3), shut."""
    view = _View(pixels, frame)
    skin = view.skin()
    share = view.share_of_lid()
    light = share[..., None] * view.fold_shade(skin)[..., None] * skin
    shut = view.over(skin * view.line_between()[..., None], share)
    picture = np.rint(shut - light).clip(0, 255).astype(np.uint8)
    lashes = view.over(skin, view.share_above_lashes())
    places = frame.upper + (np.array([*BAND_ROWS[::-1], 0.0])[:, None] * frame.lashes)[..., None] * frame.up
    here, there = (colours_at(skin, places + way - view.corner) for way in (0.0, frame.meeting - frame.upper))
    return ShutEye(LidPicture(picture, view.corner), LidPicture(lashes, view.corner), there - here, light)


class _View:
    """The part of a picture around an eye, and where its pixels lie beside the lines of the eye."""

    def __init__(self, pixels: Pixels, frame: LidFrame) -> None:
        self._pixels, self._frame = pixels, frame
        every = np.concatenate([frame.upper, frame.lower])
        limits = np.array(pixels.shape[1::-1])
        low = np.clip(np.floor(every.min(axis=0) - MARGIN * frame.scale).astype(int), 0, limits - 2)
        high = np.clip(np.ceil(every.max(axis=0) + MARGIN * frame.scale).astype(int) + 1, low + 2, limits)
        self.corner = (int(low[0]), int(low[1]))
        self._part = pixels[low[1] : high[1], low[0] : high[0]].astype(np.float64)
        down, across = np.mgrid[low[1] : high[1], low[0] : high[0]].astype(np.float64)
        off = np.stack([across, down], axis=-1) - frame.upper[0]
        way = frame.upper[-1] - frame.upper[0]
        self._wide = float(np.linalg.norm(way))
        self._axis = way / self._wide
        self._columns = {len(line): (line - frame.upper[0]) @ self._axis for line in (frame.upper, frame.over)}
        self._at = off @ self._axis
        height = off @ frame.up
        upper, lower, meeting = (
            (line - frame.upper[0]) @ frame.up for line in (frame.over, frame.below, frame.meeting)
        )
        self.above, self._below = height - self.along(upper), self.along(lower) - height
        self._over_meeting = height - self.along(meeting)
        self._opening = self.along(frame.opening)

    def along(self, values: FloatArray) -> FloatArray:
        """(h, w, ...) values (25, ...) of the columns of the eye, or of those beyond its corners, too."""
        rows = values.reshape(len(values), -1).T
        found = np.stack([np.interp(self._at, self._columns[len(values)], row) for row in rows], axis=-1)
        return found.reshape(*self._at.shape, *values.shape[1:])

    def over(self, skin: FloatArray, share: FloatArray) -> Pixels:
        """The picture with another skin (h, w, 3) by a share (h, w)."""
        mixed = self._part + share[..., None] * (skin - self._part)
        return np.rint(mixed).clip(0, 255).astype(np.uint8)

    def share_of_lid(self) -> FloatArray:
        """(h, w) 1 on a shut lid, falling to 0 above, below and beside it."""
        frame = self._frame
        ends = [
            1 - smoothstep(way / self.along(most), *FADE)
            for way, most in ((self.above, frame.top), (self._below, frame.under))
        ]
        outer, inner = (way * frame.scale for way in BESIDE)
        beside = np.maximum(-self._at / outer, (self._at - self._wide) / inner)
        found: FloatArray = np.minimum(*ends) * (1 - smoothstep(beside, 0.2, 1.0))
        return found

    def fold_shade(self, skin: FloatArray) -> FloatArray:
        """(h, w) share of the light that a lid lacks while it is folded: that of its fold above the lashes."""
        over = (self.above - self.along(self._frame.lashes)) / self._frame.scale
        inside = (self._at > 0) & (self._at < self._wide)
        fold = inside & (over > FOLD_AT[0]) & (over < FOLD_AT[1])
        if not fold.any():
            return np.zeros(fold.shape)
        lack = 1 - float(np.median(self._part[fold].mean(axis=1)) / max(np.median(skin[fold].mean(axis=1)), 1.0))
        from_top = smoothstep(1 - self.above / self.along(self._frame.top), *SHADED_ABOVE)
        found: FloatArray = from_top * (1 - smoothstep(-self.above / self._opening, *SHADED_BELOW))
        return float(np.clip(lack, 0.0, MOST_FOLD_SHADE)) * found

    def share_above_lashes(self) -> FloatArray:
        """(h, w) 1 above the lashes of the upper lid and at their ends, falling to 0 among them."""
        share = self._at / self._wide
        ends = 1 - smoothstep(np.minimum(share, 1 - share) / LASHES_TAPER)
        found: FloatArray = np.maximum(smoothstep(self.above / self.along(self._frame.lashes), *CHANGED), ends)
        return found

    def line_between(self) -> FloatArray:
        """(h, w) share of the light that is left by the shadow between shut lids, as dark as the lashes."""
        frame = self._frame
        away = np.maximum(np.maximum(self._over_meeting, self._below), 0.0)
        soft = max(LINE_LEAST_PX, LINE_WIDTH * frame.scale)
        share = self._at / self._wide
        taper = smoothstep(np.minimum(share, 1 - share) / LINE_TAPER)
        places = frame.upper[3:-3] + frame.up * soft * 0.5
        lashes = np.percentile(_blurred_at(self._pixels, places, 0.0).mean(axis=1), DARK_LASHES)
        darkness = float(np.clip(1 - lashes / max(self._light, 1.0), *LINE_DARKNESS))
        found: FloatArray = 1 - darkness * taper * np.exp(-((away / soft) ** 2))
        return found

    def skin(self) -> FloatArray:
        """(h, w, 3) skin of a shut lid: from the colours above the crease to those below the eye, with their grain."""
        frame = self._frame
        below = self._line(frame.below, -frame.under, UNDER_ROWS)
        above = self._line(frame.over, frame.top, TOP_ROWS, below)
        top, under = self.along(frame.top), self.along(frame.under)
        share = (top - self.above) / (top + self._opening + under)
        mixed = smoothstep(share, *LOWER_SHARE)[..., None]
        colours = (1 - mixed) * self.along(above) + mixed * self.along(below)
        of_lid = np.clip((top - self.above) / (top + self._opening), 0, 1)
        shade = 1 + ROUND_LIGHT * np.sin(np.pi * of_lid) - LASH_SHADE * smoothstep(of_lid, 0.75, 1.0)
        shade += LASH_SHADE * smoothstep(self._below / under, 0.0, 0.7)
        self._light = float(colours.mean())
        found: FloatArray = colours * shade[..., None] + self._grain()
        return found

    def _line(
        self, margin: FloatArray, ways: FloatArray, rows: tuple[float, ...], other: FloatArray | None = None
    ) -> FloatArray:
        """(C, 3) colours along a line beside a margin (C, 2), smooth, without what is unlike skin; or other ones."""
        frame = self._frame
        places = np.stack([margin + (row * ways)[:, None] * frame.up for row in rows])
        blur = COLOUR_BLUR * frame.scale
        lab = lab_at(self._pixels, places, blur)
        colours = _blurred_at(self._pixels, places, blur)
        usual = np.median(lab_at(self._pixels, frame.cheek, blur), axis=0)
        weights = np.exp(-(((lab - usual) / LIKE_SKIN) ** 2).sum(axis=-1) / 2) + LEAST_LIKE
        if other is not None and weights.mean() < LEAST_SHARE:
            return other
        at = np.linspace(-1, 1, len(margin))
        terms = np.stack([np.ones_like(at), at, at**2], axis=-1)
        every = np.tile(terms, (len(rows), 1))
        weighted = every * weights.reshape(-1, 1)
        system = weighted.T @ every + np.diag(RIDGE) * weights.sum()
        mean = (weights[..., None] * colours).sum(axis=(0, 1)) / weights.sum()
        factors = np.linalg.solve(system, weighted.T @ (colours.reshape(-1, 3) - mean))
        found: FloatArray = mean + terms @ factors
        return found

    def _grain(self) -> FloatArray:
        """(h, w, 3) what is fine in the skin below the eye."""
        frame = self._frame
        h, w = self._part.shape[:2]
        down, across = np.mgrid[:h, :w].astype(np.float64)
        places = (
            np.stack([across + self.corner[0], down + self.corner[1]], axis=-1) - GRAIN_FROM * frame.scale * frame.up
        )
        cheek = _blurred_at(self._pixels, places, 0.0)
        blur = max(1.0, GRAIN_BLUR * frame.scale)
        fine = cheek - gaussian_filter(cheek, (blur, blur, 0))
        most = MOST_GRAIN * float(np.median(np.abs(fine)))
        return np.clip(fine, -most, most)


def _blurred_at(pixels: Pixels, places: FloatArray, blur: float) -> FloatArray:
    """Colours (..., 3) of a blurred picture (H, W, 3) at places (..., 2)."""
    margin = int(np.ceil(4 * blur)) + 2
    last = np.array(pixels.shape[1::-1]) - 1
    low = np.clip(np.floor(places.reshape(-1, 2).min(axis=0)).astype(int) - margin, 0, last)
    high = np.clip(np.ceil(places.reshape(-1, 2).max(axis=0)).astype(int) + margin, low + 1, last + 1)
    part = pixels[low[1] : high[1], low[0] : high[0]].astype(np.float64)
    return colours_at(gaussian_filter(part, (blur, blur, 0)), places - low)


@dataclass(frozen=True, slots=True, eq=False)
class LidSheet:
    """Grid of places (N, 2) that shows a picture of lids, and the share (N,) of a blink at which each comes forward."""

    places: FloatArray
    come: FloatArray
    triangles: IntArray

    @classmethod
    def of(cls, rows: FloatArray, come: FloatArray) -> "LidSheet":
        """Rows (R, C, 2) from above, whose columns go from the outer corner of the eye to the inner one."""
        numbers = np.arange(rows.shape[0] * rows.shape[1]).reshape(rows.shape[:2])
        triangles = grid_triangles(numbers)
        is_mirrored = rows[0, 0, 0] > rows[0, -1, 0]
        return cls(rows.reshape(-1, 2), come.ravel(), triangles[:, ::-1] if is_mirrored else triangles)


def sheets_over_skin(frame: LidFrame) -> tuple[LidSheet, LidSheet]:
    """Sheets above the upper margin and below the lower one, and beside the corners of the eye."""
    sheets, sides = [], [*range(len(SIDE_GRID)), *range(-len(SIDE_GRID), 0)]
    for margin, ways, grid, (first, more) in (
        (frame.over, frame.top, ABOVE_GRID, ABOVE_COME),
        (frame.below, -frame.under, BELOW_GRID, BELOW_COME),
    ):
        rows = margin + (grid[:, None] * ways)[..., None] * frame.up
        come = np.tile(first + more * grid[:, None], len(margin))
        come[:, sides] = np.maximum(come[:, sides], SIDE_COMES)
        sheets.append(LidSheet.of(rows, come))
    return sheets[0], sheets[1]


def sheet_over_eye(frame: LidFrame) -> LidSheet:
    """Sheet in the opening of the eye and a little beyond it, which comes as the middle of the lashes passes."""
    down = EYE_GRID[:, None] * frame.opening
    overlap = EYE_OVERLAP * frame.scale
    down[0], down[-1] = np.minimum(down[0], -overlap), np.maximum(down[-1], frame.opening + overlap)
    rows = frame.upper - down[..., None] * frame.up
    come = (down + frame.lashes / 2) / ((1 - LID_MEETING) * frame.opening)
    return LidSheet.of(rows, np.clip(come, FIRST_COME, LAST_COME))
