"""Baking of a scene's light into texels, denoised, or into vertices, which needs bpy."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from corpus_tools.shipped.film.materials import white
from corpus_tools.shipped.film.scene import FilmScene
from tts2face.models.view_transform import table_levels
from tts2face.numeric.arrays import Float32Array

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
        attributes.render_color_index = [attribute.name for attribute in attributes].index(ATTRIBUTE)
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
    for item in (image, read):
        bpy.data.images.remove(item)
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
