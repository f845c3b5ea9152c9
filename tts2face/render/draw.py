"""Frames of a mesh face as pictures, drawn one after the other and never kept."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.deformation import REST_HEAD
from tts2face.models.face import Face
from tts2face.prefetch import map_in_order
from tts2face.render import vtk_renderer
from tts2face.render.picture import PYVISTA, Picture
from tts2face.render.picture_kernels import DrawingBuffers, allocate_buffers, draw_surface
from tts2face.render.renderer import SYNTHETIC_NOTICE
from tts2face.render.scene import Scene, available_cores, build_scene
from tts2face.types import Clip


@dataclass(frozen=True, slots=True, eq=False)
class MeshRenderer:
    """Draws a mesh face; a `tts2face.render.renderer.FrameRenderer`."""

    scene: Scene

    @property
    def picture(self) -> Picture:
        """How the frames are drawn."""
        return self.scene.picture

    @property
    def notice(self) -> str:
        """What every file says about itself: nothing, unless the head is a real person's likeness."""
        metadata = self.scene.face.metadata
        return SYNTHETIC_NOTICE.format(name=metadata.get("name", "a person")) if "consent" in metadata else ""

    def frames(self, clip: Clip, *, threads: int | None = None, first: int = 0) -> Iterator[NDArray[np.uint8]]:
        """Pictures of a clip's frames; its motion is in the face's first shapes, and the others stay at rest."""
        del first  # a head looks the same at any time
        values = self._weights(clip)
        poses = zip(values, clip.head.values, strict=True)
        if self.picture.renderer == PYVISTA:
            yield from vtk_renderer.render_frames(self.scene, poses)
            return
        n_threads = threads or available_cores()
        rooms = deque(self._room() for _ in range(n_threads))

        def draw_one(pose: tuple[NDArray[np.float32], NDArray[np.float32]]) -> NDArray[np.uint8]:
            room = rooms.popleft()
            try:
                return self._draw(*pose, room)
            finally:
                rooms.append(room)

        yield from map_in_order(draw_one, poses, n_threads)

    def frame(self, clip: Clip, number: int) -> NDArray[np.uint8]:
        """The picture of one frame of a clip."""
        return self.draw(self._weights(clip)[number], clip.head.values[number])

    def draw(self, weights: NDArray[np.floating], head: NDArray[np.floating] = REST_HEAD) -> NDArray[np.uint8]:
        """One picture of the face for the weights (K,) of its shapes and a head pose (6,)."""
        n_shapes = len(self.scene.face.shape_names)
        if np.shape(weights) != (n_shapes,):
            raise InputError(f"the face has {n_shapes} shapes, not weights of shape {np.shape(weights)}")
        pose = np.asarray(weights, np.float32), np.asarray(head, np.float32)
        if self.picture.renderer == PYVISTA:
            (drawn,) = vtk_renderer.render_frames(self.scene, [pose])
            return drawn
        return self._draw(*pose, self._room())

    def _weights(self, clip: Clip) -> NDArray[np.float32]:
        names = self.scene.face.shape_names
        n_moved = len(clip.motion.channels)
        if clip.motion.channels != names[:n_moved]:
            raise InputError(
                "the clip's motion is not in the shapes of this face; make the clip with a session of this face"
            )
        if n_moved == len(names):
            return clip.motion.values
        return np.pad(clip.motion.values, ((0, 0), (0, len(names) - n_moved)))

    def _room(self) -> DrawingBuffers:
        picture = self.picture
        return allocate_buffers(self.scene.surface, (picture.width, picture.height), picture.supersampling)

    def _draw(self, weights: NDArray[np.float32], head: NDArray[np.float32], room: DrawingBuffers) -> NDArray[np.uint8]:
        scene, picture = self.scene, self.picture
        drawn = np.zeros((picture.height, picture.width, picture.channels), np.uint8)
        drawn[:, :, :3] = scene.background
        points = scene.surface.rig.pose(weights, head)
        draw_surface(points, scene.surface, scene.optics, (scene.lights, scene.exposure.at(weights)), room, drawn)
        return drawn


def mesh_renderer(face: Face, picture: Picture) -> MeshRenderer:
    """The renderer of a face; make it once, draw many times.

    Raises
    ------
    BackendError
        The picture wants a renderer that this machine lacks.
    """
    if picture.renderer == PYVISTA:
        vtk_renderer.require_gl()
    return MeshRenderer(build_scene(face, picture))


def draw(
    face: Face,
    weights: NDArray[np.floating],
    head: NDArray[np.floating] = REST_HEAD,
    picture: Picture | None = None,
) -> NDArray[np.uint8]:
    """One picture of a face.

    Parameters
    ----------
    weights : (K,)
        Of the face's shapes.
    head : (6,)
        Pose of `tts2face.types.HEAD_CHANNELS`.
    picture
        How to draw; the default options without it.

    Returns
    -------
    (H, W, 3) or (H, W, 4)
        sRGB, with coverage (not premultiplied) when the background is transparent.

    Raises
    ------
    InputError
        The number of weights is not the number of the face's shapes.
    """
    return mesh_renderer(face, picture or Picture()).draw(weights, head)
