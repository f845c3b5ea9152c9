"""Short names for the path tracer's shader nodes, of Blender's package bpy."""

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from tts2face.numeric.arrays import decode_srgb

Socket = Any  # a socket of a node, or a constant for an input


def rgba(srgb: Sequence[float]) -> tuple[float, ...]:
    """Linear light and full coverage of a colour in sRGB."""
    return (*decode_srgb(np.array(srgb)).tolist(), 1.0)


class Shader:
    """A material that is built node by node."""

    def __init__(self, name: str) -> None:
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()

    def node(self, kind: str, **inputs: Any) -> Any:
        """A node of a kind such as ``TexNoise``; keywords are its inputs (``_`` for a space) or its properties."""
        made = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in inputs.items():
            spaced = name.replace("_", " ")
            if spaced in made.inputs:
                self.feed(made.inputs[spaced], value)
            else:
                setattr(made, name, value)
        return made

    def feed(self, socket: Any, value: Socket) -> None:
        """Connect an output to an input, or set the input to a constant."""
        if hasattr(value, "is_linked"):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def attribute(self, name: str, output: str = "Fac") -> Socket:
        """Values of the mesh's vertices."""
        return self.node("Attribute", attribute_name=name).outputs[output]

    def mix(self, first: Socket, second: Socket, share: Socket, mode: str = "MIX") -> Socket:
        """Colours mixed, or multiplied, by a share."""
        made = self.node("Mix", data_type="RGBA", blend_type=mode)
        for number, value in ((0, share), (6, first), (7, second)):
            self.feed(made.inputs[number], value)
        return made.outputs[2]

    def scaled(self, value: Socket, low: float, high: float, to_low: float, to_high: float) -> Socket:
        """Values from low to high, mapped linearly."""
        made = self.node("MapRange")
        for number, given in enumerate((value, low, high, to_low, to_high)):
            self.feed(made.inputs[number], given)
        return made.outputs[0]

    def math(self, operation: str, first: Socket, second: Socket = 0.0) -> Socket:
        """Result of an operation such as ``MULTIPLY``."""
        made = self.node("Math", operation=operation)
        self.feed(made.inputs[0], first)
        self.feed(made.inputs[1], second)
        return made.outputs[0]

    def noise(self, at: Socket, scale: Sequence[float], detail: float, roughness: float = 0.5) -> Socket:
        """Noise of size 1 / scale at places."""
        placed = self.node("Mapping", Vector=at, Scale=tuple(scale))
        return self.node("TexNoise", Vector=placed.outputs[0], Scale=1.0, Detail=detail, Roughness=roughness).outputs[
            "Fac"
        ]

    def bumped(self, height: Socket, strength: float, distance: float) -> Socket:
        """Normals of a surface with a height."""
        return self.node("Bump", Height=height, Strength=strength, Distance=distance).outputs[0]

    def principled(self, **inputs: Any) -> Any:
        """A physical surface with light scattered below it by random walk."""
        made = self.node("BsdfPrincipled", **inputs)
        made.subsurface_method = "RANDOM_WALK"
        return made

    def finished(self, surface: Socket) -> Any:
        """The material with this surface."""
        self.feed(self.tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"], surface)
        return self.material
