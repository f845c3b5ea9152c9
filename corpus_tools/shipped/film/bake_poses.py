"""Baking of a character's poses, which needs bpy."""

import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from corpus_tools.shipped.drawn.hair import OtherHair
from corpus_tools.shipped.drawn.tiles import HAIR_BOTTOM
from corpus_tools.shipped.film.bake import TexelBake, bake_vertices, displayed, view_table
from corpus_tools.shipped.film.pose_light import CAMERA_YAWS_DEG, FAR, FRONT, MOUTH, SKIN, PoseLight
from corpus_tools.shipped.film.poses import LitPose
from corpus_tools.shipped.film.scene import FilmScene
from tts2face.numeric.arrays import Float32Array


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
    small = [name for name in scene.objects if name not in (*SKIN, *FAR) and not name.startswith("cornea")]
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


def _small_light(scene: FilmScene, small: Sequence[str], effort: Effort) -> Float32Array:
    """(N, 3) light of the vertices of the small parts."""
    of_mouth = [name for name in small if name.startswith(MOUTH)]
    others = [name for name in small if name not in of_mouth]
    found = bake_vertices(scene, of_mouth, effort.mouth) | bake_vertices(scene, others, effort.small)
    return np.concatenate([found[name] if name.startswith("ball") else displayed(found[name]) for name in small])


def _displayed(light: Float32Array) -> Float32Array:
    return displayed(light.reshape(-1, 3)).reshape(light.shape)
