"""A face in the path tracer, by bpy: its parts as meshes that take poses, lamps, a wall and cameras."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from corpus_tools.shipped.drawn.tiles import COLLAR, strand_places
from corpus_tools.shipped.film.look import Lamp, Look
from corpus_tools.shipped.film.materials import UNIT_MM, part_materials
from corpus_tools.shipped.film.shader import Shader, rgba
from tts2face.face.deformation import build_rig, eye_rotations, head_transform
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, IntArray, decode_srgb, smoothstep
from tts2face.picture.baked.scene import BLINK_SHRINK
from tts2face.picture.camera import camera_matrices
from tts2face.picture.camera_view import CameraView
from tts2face.picture.surface import weld_groups

SENSOR_MM = 36.0
FAR = 200.0
CORNEA_RADII = 1.35  # of the iris, angle from the gaze at which the cornea's bulge ends
EYES = ("sclera", "iris")
NO_SHADOW_TERMINATOR = ("hair", "skin")  # parts of large triangles


class FilmScene:
    """A face with its materials, lamps and wall.

    Parameters
    ----------
    masks
        Shares (V,) of the face's vertices by name: ``lips`` and ``inner``, the inside of the mouth.
    """

    def __init__(self, face: Face, look: Look, masks: Mapping[str, FloatArray]) -> None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.face, self.look = face, look
        self._rig, self._masks = build_rig(face), masks
        self._weld = weld_groups(face, self._rig)
        self._first = np.unique(self._weld, return_index=True)[1]
        self.materials = part_materials(look, face.textures[0], face.textures[2])
        self.objects: dict[str, tuple[Any, IntArray]] = {}  # by part, with the face's vertex of each of the mesh's
        self._add_parts()
        self.lamps = {name: _lamp(name, lamp) for name, lamp in look.lamps.items()}
        for name, lamp in look.lamps.items():
            self._link(name, lamp)
        self.pose(np.zeros(len(face.shape_names)), np.zeros(6))
        self._wall = _build_wall(look)
        self._camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        self._camera.data.clip_end, self._camera.data.sensor_width = FAR, SENSOR_MM
        bpy.context.collection.objects.link(self._camera)
        bpy.context.scene.camera = self._camera
        _settings(look)

    def _add_parts(self) -> None:
        face = self.face
        triangles: dict[str, list[Any]] = {}
        for part in face.parts:
            triangles.setdefault(part.name, []).append(face.triangles[part.first : part.first + part.count])
        joined = {name: np.concatenate(blocks).astype(np.int64) for name, blocks in triangles.items()}
        for name, corners in joined.items():
            if name not in EYES:
                self._add(name, corners, self.materials[name.split("_")[0]])
        balls = np.concatenate([joined[name] for name in EYES])
        for number, eye in enumerate(face.eyes):
            own = balls[((balls >= eye.first) & (balls < eye.first + eye.count)).all(axis=1)]
            self._add(f"ball{number}", own, self.materials["eye"])
            self._add(f"cornea{number}", own, self.materials["cornea"])
            self.objects[f"cornea{number}"][0].visible_shadow = False

    def _add(self, name: str, corners: IntArray, material: Any) -> None:
        """Add a part with triangles (F, 3); vertices at one place that move alike are one."""
        face = self.face
        rows, packed = np.unique(self._first[self._weld[corners]], return_inverse=True)
        faces = packed.reshape(-1, 3)
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(np.zeros((len(rows), 3)).tolist(), [], faces.tolist())
        mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
        uv = np.zeros((len(face.vertices), 2)) if face.uv is None else face.uv.astype(np.float64)
        flat = uv[corners.ravel()] * [1, -1] + [0, 1]
        mesh.uv_layers.new(name="uv").data.foreach_set("uv", flat.astype(np.float32).ravel())
        _set(mesh, "colour", "FLOAT_COLOR", _linear(face.colours[rows]))
        if name == "skin":
            for mask, values in self._masks.items():
                most = np.zeros(len(self._first))
                np.maximum.at(most, self._weld, values)
                _set(mesh, mask, "FLOAT", most[self._weld[rows]])
        elif name == "hair":
            _set(mesh, "strand", "FLOAT_VECTOR", strand_places(uv[rows]))
            _set(mesh, "tangent", "FLOAT_VECTOR", self._tangents(rows))
        elif name == "shirt":
            _set(mesh, "collar", "FLOAT", (uv[rows, 1] > COLLAR[2]).astype(np.float64))
        made = bpy.data.objects.new(name, mesh)
        bpy.context.collection.objects.link(made)
        mesh.materials.append(material)
        made.shadow_terminator_geometry_offset = 0.1 if name in NO_SHADOW_TERMINATOR else 0.0
        self.objects[name] = made, rows

    def _tangents(self, rows: IntArray) -> FloatArray:
        tangents = self.face.tangents
        return np.zeros((len(rows), 3)) if tangents is None else tangents[rows].astype(np.float64)

    def pose(self, weights: NDArray[np.floating], head: NDArray[np.floating], *, turns_eyes: bool = True) -> None:
        """Move all parts; with still eyes the balls look ahead, for the light of their sockets."""
        weights, head = np.asarray(weights, np.float32), np.asarray(head, np.float32)
        vertices = np.asarray(self._rig.pose(weights, head), np.float64)
        moved = np.asarray(head_transform(head, self._rig.pivot), np.float64)
        gaze = [moved[:, :3] @ turn for turn in np.asarray(eye_rotations(self._rig.eye_turns, weights), np.float64)]
        for name, (made, rows) in self.objects.items():
            if name.startswith(("ball", "cornea")):
                number = int(name[-1])
                places = self._eyeball(number, name, vertices, (moved, gaze[number]), weights, turns_eyes)[rows]
            else:
                places = vertices[rows]
            made.data.vertices.foreach_set("co", (places / UNIT_MM).astype(np.float32).ravel())
            if name == "hair":
                turned = self._tangents(rows) @ moved[:, :3].T
                made.data.attributes["tangent"].data.foreach_set("vector", turned.astype(np.float32).ravel())
            made.data.update()
        turn = np.vstack([np.column_stack([moved[:, :3], moved[:, 3] / UNIT_MM]), [0, 0, 0, 1]])
        for name, lamp in self.look.lamps.items():
            if lamp.follows_head:
                self.lamps[name].matrix_basis = Matrix((turn @ turn).tolist()) @ _placed(lamp)

    def _eyeball(
        self,
        number: int,
        name: str,
        vertices: FloatArray,
        turns: tuple[FloatArray, FloatArray],
        weights: NDArray[np.float32],
        turns_eyes: bool,
    ) -> FloatArray:
        """(V, 3) vertices with those of one eyeball, or of the cornea over it, in place."""
        eye, (moved, gaze) = self.face.eyes[number], turns
        span = slice(eye.first, eye.first + eye.count)
        centre = moved[:, :3] @ eye.centre.astype(np.float64) + moved[:, 3]
        blink = weights[self.face.shape_names.index(("eyeBlinkLeft", "eyeBlinkRight")[number])]
        ball = (vertices[span] - centre) @ gaze * (1 - BLINK_SHRINK * blink**4)
        if name.startswith("cornea"):
            distance = np.linalg.norm(ball, axis=1)
            off = np.arccos(np.clip(ball[:, 2] / distance, -1, 1))
            own = self.look.eye
            iris = float(off[np.argsort(off)[len(off) // 2]])
            bulge = 1 + own.height + own.bulge * (1 - smoothstep(off / iris, 0.0, CORNEA_RADII))
            ball = ball * (np.maximum(distance, np.median(distance) * bulge) / distance)[:, None]
        placed = vertices.copy()
        placed[span] = ball @ (gaze if turns_eyes else moved[:, :3]).T + centre
        return placed

    def paint_hair(self, colours: NDArray[np.uint8]) -> None:
        """Give the hair colours (N, 3), sRGB, of its vertices, which are the face's last N."""
        made, rows = self.objects["hair"]
        every = self.face.colours.copy()
        every[self._first[self._weld[-len(colours) :]]] = colours
        values = _linear(every[rows])
        made.data.attributes["colour"].data.foreach_set("color", values.astype(np.float32).ravel())
        made.data.update()

    def _link(self, name: str, lamp: Lamp) -> None:
        """Let a lamp light some parts only."""
        if lamp.parts:
            receivers = bpy.data.collections.new(name)
            bpy.context.scene.collection.children.link(receivers)
            for part, (made, _) in self.objects.items():
                if part.split("_")[0].rstrip("01") in lamp.parts:
                    receivers.objects.link(made)
            self.lamps[name].light_linking.receiver_collection = receivers

    def mirrored_lamps(self) -> NDArray[np.float32]:
        """(L, 17) lamps that light the eyes, as `tts2face.models.baked_light` describes them; heads' own are last."""
        rows = []
        for lamp in sorted(self.look.lamps.values(), key=lambda light: light.follows_head):
            if lamp.parts and "cornea" not in lamp.parts:
                continue
            place = np.array(_placed(lamp))
            radiance = np.array(lamp.colour) * lamp.watts / (np.pi * lamp.width * lamp.height)
            size = (lamp.width * UNIT_MM / 2, lamp.height * UNIT_MM / 2)
            rows.append(np.concatenate([place[:3, 3] * UNIT_MM, *place[:3, :2].T, -place[:3, 2], size, radiance]))
        return np.array(rows, np.float32)

    def look_from(self, view: CameraView, side: int) -> None:
        """Place the camera as the renderer does, for square pictures of a side in pixels."""
        camera = camera_matrices(view, self.face, (side, side))
        axes = np.asarray(camera.view[:, :3], np.float64)
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([axes[0], -axes[1], -axes[2]], axis=1)
        matrix[:3, 3] = -axes.T @ camera.view[:, 3] / UNIT_MM
        self._camera.matrix_world = Matrix(matrix.tolist())
        self._camera.data.angle = 2 * np.arctan(side / 2 / camera.lens[0])
        render = bpy.context.scene.render
        render.resolution_x = render.resolution_y = side
        render.resolution_percentage = 100

    def render(
        self, path: Path, samples: int, *, has_wall: bool = True, window: NDArray[np.floating] | None = None
    ) -> None:
        """Write a picture; without its wall it has a transparent background.

        Outside a window, two corners (2, 2) in shares of the picture from its upper left one, it is transparent, too.
        """
        scene = bpy.context.scene
        scene.render.use_border = window is not None
        if window is not None:
            border = scene.render
            (border.border_min_x, top), (border.border_max_x, bottom) = np.clip(window, 0, 1).tolist()
            border.border_min_y, border.border_max_y = 1 - bottom, 1 - top
        for made in self._wall:
            made.hide_render = not has_wall
        scene.render.film_transparent = not has_wall
        scene.render.image_settings.color_mode = "RGB" if has_wall else "RGBA"
        scene.cycles.samples, scene.render.filepath = samples, str(path.resolve())
        bpy.ops.render.render(write_still=True)

    def render_wall(self, path: Path, samples: int) -> None:
        """Write a picture of the wall alone, out of focus."""
        focus = self._camera.data.dof
        focus.use_dof, focus.focus_distance, focus.aperture_fstop = True, 8.0, self.look.wall.f_stop
        for made, _ in self.objects.values():
            made.hide_render = True
        self.render(path, samples)
        for made, _ in self.objects.values():
            made.hide_render = False
        focus.use_dof = False


