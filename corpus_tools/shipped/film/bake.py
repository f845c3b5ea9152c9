"""Baking of a scene's light: into texels, denoised, or into vertices. Needs bpy.

Baking of a character's poses. Needs bpy.
"""

import math
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from corpus_tools.shipped.drawn.fields import HAIR_BOTTOM
from corpus_tools.shipped.drawn.hair import OtherHair
from corpus_tools.shipped.film.materials import white
from corpus_tools.shipped.film.poses import CAMERA_YAWS_DEG, FAR, FRONT, MOUTH, SKIN, LitPose, PoseLight
from corpus_tools.shipped.film.scene import FilmScene
from tts2face.models.view_transform import table_levels

Float32Array = NDArray[np.float32]

ATTRIBUTE = "baked"
MARGIN_PX = 4


class TexelBake:
    """Bakes parts in the layout of their texture into squares of ``side`` texels, denoised with the parts' colours."""

    def __init__(self, scene: FilmScene, parts: Sequence[str], side: int) -> None:
        self._objects = [scene.objects[part][0] for part in parts]
        self._colours, self._light = _Picture("colours", side), _Picture("light", side)
        with _target(self._objects, self._colours), _settings("IMAGE_TEXTURES", 1):
            _bake(self._objects, "DIFFUSE", pass_filter={"COLOR"})

    def light(self, samples: int) -> Float32Array:
        """(side, side, 3) linear light in the scene's pose, seen by its camera."""
        with _target(self._objects, self._light), _settings("IMAGE_TEXTURES", samples):
            _bake(self._objects, "COMBINED")
        return _denoised(self._light, self._colours)


def bake_vertices(scene: FilmScene, parts: Sequence[str], samples: int) -> dict[str, Float32Array]:
    """(N, 3) linear light of the vertices of each part's mesh; that of eyeballs without their colours."""
    objects = [scene.objects[part][0] for part in parts]
    for made in objects:
        attributes = made.data.color_attributes
        if ATTRIBUTE not in attributes:
            attributes.new(ATTRIBUTE, "FLOAT_COLOR", "POINT")
        attributes.active_color = attributes[ATTRIBUTE]
        attributes.render_color_index = [one.name for one in attributes].index(ATTRIBUTE)
    with _settings("VERTEX_COLORS", samples), _white_eyes(scene):
        _bake(objects, "COMBINED")
    found = {}
    for part, made in zip(parts, objects, strict=True):
        values = np.zeros(4 * len(made.data.vertices), np.float32)
        made.data.color_attributes[ATTRIBUTE].data.foreach_get("color", values)
        found[part] = values.reshape(-1, 4)[:, :3].copy()
    return found


