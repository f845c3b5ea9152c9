"""Materials of a character's parts for the path tracer, which need bpy."""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from corpus_tools.shipped.film.look import WHITE, ClothLook, EyeLook, HairLook, Look, SkinLook
from corpus_tools.shipped.film.shader import Shader, rgba
from tts2face.models.face import Texture

UNIT_MM = 100.0  # of the scene: a decimetre
TAU = 6.2832
# Patches of skin with more blood, and with more pigment: scale of the noise, factor of the colour.
MOTTLE = ((7.0, (0.97, 0.84, 0.82)), (40.0, (0.95, 0.90, 0.86)))


def part_materials(look: Look, skin: Texture, eye: Texture) -> dict[str, Any]:
    """A material for each kind of part; that of eyeballs is ``eye``, with ``cornea`` over it."""
    made: dict[str, Callable[[], Any]] = {
        "skin": lambda: _skin(look.skin, _image("skin", skin)),
        "hair": lambda: _hair(look.hair),
        "shirt": lambda: _cloth(look.cloth),
        "eye": lambda: _eye(look.eye, _image("eye", eye)),
        "cornea": _cornea,
        "teeth": lambda: _plain("teeth", 0.8, Roughness=0.14, Subsurface_Weight=0.5, Coat_Weight=0.3),
        "gums": lambda: _plain("gums", 1.5, Roughness=0.2, Subsurface_Weight=0.6, Coat_Weight=0.4),
        "tongue": lambda: _plain("tongue", 2.0, Roughness=0.32, Subsurface_Weight=0.8, Coat_Weight=0.25),
        "wet": lambda: _plain("wet", Roughness=0.06, Specular_IOR_Level=0.9),
        "brows": lambda: _plain("brows", Roughness=0.55, Specular_IOR_Level=0.25, Sheen_Weight=0.1),
        "lashes": lambda: _plain("lashes", Roughness=0.45, Specular_IOR_Level=0.3),
        "glasses": lambda: _plain("glasses", Roughness=0.25, Metallic=0.8),
        "stud": lambda: _plain("stud", Roughness=0.18, Metallic=1.0),
    }
    return {name: make() for name, make in made.items()}


def white() -> Any:
    """Material in which eyeballs are baked: their light alone."""
    shader = Shader("white")
    surface = shader.principled(Base_Color=rgba((WHITE,) * 3), Roughness=0.4, Specular_IOR_Level=0.0)
    surface.inputs["Subsurface Weight"].default_value = 0.2
    surface.inputs["Subsurface Scale"].default_value = 1 / UNIT_MM
    return shader.finished(surface.outputs[0])


def _image(name: str, texture: Texture) -> Any:
    """A texture of the face as an image of the scene."""
    height, width = texture.pixels.shape[:2]
    image = bpy.data.images.new(name, width, height)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[:, :, :3] = texture.pixels[::-1] / 255.0
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def _skin(look: SkinLook, image: Any) -> Any:
    shader = Shader("skin")
    painted = shader.node("TexImage", image=image, interpolation="Cubic").outputs["Color"]
    colour = shader.mix(painted, (*look.gain, 1.0), 1.0, "MULTIPLY")
    colour = shader.node("HueSaturation", Color=colour, Saturation=look.saturation).outputs[0]
    places = shader.node("TexCoord").outputs["Object"]
    for scale, factors in MOTTLE:
        tint = tuple(1 + look.mottle * (factor - 1) for factor in factors)
        spots = shader.scaled(shader.noise(places, (scale,) * 3, 3.0), 0.45, 0.75, 0, 1)
        colour = shader.mix(colour, (*tint, 1.0), spots, "MULTIPLY")
    lips, inner = shader.attribute("lips"), shader.attribute("inner")
    colour = shader.mix(colour, rgba(look.lip_colour), shader.scaled(lips, 0, 1, 0, look.lip_share))
    colour = shader.mix(colour, rgba(look.inner_colour), inner)
    grain = shader.noise(shader.node("TexCoord").outputs["Object"], (look.pores,) * 3, 3.0)
    is_front = shader.math("SUBTRACT", 1.0, shader.node("NewGeometry").outputs["Backfacing"])
    surface = shader.principled(
        Base_Color=colour,
        Roughness=shader.scaled(lips, 0, 1, look.roughness, look.lip_roughness),
        Specular_IOR_Level=shader.scaled(inner, 0, 1, look.specular, 0.25),
        Subsurface_Weight=is_front,  # folds of the lids, seen from behind, turn green with it
        Subsurface_Radius=look.scatter,
        Subsurface_Scale=look.scatter_mm / UNIT_MM,
        Sheen_Weight=look.sheen,
        Sheen_Roughness=0.4,
        Sheen_Tint=(1.0, 0.9, 0.85, 1.0),
        Normal=shader.bumped(grain, look.bump, 0.006),
    )
    return shader.finished(surface.outputs[0])


