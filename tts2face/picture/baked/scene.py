"""Scene of a face with baked light: everything that is constant over the frames of a clip, and one frame."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import eye_rotations, head_transform
from tts2face.face.pupils import DILATION, PUPIL_SHAPE
from tts2face.models.baked_light import LEAST_SIDE, N_BALL_TERMS, N_PAGES, N_TERMS, BakedLight, equal_limits
from tts2face.models.face import Face
from tts2face.models.light import Lit
from tts2face.numeric.arrays import Float32Array
from tts2face.numeric.kernels import BLOCK
from tts2face.picture.baked.coverage import refine_edges
from tts2face.picture.baked.cut_out import compose_over, find_covers
from tts2face.picture.baked.eyes import (
    CATCHLIGHT,
    CATCHLIGHT_LEVEL,
    CENTRE,
    KEY,
    LAMP_LIGHT,
    N_EYE_COLUMNS,
    PUPIL,
    TURN,
    colour_eyes,
)
from tts2face.picture.baked.interpolation import Cardinal, camera_weights, turn_weights, yaw_and_pitch_deg
from tts2face.picture.baked.modes import add_modes, pack_change, still_change
from tts2face.picture.baked.response import TermBuffers, add_responses, still_eyes
from tts2face.picture.baked.shading import (
    AT_RED,
    CHANGE_CODING,
    COLOUR_CODING,
    N_VALUES,
    add_texels,
    compose,
    evaluate,
    fetch,
    find_texels,
    lay_planes,
    list_fragments,
)
from tts2face.picture.baked.softening import blur_within
from tts2face.picture.baked.surface import TEXELS_A_PIXEL, LitSurface, build_surface, stack_pages
from tts2face.picture.baked.visibility import (
    N_SPAN_VALUES,
    NEAR,
    RED,
    X,
    fill_bands,
    find_bands,
    find_nearest,
    project,
    span_of_bands,
)
from tts2face.picture.camera import CameraMatrices
from tts2face.picture.catchlights import PLACE_RIGHT, UP
from tts2face.picture.options import Picture

BLINK_SHRINK = 0.075  # of the ball behind a shut lid, times its weight to the fourth power
BLINKS = ("eyeBlinkLeft", "eyeBlinkRight")  # of the face's eyes
BEHIND_SHARE = np.float32(0.8)  # of the nearness of what lies in openings
LEAST_OPENING_PX = 0.5  # of lips between which something is seen
BAND_PIXELS = 32_768
KEY_ASIDE = 0.3  # sine of the key lamp's angle from the line of sight, from which catchlights are all to its side


@dataclass(slots=True, eq=False)
class LitBuffers:
    """Buffers for drawing one picture at a time, by bands of rows of pixels; the kernels describe them."""

    band_rows: int
    table: Float32Array
    bands: NDArray[np.int16]
    nearest: NDArray[np.int64]
    spans: NDArray[np.int64]
    keys: NDArray[np.int64]
    triangle: NDArray[np.int32]
    place: Float32Array
    samples: NDArray[np.int32]
    pixels: NDArray[np.int32]
    plane_of: NDArray[np.int32]
    triangle_of: NDArray[np.int32]
    planes: Float32Array
    values: Float32Array
    texel: NDArray[np.int32]
    share: Float32Array
    corners: NDArray[np.int32]
    covers: Float32Array
    terms: TermBuffers
    light: Float32Array
    mouth: Float32Array
    balls: Float32Array
    change: Float32Array
    changed: NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class LitScene:
    """A face with baked light, its camera and its background (H, W, 3 or 4); built by `build_lit_scene`.

    ``wall`` (H, W, 3) lies behind a photographed person whose pages have a cover; what is seen between the lips of
    one is blurred by ``softness`` pixels.
    """

    face: Face
    lit: Lit
    picture: Picture
    background: NDArray[np.uint8]
    surface: LitSurface
    optics: CameraMatrices
    camera: Float32Array
    texels: NDArray[np.int32]
    texture_size: tuple[int, int]
    from_camera: Float32Array
    view: Float32Array
    bases: tuple[Float32Array, ...]
    answers: tuple[Any, ...]
    turns: Cardinal
    wall: NDArray[np.uint8] | None = None
    softness: float = 0.0

    def with_picture(self, picture: Picture) -> "LitScene":
        """The same scene with another number of samples a pixel."""
        optics = self.optics.scaled(picture.samples_per_side / self.picture.samples_per_side)
        return replace(self, picture=picture, optics=optics, camera=_camera(optics))

    def seen_by(self, optics: CameraMatrices) -> "LitScene":
        """The same scene from another camera."""
        from_camera = _from_camera(self.surface.light, optics.yaw_deg)
        return replace(self, optics=optics, camera=_camera(optics), from_camera=from_camera)

    def allocate_buffers(self) -> LitBuffers:
        """Buffers for pictures of this scene."""
        light = self.surface.light
        surface = self.surface
        picture = self.picture
        side, n_triangles = picture.samples_per_side, len(surface.triangles)
        rows = max(1, BAND_PIXELS // picture.width)
        n_fragments = picture.width * rows * side * side
        changed, _ = still_change(light.turn_side)
        return LitBuffers(
            band_rows=rows,
            table=surface.template.copy(),
            bands=np.zeros((n_triangles, 2), np.int16),
            spans=np.zeros(N_SPAN_VALUES, np.int64),
            keys=np.zeros((4, side * side), np.int64),
            nearest=np.zeros((rows * side, picture.width * side + BLOCK), np.int64),
            triangle=np.zeros(n_fragments, np.int32),
            place=np.zeros((2, n_fragments), np.float32),
            samples=np.zeros(n_fragments, np.int32),
            pixels=np.zeros(picture.width * rows + 1, np.int32),
            plane_of=np.zeros(n_triangles, np.int32),
            triangle_of=np.zeros(n_triangles, np.int32),
            planes=np.zeros((n_triangles, 3, N_VALUES), np.float32),
            values=np.zeros((N_VALUES, n_fragments), np.float32),
            texel=np.zeros(n_fragments, np.int32),
            share=np.zeros((2, n_fragments), np.float32),
            corners=np.zeros((4, n_fragments), np.int32),
            covers=np.zeros(n_fragments if self.wall is not None else 0, np.float32),
            terms=self.surface.terms.allocate_buffers(),
            light=np.zeros((3, len(light.rows)), np.float32),
            mouth=np.zeros((3, len(light.mouth_rows)), np.float32),
            balls=np.zeros((3, len(light.ball_rows)), np.float32),
            change=np.zeros((3, light.n_texels), np.float32),
            changed=changed,
        )

    def draw(self, weights: Float32Array, head: Float32Array, buffers: LitBuffers, pixels: NDArray[np.uint8]) -> None:
        """Draw the face with shape weights (K,) and a head pose (6,) over the background in `pixels`, in place."""
        surface, side = self.surface, self.picture.samples_per_side
        head = self.lit.bearable(head)
        points = self.deform(weights)
        self.light_pose(points, head, buffers)
        self.move(weights, head, points)
        optics = (self.optics.view.astype(np.float32), self.optics.lens.astype(np.float32))
        project(points, surface.source, *optics, buffers.table)
        buffers.table[surface.behind, NEAR] *= BEHIND_SHARE
        rows = buffers.band_rows
        order, ends = self._sort(len(pixels) * side, buffers)
        eyes = (self._eye_rows((points, weights, head)), surface.eye_texture, self.camera)
        light = (surface.light.sky, self.view)
        eye_bands = self._eye_bands(buffers)
        for number, first in enumerate(range(0, len(pixels), rows)):
            band = pixels[first : first + rows]
            nearest = buffers.nearest[: len(band) * side]
            near = order[ends[number - 1] if number else 0 : ends[number]]
            columns = find_nearest(buffers.table, surface.triangles, near, first * side, nearest, buffers.spans)
            place = (side, first * side, *columns)
            found = (buffers.triangle, *buffers.place)
            starts = buffers.pixels[: band.shape[0] * band.shape[1] + 1]
            count = list_fragments(nearest, place, surface.piece_of, (*found, buffers.samples, buffers.keys), starts)
            if count:
                self._colour(found, count, buffers)
                if eye_bands[0] <= number < eye_bands[1]:
                    shapes = (buffers.table, surface.triangles, surface.eye_of)
                    colour_eyes(found, count, shapes, eyes, light, buffers.values[AT_RED:])
                fragments, colours = (starts, buffers.samples, side * side), buffers.values[AT_RED:]
                if self.wall is None:
                    compose(*fragments, colours, band)
                else:
                    compose_over(fragments, colours, buffers.covers, self.wall[first : first + len(band)], band)
        if pixels.shape[2] == 4 and self.wall is None:
            refine_edges(buffers.table, surface.triangles, side, pixels)
        if self.softness:
            ring = np.einsum("lc,lcx->lx", surface.terms.ring_weights, points[surface.terms.ring])
            outline = self.optics.pixels(ring) / side
            half = len(outline) // 2  # the upper lip, and the lower one from its other corner
            if np.abs(outline[1:half] - outline[:half:-1])[:, 1].max() > LEAST_OPENING_PX:
                blur_within(outline, self.softness, pixels)

    def _sort(self, height: int, buffers: LitBuffers) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
        """Numbers of the triangles that are drawn, by bands of rows of samples, and the end of each band."""
        rows = (height, buffers.band_rows * self.picture.samples_per_side)
        counts = np.zeros(-(-rows[0] // rows[1]), np.int64)
        find_bands(buffers.table, self.surface.triangles, rows, buffers.bands, counts)
        ends = np.cumsum(counts)
        order = np.zeros(ends[-1], np.int32)
        fill_bands(buffers.bands, ends.copy(), order)
        return order, ends

    def _eye_bands(self, buffers: LitBuffers) -> tuple[int, int]:
        """The first of the bands that show eyeballs, and one past the last."""
        of_eyes = self.surface.of_eyes
        return span_of_bands(buffers.bands, of_eyes) if len(of_eyes) else (0, 0)

    def _colour(self, found: Any, count: int, buffers: LitBuffers) -> None:
        """Write the colours of fragments; on eyeballs, the light."""
        surface, values = self.surface, buffers.values
        numbers = (buffers.texel, buffers.plane_of, buffers.triangle_of)
        lay_planes(buffers.triangle, count, buffers.table, surface.triangles, numbers, buffers.planes)
        evaluate(buffers.texel, found[1], found[2], count, buffers.planes, values)
        read = [(self.texels, self.texture_size, COLOUR_CODING)]
        if surface.light.changes_in_texels:
            width = surface.light.turn_side
            read.append((buffers.changed, (width, len(buffers.changed) // width), CHANGE_CODING))
        for texels, size, coding in read:
            find_texels(values, count, size, buffers.texel, buffers.share)
            fetch(texels, size[0], buffers.texel, count, buffers.corners)
            add_texels(buffers.corners, buffers.share, count, coding, values)
            if self.wall is not None and coding is COLOUR_CODING:
                find_covers(buffers.corners, buffers.share, count, buffers.covers)

    def pose(self, weights: Float32Array, head: Float32Array) -> Float32Array:
        """(V, 3) vertices, mm; eyeballs look ahead, and are smaller behind shut lids."""
        points = self.deform(weights)
        self.move(weights, head, points)
        return points

    def deform(self, weights: Float32Array) -> Float32Array:
        """(V, 3) vertices, mm, of a head that has not moved, whose eyeballs look ahead."""
        points = self.surface.rig.deform(weights)
        still_eyes(self.face, points)
        return points

    def move(self, weights: Float32Array, head: Float32Array, points: Float32Array) -> None:
        """Move the head of vertices of `deform` in place; eyeballs shrink behind shut lids."""
        for number, eye in enumerate(self.face.eyes):
            share = 1 - BLINK_SHRINK * _weight(self.face, weights, BLINKS[number]) ** 4
            span = slice(eye.first, eye.first + eye.count)
            points[span] = eye.centre + share * (points[span] - eye.centre)
        self.surface.rig.sink_eyes(weights, points)
        self.surface.rig.move_head(head, points)

    def light_pose(self, points: Float32Array, head: Float32Array, buffers: LitBuffers) -> None:
        """Write the light of vertices of `deform` and a head pose into the table and the texels of change."""
        light, found = self.surface.light, buffers.terms
        self.surface.terms.update(points, found)
        of_balls = (N_TERMS - N_BALL_TERMS, len(light.rows))
        places = ((found.terms, (0, 0)), (found.mouth, (0, 0)), (found.terms, of_balls))
        at = 0
        for base, answer, (terms, first), out in zip(
            self.bases, self.answers, places, (buffers.light, buffers.mouth, buffers.balls), strict=True
        ):
            if not out.size:
                continue
            add_responses(base, answer, terms, first, out)
            if out is buffers.mouth and self.surface.mouth is not None:
                self.surface.mouth.hold(points, found.ring, found.table[-out.shape[1] :], out)
            for channel, values in enumerate(out):  # a transposed block is copied by threes
                buffers.table[at : at + out.shape[1], RED + channel] = values
            at += out.shape[1]
        if not light.changes_in_texels:
            return
        turn = self.turns.at(yaw_and_pitch_deg(head))
        modes = light.turn_modes.reshape(len(light.turn_modes), -1)
        add_modes(self.from_camera.reshape(-1), modes, turn @ light.turn_weights, buffers.change.reshape(-1))
        pack_change(buffers.change, buffers.changed)

    def _eye_rows(self, pose: tuple[Float32Array, Float32Array, Float32Array]) -> Float32Array:
        """Rows of the eyes for (vertices, shape weights, head pose)."""
        _, weights, head = pose
        rows = np.zeros((len(self.face.eyes), N_EYE_COLUMNS), np.float32)
        if not len(rows):
            return rows
        moved = head_transform(head, self.face.pivot)
        for row, eye, turn in zip(
            rows, self.face.eyes, eye_rotations(self.surface.rig.eye_turns, weights), strict=True
        ):
            row[CENTRE : CENTRE + 3] = moved[:, :3] @ eye.centre + moved[:, 3]
            row[TURN : TURN + 9] = (moved[:, :3] @ turn).ravel()
        painted, iris = self.surface.light.eye_edges
        pupil = min(painted * (1 + DILATION * _weight(self.face, weights, PUPIL_SHAPE)), 0.95 * iris)
        rows[:, PUPIL:KEY] = pupil, iris, painted / pupil, (iris - painted) / (iris - pupil)
        # a picture keeps the light that it has
        if len(lamps := self.surface.light.lamps):
            view = self.optics.view
            seen = self.surface.eyes.seen(pose, view)
            lamp = view[:, :3] @ lamps[0, :3] + view[:, 3] - seen[0].mean(axis=0)
            side = float(lamp[0] / np.sqrt(lamp.dot(lamp)) / KEY_ASIDE)
            spots = self.surface.eyes.catchlights(seen, min(max(side, -1.0), 1.0))
            spots[:, :UP], spots[:, UP:PLACE_RIGHT] = (
                spots[:, :UP] @ view[:, :3],
                spots[:, UP:PLACE_RIGHT] @ view[:, :3],
            )
            colour = lamps[0, LAMP_LIGHT:]
            rows[:, KEY:CATCHLIGHT], rows[:, CATCHLIGHT:] = CATCHLIGHT_LEVEL * colour / max(colour.max(), 1e-6), spots
        return rows


def _weight(face: Face, weights: Float32Array, name: str) -> float:
    return float(weights[face.shape_names.index(name)]) if name in face.shape_names else 0.0


def build_lit_scene(
    face: Face,
    lit: Lit,
    picture: Picture,
    optics: CameraMatrices,
    background: NDArray[np.uint8],
    covers: NDArray[np.uint8] | None = None,
) -> LitScene:
    """Scene of a face with light of its own, whose pages may have a cover (2, H, W), before a background (H, W, 3)."""
    side, surface = picture.samples_per_side, build_surface(face, lit)
    light, level = surface.light, _level(surface, optics, side)
    texels, size = stack_pages(light.pages, level, covers)
    return LitScene(
        face=face,
        lit=lit,
        picture=picture,
        background=background,
        surface=surface,
        optics=optics,
        camera=_camera(optics),
        texels=texels,
        texture_size=size,
        from_camera=_from_camera(light, picture.view.yaw_deg),
        view=light.view.astype(np.float32),
        bases=tuple(_planes(base) for base in (light.base, light.mouth_base, light.ball_base)),
        answers=(
            (light.responses, light.response_sizes, light.limits),
            (light.mouth_responses, light.mouth_sizes, light.mouth_limits),
            (light.ball_responses, light.ball_sizes, equal_limits(255.0, len(light.ball_rows))),
        ),
        turns=turn_weights(light.turns_deg),
        wall=None if covers is None else background,
    )


def _camera(optics: CameraMatrices) -> Float32Array:
    """Place, axes and lens of a camera, as kernels read them."""
    axes = optics.view[:, :3]
    place = -axes.T @ optics.view[:, 3]
    return np.concatenate([place, axes.ravel(), optics.lens[:3]]).astype(np.float32)


def _planes(base: NDArray[np.generic]) -> Float32Array:
    """(3, N) red, green and blue of a base (N, 3)."""
    return np.ascontiguousarray(base.T, np.float32)


def _level(surface: LitSurface, optics: CameraMatrices, side: int) -> int:
    """How often the texels are halved so that they are not much smaller than pixels, over the skin that is seen."""
    table = surface.template.copy()
    view, lens = optics.view.astype(np.float32), optics.lens.astype(np.float32)
    project(surface.rig.rest, surface.source, view, lens, table)
    corners = table[surface.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    seen = edges[:, 0, X] * edges[:, 1, X + 1] - edges[:, 0, X + 1] * edges[:, 1, X]
    height, width = surface.light.pages.shape[1:3]
    places = edges[:, :, 3:5] * np.array([width, 2 * height], np.float32)
    texels = np.abs(places[:, 0, 0] * places[:, 1, 1] - places[:, 0, 1] * places[:, 1, 0])
    ahead = (seen < 0) & (texels > 0)
    ratio = math.sqrt(float(texels[ahead].sum()) / max(float(-seen[ahead].sum()) / side**2, 1.0))
    most = int(math.log2(min(height, width) / LEAST_SIDE))
    return max(0, min(most, math.ceil(math.log2(max(ratio, 1e-3) / TEXELS_A_PIXEL))))


def _from_camera(light: BakedLight, yaw_deg: float) -> Float32Array:
    """(3, N) change of light in texels from a camera, at rest; before the head's turns."""
    change = np.zeros((3, light.n_texels), np.float32)
    weights = camera_weights(light.camera_yaws_deg).at(np.array([yaw_deg]))
    end = N_PAGES * light.turn_side**2
    change[:, end - light.camera_modes.shape[2] : end] = np.einsum(
        "y,ycn->cn", weights * light.camera_sizes, light.camera_modes.astype(np.float32)
    )
    return change
