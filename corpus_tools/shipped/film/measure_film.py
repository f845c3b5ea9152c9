"""``python -m corpus_tools.shipped.film.measure_film``: baked light beside the path tracer, in unseen poses.

It needs bpy.
"""

import argparse
import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from corpus_tools.shipped.drawn.build_drawn import CAST, face_masks
from corpus_tools.shipped.film.compare import View, differences, draw_view, over_grey
from corpus_tools.shipped.film.look import look_of
from corpus_tools.shipped.film.poses import LitPose, held_out_poses
from corpus_tools.shipped.film.scene import FilmScene
from corpus_tools.shipped.head.source import SourceMesh, fetch_data, read_source
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.numeric.arrays import Pixels
from tts2face.picture.camera_view import parse_camera

SIDE_PX, SAMPLES = 512, 32
CAMERAS = ("20,3", "35,3", "-35,3")  # about the pose at rest
N_COLUMNS = 4  # of the sheet of sixteen views
REGIONS = ("face", "mouth", "eyes", "hair", "clothes")


def views(face: Face) -> dict[str, View]:
    """Comparisons by name: rest, poses that were not fitted, and cameras round the pose at rest."""
    rest = LitPose("rest", np.zeros(len(face.shape_names), np.float32), np.zeros(6, np.float32))
    found = {"rest": View(rest, "front")}
    found |= {pose.name: View(pose, "front") for pose in held_out_poses(face)}
    return found | {f"camera {camera}": View(rest, camera) for camera in CAMERAS}


def build_scene(source: SourceMesh, face: Face, name: str) -> FilmScene:
    """A character before the path tracer."""
    return FilmScene(face, look_of(name), face_masks(source, face))


def trace(
    scene: Callable[[], FilmScene], wanted: Mapping[str, View], prefix: Path, report: Callable[[str], None]
) -> dict[str, Pixels]:
    """Pictures (S, S, 4) of the path tracer by the name of their view; files that are there are not made again."""
    paths = {key: prefix.with_name(f"{prefix.name} {key}.png") for key in wanted}
    if not all(path.is_file() for path in paths.values()):
        traced = scene()
        for key, view in wanted.items():
            report(key)
            traced.look_from(parse_camera(view.camera), SIDE_PX)
            traced.pose(view.pose.weights, view.pose.head)
            traced.render(paths[key], SAMPLES, has_wall=False)
    return {key: np.asarray(Image.open(path)) for key, path in paths.items()}


def main() -> None:
    """Print mean differences of 255 by region; write a sheet of path tracer, picture and three times the difference."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="+", choices=list(CAST), help="characters")
    parser.add_argument("--faces", type=Path, default=Path("tts2face/data"), help="folder of the .face files")
    parser.add_argument("--keep", type=Path, default=Path.home() / ".cache/tts2face/models", help="downloads")
    parser.add_argument("--traced", type=Path, required=True, help="folder in which the traced pictures are kept")
    parser.add_argument("--out", type=Path, required=True, help="folder of the sheets")
    parser.add_argument("--hair", help="haircut; the face's own if omitted")
    parser.add_argument("--hair-color", help="its colour; the face's own if omitted")
    arguments = parser.parse_args()
    source = read_source(fetch_data(arguments.keep))
    for folder in (arguments.traced, arguments.out):
        folder.mkdir(parents=True, exist_ok=True)
    for name in arguments.names:
        path = str(arguments.faces / f"{name}.face")
        face = load_face(path, hair=arguments.hair, hair_color=arguments.hair_color)
        label = " ".join(filter(None, (name, arguments.hair, arguments.hair_color)))
        cells = []
        wanted = views(face)
        pictures = trace(partial(build_scene, source, face, name), wanted, arguments.traced / label, _report)
        for key, traced in pictures.items():
            view = wanted[key]
            drawn, regions = draw_view(face, view, SIDE_PX)
            apart = differences(drawn, traced, regions)
            yaw, pitch = np.degrees(view.pose.head[[1, 0]])
            found = "  ".join(f"{region} {apart[region]:4.1f}" for region in REGIONS if region in apart)
            print(f"{label}  {key:14}  head {yaw:3.0f} {pitch:3.0f}  {found}")  # noqa: T201
            pair = [over_grey(traced), over_grey(drawn)]
            off = np.abs(pair[0].astype(np.int64) - pair[1]) * 3
            cells.append(np.vstack([*pair, np.clip(off, 0, 255).astype(np.uint8)]))
        rows = [np.hstack(cells[at : at + N_COLUMNS]) for at in range(0, len(cells), N_COLUMNS)]
        Image.fromarray(np.vstack(rows)).save(arguments.out / f"{label}.png")


def _report(view: str) -> None:
    sys.stderr.write(f"{view}\n")
    sys.stderr.flush()


if __name__ == "__main__":
    main()