def _linear(colours: NDArray[np.uint8]) -> FloatArray:
    """(N, 4) linear light of colours (N, 3), sRGB."""
    return np.column_stack([decode_srgb(colours / 255.0), np.ones(len(colours))])


def _set(mesh: Any, name: str, kind: str, values: FloatArray) -> None:
    """Give the vertices of a mesh values."""
    field = {"FLOAT": "value", "FLOAT_VECTOR": "vector", "FLOAT_COLOR": "color"}[kind]
    mesh.attributes.new(name, kind, "POINT").data.foreach_set(field, values.astype(np.float32).ravel())


def _lamp(name: str, lamp: Lamp) -> Any:
    data = bpy.data.lights.new(name, "AREA")
    data.shape, data.size, data.size_y = "RECTANGLE", lamp.width, lamp.height
    data.energy, data.color = lamp.watts, lamp.colour
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    made.matrix_basis = _placed(lamp)
    return made


def _placed(lamp: Lamp) -> Matrix:
    """(4, 4) place of a lamp and its direction, before the head turns."""
    place = Vector(lamp.place)
    return Matrix.LocRotScale(place, (Vector(lamp.target) - place).to_track_quat("-Z", "Y"), None)


def _build_wall(look: Look) -> list[Any]:
    """The wall, its boxes and its lamps."""
    wall = look.wall
    shader = Shader("wall")
    places = shader.node("TexCoord").outputs["Object"]
    darker, lighter = (np.clip(np.array(wall.colour) * share, 0, 1).tolist() for share in (0.85, 1.15))
    colour = shader.mix(rgba(darker), rgba(lighter), shader.noise(places, (0.5,) * 3, 3.0))
    surface = shader.principled(Base_Color=colour, Roughness=0.8, Specular_IOR_Level=0.2)
    z = wall.depth
    behind = [(-40.0, -20.0, z), (40.0, -20.0, z), (40.0, 30.0, z), (-40.0, 30.0, z)]
    made = [_mesh("wall", behind, [(0, 1, 2, 3)], shader.finished(surface.outputs[0]))]
    for number, box in enumerate(wall.boxes):
        shader = Shader(f"box {number}")
        if box.glow:
            surface = shader.node("Emission", Color=rgba(box.colour), Strength=box.glow)
        else:
            surface = shader.principled(Base_Color=rgba(box.colour), Roughness=0.7)
        (a, b, c), (d, e, f) = box.low, box.high
        corners = [(a, b, c), (d, b, c), (d, e, c), (a, e, c), (a, b, f), (d, b, f), (d, e, f), (a, e, f)]
        sides = [(4, 5, 6, 7), (1, 0, 3, 2), (0, 4, 7, 3), (5, 1, 2, 6), (7, 6, 2, 3), (0, 1, 5, 4)]
        made.append(_mesh(f"box {number}", corners, sides, shader.finished(surface.outputs[0])))
    return [*made, *(_lamp(f"wall lamp {number}", lamp) for number, lamp in enumerate(wall.lamps))]


def _mesh(name: str, corners: Sequence[Sequence[float]], sides: Sequence[Sequence[int]], material: Any) -> Any:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], sides)
    mesh.materials.append(material)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(made)
    return made


def _settings(look: Look) -> None:
    """Sky, path tracer and view transform."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs[0].default_value, background.inputs[1].default_value = (*look.sky, 1), look.sky_strength
    render, cycles, view = scene.render, scene.cycles, scene.view_settings
    render.engine, render.use_persistent_data = "CYCLES", True
    render.image_settings.file_format = "PNG"
    cycles.device, cycles.max_bounces, cycles.transparent_max_bounces = "CPU", 6, 8
    cycles.use_denoising, cycles.denoiser = True, "OPENIMAGEDENOISE"
    cycles.use_adaptive_sampling, cycles.adaptive_threshold = True, 0.02
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.sample_clamp_indirect = 4.0
    view.view_transform, view.look, view.exposure = "AgX", "AgX - Medium High Contrast", look.exposure