def displayed(light: Float32Array) -> Float32Array:
    """(N, 3) colours on a display, 0..1, of linear light (N, 3), by the scene's view transform."""
    width = 1024
    height = -(-len(light) // width)
    pixels = np.zeros((height * width, 4), np.float32)
    pixels[: len(light), :3], pixels[:, 3] = light, 1.0
    scene = bpy.context.scene
    image = bpy.data.images.new("displayed", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    settings = scene.render.image_settings
    kept = settings.file_format, settings.color_depth, settings.color_mode
    settings.file_format, settings.color_mode, settings.color_depth = "TIFF", "RGB", "16"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "displayed.tif"
        image.save_render(str(path), scene=scene)
        read = bpy.data.images.load(str(path))
        read.colorspace_settings.name = "Non-Color"
        found = np.zeros(4 * width * height, np.float32)
        read.pixels.foreach_get(found)
    settings.file_format, settings.color_depth, settings.color_mode = kept
    for one in (image, read):
        bpy.data.images.remove(one)
    return found.reshape(-1, 4)[: len(light), :3].copy()


def view_table() -> Float32Array:
    """(33, 33, 33, 3) view transform of linear light at `table_levels` of red, green and blue."""
    levels = table_levels()
    grid = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1)
    return displayed(grid.reshape(-1, 3).astype(np.float32)).reshape(*grid.shape)


class _Picture:
    """A picture in float that is baked into."""

    def __init__(self, name: str, side: int) -> None:
        self.side, self.image = side, bpy.data.images.new(name, side, side, float_buffer=True)

    def read(self) -> Float32Array:
        """(side, side, 3) pixels, the first row on top."""
        values = np.zeros(4 * self.side**2, np.float32)
        self.image.pixels.foreach_get(values)
        return values.reshape(self.side, self.side, 4)[::-1, :, :3].copy()


@contextmanager
def _target(objects: Sequence[Any], picture: _Picture) -> Iterator[None]:
    """Bake into a picture: it is the active one of the objects' materials meanwhile."""
    trees = [made.data.materials[0].node_tree for made in objects]
    nodes = [tree.nodes.new("ShaderNodeTexImage") for tree in trees]
    for tree, node in zip(trees, nodes, strict=True):
        node.image = picture.image
        tree.nodes.active = node
    try:
        yield
    finally:
        for tree, node in zip(trees, nodes, strict=True):
            tree.nodes.remove(node)


@contextmanager
def _settings(target: str, samples: int) -> Iterator[None]:
    """Settings of the path tracer for a bake seen from the camera."""
    scene = bpy.context.scene
    cycles, bake = scene.cycles, scene.render.bake
    kept = cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = samples, False, False
    bake.target, bake.view_from, bake.use_clear, bake.margin = target, "ACTIVE_CAMERA", True, MARGIN_PX
    try:
        yield
    finally:
        cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = kept


@contextmanager
def _white_eyes(scene: FilmScene) -> Iterator[None]:
    """Eyeballs in white, without corneas: their light alone is baked."""
    plain = white()
    for name, (made, _) in scene.objects.items():
        if name.startswith("ball"):
            made.data.materials[0] = plain
        made.hide_render = name.startswith("cornea")
    try:
        yield
    finally:
        for name, (made, _) in scene.objects.items():
            if name.startswith("ball"):
                made.data.materials[0] = scene.materials["eye"]
            made.hide_render = False


def _bake(objects: Sequence[Any], kind: str, **options: Any) -> None:
    for made in bpy.context.selected_objects:
        made.select_set(False)
    for made in objects:
        made.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.bake(type=kind, **options)


def _denoised(light: _Picture, colours: _Picture) -> Float32Array:
    """A picture's light after Open Image Denoise, by the compositor."""
    scene = bpy.context.scene
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    sources = []
    for picture in (light, colours):
        node = tree.nodes.new("CompositorNodeImage")
        node.image = picture.image
        sources.append(node.outputs[0])
    denoise, composite = tree.nodes.new("CompositorNodeDenoise"), tree.nodes.new("CompositorNodeComposite")
    denoise.use_hdr = True
    tree.links.new(sources[0], denoise.inputs["Image"])
    tree.links.new(sources[1], denoise.inputs["Albedo"])
    tree.links.new(denoise.outputs[0], composite.inputs[0])
    render, settings = scene.render, scene.render.image_settings
    kept = render.resolution_x, render.resolution_y, settings.file_format, settings.color_depth, settings.color_mode
    render.resolution_x = render.resolution_y = light.side
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    with tempfile.TemporaryDirectory() as folder:
        render.filepath = str(Path(folder) / "denoised.exr")
        bpy.ops.render.render(write_still=True)
        read = _Picture.__new__(_Picture)
        read.side, read.image = light.side, bpy.data.images.load(render.filepath)
        found = read.read()
        bpy.data.images.remove(read.image)
    render.resolution_x, render.resolution_y, settings.file_format, settings.color_depth, settings.color_mode = kept
    scene.use_nodes = False
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """Sides of the maps in texels, and samples a texel or corner of each kind of bake.

    Teeth of 8 samples have coloured stripes.
    """

    side: int = 1024
    pose_side: int = 384
    rest: int = 16
    pose: int = 5
    turn: int = 16
    reference: int = 40  # from which changes are counted, in all of which its noise is
    mouth: int = 28
    small: int = 8
    wall: int = 64


HAIRCUT = Effort(pose_side=256, rest=12, turn=24, reference=64)  # of the light of another haircut at rest and in turns


def bake_poses(
    scene: FilmScene,
    poses: Sequence[LitPose],
    other_hair: OtherHair,
    effort: Effort,
    report: Callable[[str], None],
) -> PoseLight:
    """Bake the poses, the first of which is at rest, and the hair in other colours.

    `report` gets the name of each step.
    """
    scene.look_from(FRONT, effort.side)
    _pose(scene, poses[0])
    report("texels at rest")
    rest = [_displayed(TexelBake(scene, parts, effort.side).light(effort.rest)) for parts in (SKIN, FAR)]
    far_other = _bake_other_hair(scene, other_hair.vertices, effort)
    bakes = [TexelBake(scene, parts, effort.pose_side) for parts in (SKIN, FAR)]
    small = _small_parts(scene)
    light: tuple[list[Float32Array], ...] = ([], [], [], [])
    for pose in poses:
        report(pose.name)
        _pose(scene, pose)
        at_rest, turned = pose is poses[0], pose is poses[0] or bool(pose.head.any())
        samples = effort.reference if at_rest else effort.turn if turned else effort.pose
        light[0].append(_displayed(bakes[0].light(samples)))
        if turned:
            light[1].append(_displayed(bakes[1].light(samples)))
        light[2].append(light[2][0] if turned and not at_rest else _small_light(scene, small, effort))
    _pose(scene, poses[0])
    for yaw in CAMERA_YAWS_DEG:
        report(f"camera {yaw}")
        scene.look_from(replace(FRONT, yaw_deg=yaw), effort.side)
        light[1].append(_displayed(bakes[1].light(effort.turn)))
        light[3].append(_displayed(bakes[0].light(effort.turn)))
    scene.look_from(FRONT, effort.side)
    return PoseLight(
        names=np.array([pose.name for pose in poses]),
        weights=np.stack([pose.weights for pose in poses]),
        heads=np.stack([pose.head for pose in poses]),
        skin_rest=rest[0],
        far_rest=rest[1],
        skin=np.stack(light[0]),
        far=np.stack(light[1]),
        skin_from=np.stack(light[3]),
        far_other=far_other,
        other_colours=other_hair.colours,
        other_vertices=other_hair.vertices,
        rows=np.concatenate([scene.objects[part][1] for part in small]),
        small=np.stack(light[2]),
        view=view_table(),
        lamps=scene.mirrored_lamps(),
        backdrop=bake_backdrop(scene, effort),
    )


def _bake_other_hair(scene: FilmScene, colours: NDArray[np.uint8], effort: Effort) -> Float32Array:
    """(C, h, s, 3) light of the hair in colours (C, N, 3) of its vertices."""
    side, own = effort.side // 2, scene.face.colours[-colours.shape[1] :]
    found = []
    for other in colours:
        scene.paint_hair(other)
        found.append(_displayed(TexelBake(scene, FAR, side).light(effort.rest))[: math.ceil(HAIR_BOTTOM * side)])
    scene.paint_hair(own)
    return np.stack(found)


def bake_backdrop(scene: FilmScene, effort: Effort) -> NDArray[np.uint8]:
    """(S, S, 3) picture of the wall from in front."""
    scene.look_from(FRONT, effort.pose_side)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wall.png"
        scene.render_wall(path, effort.wall)
        with Image.open(path) as picture:
            return np.array(picture.convert("RGB"))


def _pose(scene: FilmScene, pose: LitPose) -> None:
    scene.pose(pose.weights, pose.head, turns_eyes=False)


def _small_parts(scene: FilmScene) -> list[str]:
    return [name for name in scene.objects if name not in (*SKIN, *FAR) and not name.startswith("cornea")]


def _small_light(scene: FilmScene, small: Sequence[str], effort: Effort) -> Float32Array:
    """(N, 3) light of the vertices of the small parts."""
    of_mouth = [name for name in small if name.startswith(MOUTH)]
    others = [name for name in small if name not in of_mouth]
    found = bake_vertices(scene, of_mouth, effort.mouth) | bake_vertices(scene, others, effort.small)
    return np.concatenate([found[name] if name.startswith("ball") else displayed(found[name]) for name in small])


def _displayed(light: Float32Array) -> Float32Array:
    return displayed(light.reshape(-1, 3)).reshape(light.shape)