def _hair(look: HairLook) -> Any:
    shader = Shader("hair")
    place = shader.attribute("strand", "Vector")  # along and across the lock, and its number
    streak = shader.noise(place, (1.1, look.strands, 7.3), 3.0, 0.55)
    tone = shader.noise(place, (0.7, 0.27 * look.strands, 3.1), 2.0)
    colour = shader.mix(shader.attribute("colour", "Color"), (*look.gain, 1.0), 1.0, "MULTIPLY")
    more, less, vary = look.streaks, 1 - look.streaks, look.variation
    light = shader.scaled(streak, 0.42, 0.72, 0, 1)
    colour = shader.mix(colour, (1 + more, 1 + 0.75 * more, 1 + 0.5 * more, 1.0), light, "MULTIPLY")
    colour = shader.mix(colour, (less, less, less, 1.0), shader.scaled(streak, 0.55, 0.3, 0, 1), "MULTIPLY")
    warm = (1 + vary, 1 + 0.55 * vary, 1 + 0.3 * vary, 1.0)
    colour = shader.mix(colour, warm, shader.scaled(tone, 0.45, 0.7, 0, 1), "MULTIPLY")
    surface = shader.principled(
        Base_Color=colour,
        Roughness=shader.scaled(streak, 0.3, 0.7, look.roughness + 0.06, look.roughness - 0.06),
        Specular_IOR_Level=look.specular,
        Specular_Tint=(*look.specular_tint, 1.0),
        Anisotropic=look.anisotropy,
        Anisotropic_Rotation=0.25,
        Tangent=shader.attribute("tangent", "Vector"),
        Sheen_Weight=look.sheen,
        Sheen_Roughness=0.4,
        Sheen_Tint=(*look.sheen_tint, 1.0),
        Normal=shader.bumped(streak, look.bump, 0.02),
    )
    return shader.finished(surface.outputs[0])


def _cloth(look: ClothLook) -> Any:
    shader = Shader("cloth")
    places = shader.node("TexCoord").outputs["Object"]
    fluff = shader.noise(places, (46.0,) * 3, 5.0, 0.7)
    collar = shader.attribute("collar")
    around = shader.node("SeparateXYZ", Vector=shader.node("UVMap", uv_map="uv").outputs[0]).outputs[0]
    across = shader.node("SeparateXYZ", Vector=places).outputs[0]
    ribs = shader.math("SINE", shader.math("MULTIPLY", around, TAU * look.ribs))
    columns = shader.math("SINE", shader.math("MULTIPLY", across, TAU * UNIT_MM / look.column_mm))
    below = shader.math("MULTIPLY", columns, shader.math("SUBTRACT", 0.5, shader.math("MULTIPLY", collar, 0.5)))
    knit = shader.math("ADD", shader.math("MULTIPLY", ribs, collar), below)
    height = shader.math("ADD", shader.math("MULTIPLY", fluff, 0.9), shader.math("MULTIPLY", knit, 0.45))
    groove = shader.scaled(height, 0.75, -0.1, 0, look.depth)
    surface = shader.principled(
        Base_Color=shader.mix(shader.attribute("colour", "Color"), (*look.groove, 1.0), groove, "MULTIPLY"),
        Roughness=look.roughness,
        Specular_IOR_Level=0.25,
        Sheen_Weight=look.sheen,
        Sheen_Roughness=0.4,
        Sheen_Tint=(*look.sheen_tint, 1.0),
        Normal=shader.bumped(height, look.bump, 0.03),
    )
    return shader.finished(surface.outputs[0])


def _eye(look: EyeLook, image: Any) -> Any:
    shader = Shader("eye")
    painted = shader.node("TexImage", image=image, interpolation="Cubic").outputs["Color"]
    surface = shader.principled(
        Base_Color=shader.mix(painted, (look.gain, look.gain, look.gain, 1.0), 1.0, "MULTIPLY"),
        Roughness=look.roughness,
        Specular_IOR_Level=0.1,
        Subsurface_Weight=look.scatter,
        Subsurface_Radius=(1.0, 0.5, 0.35),
        Subsurface_Scale=1.2 / UNIT_MM,
    )
    return shader.finished(surface.outputs[0])


def _cornea() -> Any:
    shader = Shader("cornea")
    clear, glossy = shader.node("BsdfTransparent"), shader.node("BsdfGlossy", Roughness=0.035)
    mixed = shader.node("MixShader")
    shader.feed(mixed.inputs[0], shader.node("Fresnel", IOR=1.45).outputs[0])
    shader.feed(mixed.inputs[1], clear.outputs[0])
    shader.feed(mixed.inputs[2], glossy.outputs[0])
    return shader.finished(mixed.outputs[0])


def _plain(name: str, scatter_mm: float = 1.0, **inputs: Any) -> Any:
    """A material in the colours of the vertices, with other inputs of the physical surface."""
    shader = Shader(name)
    surface = shader.principled(
        Base_Color=shader.attribute("colour", "Color"),
        Subsurface_Radius=(1.0, 0.5, 0.35),
        Subsurface_Scale=scatter_mm / UNIT_MM,
        Sheen_Roughness=0.4,
        Coat_Roughness=0.08,
        **inputs,
    )
    return shader.finished(surface.outputs[0])
