"""A face with baked light as other programs can show it: its light at rest in textures and colours of vertices."""

from dataclasses import replace

import numpy as np

from tts2face.models.face import Face, Texture
from tts2face.models.light import Lamps


def in_rest_light(face: Face) -> tuple[Face, frozenset[str]]:
    """The face with its baked light at rest for textures and colours, and the names of the parts that take no lamps.

    Eyes, teeth and tongue keep their own colours: their light changes with gaze and opening. A face without baked
    light stays as it is.
    """
    if isinstance(face.light, Lamps):
        return face, frozenset()
    light = face.light.baked
    small = np.zeros(len(face.vertices), bool)
    small[light.rows] = True
    unlit = set(light.page_of)
    textures = [Texture(page) for page in light.pages]
    places: dict[int, int] = {}
    parts = []
    for part in face.parts:
        corners = face.triangles[part.first : part.first + part.count]
        if part.name in light.page_of:
            shown = replace(part, texture=light.page_of[part.name])
        elif part.is_textured:
            if part.texture not in places:
                places[part.texture] = len(textures)
                textures.append(face.textures[part.texture])
            shown = replace(part, texture=places[part.texture])
        else:
            shown = part
            if small[corners].all():
                unlit.add(part.name)
        parts.append(shown)
    colours = face.colours.copy()
    colours[light.rows] = light.base
    return replace(face, parts=tuple(parts), textures=tuple(textures), colours=colours), frozenset(unlit)
