"""Film light of drawn characters, baked into their files, which needs bpy."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from corpus_tools.shipped.drawn.build_drawn import drawn_face, face_masks, other_hair, own_hairdo
from corpus_tools.shipped.drawn.character import DrawnCharacter
from corpus_tools.shipped.drawn.worn import HAIRCUTS, lit_haircut
from corpus_tools.shipped.film.bake_poses import HAIRCUT, Effort, bake_poses
from corpus_tools.shipped.film.fit_light import fit_haircut, fit_light
from corpus_tools.shipped.film.look import look_of
from corpus_tools.shipped.film.pose_light import PoseLight
from corpus_tools.shipped.film.poses import lit_poses
from corpus_tools.shipped.film.scene import FilmScene
from corpus_tools.shipped.head.source import SourceMesh
from corpus_tools.training.calibrate_file import calibrate_face_file
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.face_names import OF_FACE
from tts2face.models.hair_file import write_lit_hair
from tts2face.models.light import Baked


def bake_face(
    source: SourceMesh, face: Face, character: DrawnCharacter, effort: Effort, report: Callable[[str], None]
) -> PoseLight:
    """Light of a character that `drawn.build_drawn` has built: with `HAIRCUT`, at rest and in turns."""
    scene = FilmScene(face, look_of(character.name), face_masks(source, face))
    poses = [pose for pose in lit_poses(face) if effort is not HAIRCUT or pose.is_still]
    return bake_poses(scene, poses, other_hair(source, character), effort, report)


def light_character(
    source: SourceMesh, character: DrawnCharacter, faces: Path, bakes: Path, report: Callable[[str], None]
) -> None:
    """Bake, fit and write the light of a character and of its haircuts.

    Parameters
    ----------
    faces
        Folder of the ``.face`` file, which gets the light, and of the haircuts.
    bakes
        Folder in which baked poses are kept: with them light is fitted only.
    """

    def baked(face: Face, dressed: DrawnCharacter, effort: Effort) -> PoseLight:
        kept = bakes / f"{dressed.name}-{dressed.hair.name}.npz"
        if kept.is_file():
            return PoseLight.load(kept)
        poses = bake_face(source, face, dressed, effort, report)
        bakes.mkdir(parents=True, exist_ok=True)
        poses.save(kept)
        return poses

    name = character.name
    path = faces / f"{name}.face"
    face = read_face(path)
    own = baked(face, character, Effort())
    report(f"{name}: fit")
    light = fit_light(face, own, look_of(name), character.eyes)
    write_face(path, replace(face, light=Baked(light), hairdo=own_hairdo(character)))
    report(f"{name}: calibration")  # again: the tracker sees other pictures of it now
    calibrate_face_file(str(path), path)
    for style in HAIRCUTS.get(name, ()):
        report(f"{name}: {style.name}")
        dressed = replace(character, hair=style)
        wearing = drawn_face(source, dressed)
        worn = fit_haircut((face, wearing), own, baked(wearing, dressed, HAIRCUT), light)
        write_lit_hair(faces / f"{name}{OF_FACE}{style.name}.hair", lit_haircut(wearing, style, worn))
