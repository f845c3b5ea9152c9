"""Light of mouths, fitted to pictures of the fitted poses, which needs bpy.

It takes what `corpus_tools.shipped.film.build_film` has written.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from corpus_tools.shipped.film.compare import LIPS
from corpus_tools.shipped.film.fit_pictures import SIDE_PX, fit_to_pictures
from corpus_tools.shipped.film.measure_film import build_scene
from corpus_tools.shipped.film.poses import LitPose, lit_poses
from corpus_tools.shipped.film.scene import FilmScene
from corpus_tools.shipped.head.source import SourceMesh
from corpus_tools.training.calibrate_file import calibrate_face_file
from tts2face.face.deformation import build_rig
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.light import Baked
from tts2face.numeric.arrays import Pixels
from tts2face.picture.camera import camera_matrices
from tts2face.picture.camera_view import parse_camera

SAMPLES, MARGIN_PX = 24, 7
CAMERA = parse_camera("front")


def trace_mouths(
    scene: Callable[[], FilmScene], face: Face, poses: Sequence[LitPose], prefix: Path, report: Callable[[str], None]
) -> dict[str, Pixels]:
    """Pictures (S, S, 4) of the mouth by the name of the pose; files that are there are not made again."""
    paths = {pose.name: prefix.with_name(f"{prefix.name} mouth {pose.name}.png") for pose in poses}
    wanted = [pose for pose in poses if not paths[pose.name].is_file()]
    if wanted:
        traced, rig = scene(), build_rig(face)
        traced.look_from(CAMERA, SIDE_PX)
        for pose in wanted:
            report(pose.name)
            traced.pose(pose.weights, pose.head)
            window = _mouth_window(face, rig.pose(pose.weights, pose.head))
            traced.render(paths[pose.name], SAMPLES, has_wall=False, window=window)
    return {name: np.asarray(Image.open(path)) for name, path in paths.items()}


def _mouth_window(face: Face, points: NDArray[np.float32]) -> NDArray[np.float64]:
    """Corners (2, 2), in shares of the picture, of a rectangle round the lips of posed vertices (V, 3)."""
    numbers = {int(number): row for row, number in enumerate(face.landmarks)}
    used = [numbers[name] for name in LIPS]
    optics = camera_matrices(CAMERA, face, (SIDE_PX, SIDE_PX))
    lips = np.einsum("lc,lcx->lx", face.landmark_weights[used], points[face.landmark_vertices[used]])
    seen = lips @ optics.view[:, :3].T + optics.view[:, 3]
    places = seen[:, :2] / seen[:, 2:] * optics.lens[0] + optics.lens[1:3]
    return np.array([places.min(axis=0) - MARGIN_PX, places.max(axis=0) + MARGIN_PX]) / SIDE_PX


def refine_mouth(source: SourceMesh, name: str, path: Path, traced: Path, report: Callable[[str], None]) -> None:
    """Trace the mouth of a character, and fit and write its light into its ``.face`` file.

    Parameters
    ----------
    traced
        Folder in which the traced pictures are kept.
    """
    traced.mkdir(parents=True, exist_ok=True)
    face = read_face(path)
    poses = [pose for pose in lit_poses(face) if not pose.head.any()]
    pictures = trace_mouths(partial(build_scene, source, face, name), face, poses, traced / name, report)
    report(f"{name}: fit")
    write_face(path, replace(face, light=Baked(fit_to_pictures(face, poses, pictures))))
    report(f"{name}: calibration")  # again: the tracker sees other pictures of it now
    calibrate_face_file(str(path), path)
