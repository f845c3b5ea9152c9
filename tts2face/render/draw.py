"""A clip's frames as pictures, drawn one after the other and never kept."""

import os
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.deformation import REST_HEAD
from tts2face.models.face import Face
from tts2face.render import vtk_renderer
from tts2face.render.background import background
from tts2face.render.camera import Optics, optics
from tts2face.render.drawing_pool import drawn_ahead
from tts2face.render.own_face import SYNTHETIC, PlateStage, plate_drawn, plate_frame, plate_frames
from tts2face.render.picture import PYVISTA, Picture
from tts2face.render.picture_kernels import Room, paint, room_for
from tts2face.render.soft_shadows import Exposure, exposed
from tts2face.render.studio_light import lamps, light_table
from tts2face.render.surface import Surface, surfaced
from tts2face.types import Clip


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Everything that stays the same while a face is drawn into pictures."""

    face: Face
    picture: Picture
    surface: Surface
    optics: Optics
    lights: NDArray[np.float32]
    exposure: Exposure
    behind: NDArray[np.uint8]

    @property
    def notice(self) -> str:
        """What every file of it says about itself; a drawn head says nothing unless it is a real person's likeness."""
        if "consent" not in self.face.metadata:
            return ""
        return SYNTHETIC.format(name=self.face.metadata.get("name", "a person"))


AnyStage = Stage | PlateStage


def staged(face: Face, picture: Picture) -> Stage:
    """The stage for a face and a picture; make it once, draw many times.

    Raises
    ------
    BackendError
        The picture wants a renderer that this machine lacks.
    """
    if picture.renderer == PYVISTA:
        vtk_renderer.require_gl()
    side = picture.supersampling
    surface, towards = surfaced(face), lamps(picture.view)
    camera = optics(picture.view, face, (picture.width * side, picture.height * side))
    exposure = exposed(face, surface, towards, available_cores())
    return Stage(face, picture, surface, camera, light_table(towards, camera), exposure, background(picture))


def draw(
    face: Face | Stage,
    weights: NDArray[np.floating],
    head: NDArray[np.floating] = REST_HEAD,
    picture: Picture | None = None,
) -> NDArray[np.uint8]:
    """One picture of a face.

    Parameters
    ----------
    face
        A face, or a stage when more pictures follow.
    weights : (K,)
        Of the face's shapes.
    head : (6,)
        Pose of `tts2face.types.HEAD_CHANNELS`.
    picture
        How to draw; the default options without it. Not needed with a stage.

    Returns
    -------
    (H, W, 3) or (H, W, 4)
        sRGB, with coverage (not premultiplied) when the background is transparent.

    Raises
    ------
    InputError
        The number of weights is not the number of the face's shapes.
    """
    stage = face if isinstance(face, Stage) else staged(face, picture or Picture())
    n_shapes = len(stage.face.shape_names)
    if np.shape(weights) != (n_shapes,):
        raise InputError(f"the face has {n_shapes} shapes, not weights of shape {np.shape(weights)}")
    pose = np.asarray(weights, np.float32), np.asarray(head, np.float32)
    if stage.picture.renderer == PYVISTA:
        (drawn,) = vtk_renderer.frames(stage, [pose])
        return drawn
    return _drawn(stage, *pose, _room(stage))


def frames(
    clip: Clip,
    face: Face | AnyStage,
    picture: Picture | None = None,
    *,
    threads: int | None = None,
    first: int = 0,
) -> Iterator[NDArray[np.uint8]]:
    """Pictures of a clip's frames in order; as many are drawn ahead as there are threads, the rest not yet.

    The bytes do not depend on the number of threads: one thread draws one picture. `first` is the number of the clip's
    first frame in the whole, which a talker's own plate goes on from.

    Raises
    ------
    InputError
        The clip's motion is not in the face's shapes.
    """
    n_threads = threads or available_cores()
    if isinstance(face, PlateStage):
        yield from plate_frames(clip, face, n_threads, first)
        return
    stage = face if isinstance(face, Stage) else staged(face, picture or Picture())
    if clip.motion.channels != stage.face.shape_names:
        raise InputError("the clip's motion is not in the shapes of this face; retarget it to the face first")
    if stage.picture.renderer == PYVISTA:
        yield from vtk_renderer.frames(stage, zip(clip.motion.values, clip.head.values, strict=True))
        return
    rooms = deque(_room(stage) for _ in range(n_threads))

    def one(pose: tuple[NDArray[np.float32], NDArray[np.float32]]) -> NDArray[np.uint8]:
        room = rooms.popleft()
        try:
            return _drawn(stage, *pose, room)
        finally:
            rooms.append(room)

    yield from drawn_ahead(one, zip(clip.motion.values, clip.head.values, strict=True), n_threads)


def still(clip: Clip, stage: AnyStage, number: int) -> NDArray[np.uint8]:
    """One frame of a clip."""
    if isinstance(stage, PlateStage):
        return plate_drawn(stage, clip.motion.values[number], plate_frame(stage, number / clip.fps))
    return draw(stage, clip.motion.values[number], clip.head.values[number])


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _room(stage: Stage) -> Room:
    picture = stage.picture
    return room_for(stage.surface, (picture.width, picture.height), picture.supersampling)


def _drawn(stage: Stage, weights: NDArray[np.float32], head: NDArray[np.float32], room: Room) -> NDArray[np.uint8]:
    picture = stage.picture
    drawn = np.zeros((picture.height, picture.width, picture.channels), np.uint8)
    drawn[:, :, :3] = stage.behind
    points = stage.surface.rig.posed(weights, head)
    paint(points, stage.surface, stage.optics, (stage.lights, stage.exposure.at(weights)), room, drawn)
    return drawn
