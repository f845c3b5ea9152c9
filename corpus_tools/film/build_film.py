"""``python -m corpus_tools.film.build_film``: bakes the film light of drawn characters into their files. Needs bpy."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from corpus_tools.drawn.build_drawn import CAST, cast_parser, face_masks, step_reporter
from corpus_tools.film.bake_poses import Effort, bake_poses
from corpus_tools.film.fit_light import fit_light
from corpus_tools.film.look import Look, look_of
from corpus_tools.film.pose_light import PoseLight
from corpus_tools.film.poses import lit_poses
from corpus_tools.film.scene import FilmScene
from corpus_tools.head.source import SourceMesh, fetch_data, read_source
from corpus_tools.training.score_files import calibrate_face_file
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face


def bake_face(source: SourceMesh, face: Face, look: Look, report: Callable[[str], None]) -> PoseLight:
    """Light of the poses of a face that `corpus_tools.drawn.build_drawn` has built."""
    scene = FilmScene(face, look, face_masks(source, face))
    return bake_poses(scene, lit_poses(face), Effort(), report)


def main() -> None:
    """Bake, fit and write the light of characters; steps go to standard error."""
    parser, report = cast_parser(__doc__), step_reporter()
    parser.add_argument("--keep", type=Path, help="folder in which the bakes are kept: with them light is fitted only")
    arguments = parser.parse_args()
    source = read_source(arguments.data or fetch_data(Path.home() / ".cache/tts2face"))
    for name in arguments.names or CAST:
        path, look = arguments.faces / f"{name}.face", look_of(name)
        face = read_face(path)
        kept = None if arguments.keep is None else arguments.keep / f"{name}.npz"
        if kept is not None and kept.is_file():
            poses = PoseLight.load(kept)
        else:
            poses = bake_face(source, face, look, report)
            if kept is not None:
                poses.save(kept)
        report(f"{name}: fit")
        write_face(path, replace(face, light=(fit_light(face, poses, look, CAST[name].eyes),)))
        report(f"{name}: calibration")  # again: the tracker sees other pictures of it now
        calibrate_face_file(str(path), path)
    report("done")


if __name__ == "__main__":
    main()
