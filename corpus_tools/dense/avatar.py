"""A head of a person from photographs: shape, skin, eyes and hair, for everything that a head can."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from corpus_tools.dense.build_face import CONTENT, SOURCE_FACE, BuiltFace, fit_person, paint_person
from corpus_tools.dense.light_colour import are_drawn
from corpus_tools.dense.mesh_fit import align_to_head, face_landmarks
from corpus_tools.dense.person_look import LookChoices, is_child
from corpus_tools.dense.tracked_pictures import TrackedPictures
from tts2face.models.consent import PHOTO_TOOL, consent_record
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.landmarks import N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.numeric.arrays import FloatArray
from tts2face.photo.found_face import PhotographedFace, PhotoReader, find_face
from tts2face.photo.lines import find_lip_line
from tts2face.photo.photograph import split_number
from tts2face.picture.occlusion import bake_occlusion
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw
from tts2face.processes.threads import available_cores
from tts2face.storage.shipped import find_file
from tts2face.video.pose import remove_pose
from tts2face.video.tracking import FaceTracker

CHILD_IDENTITY = "nia"  # of the shipped head
MIRRORED_WEIGHT = 0.03  # of a mirrored picture, which fills what a turned head hides
OPENING_SCALE = np.array([1.02, 1.25])  # of the opening between lips, for its rim
# of the head in which landmarks are read as in the pictures
DRAWN_PX, DRAWN_CAMERA = 512, "0,0"
# Of differences in depth, which the tracker hardly sees: with all of them, heads of the eight identities are 3.0 mm off
# those in their pictures (mean of landmarks), with half of them 2.9, and 4.3 without the comparison to a drawn head.
DEPTH_SHARE = 0.5
EXPRESSION_FROM = 0.1  # score of a shape from which it is taken as an expression, not as the build of a face
EXPRESSIONS = ("jawOpen", "mouthSmile", "mouthUpperUp", "mouthLowerDown", "mouthStretch", "mouthPucker", "mouthFunnel",
               "mouthFrown", "browDown", "browInnerUp", "browOuterUp", "eyeSquint", "cheekSquint")  # fmt: skip


def build_avatar(  # noqa: PLR0913 - one parameter an option
    photos: Sequence[str | Path],
    out: Path,
    *,
    consent: str | None,
    name: str | None = None,
    eye_color: str | None = None,
    age_keep: bool = False,
    no_glasses: bool = False,
    model: Path | None = None,
    on_warning: Callable[[str], None] = lambda _: None,
) -> BuiltFace:
    """Adapt the realistic head to a person in photographs, and write it as a face.

    Parameters
    ----------
    photos
        Pictures of the same person; ``photo.jpg@2`` is the second largest face. One from the front is enough; others
        from the sides show more of the skin.
    consent, name, model, on_warning
        As for `tts2face.face_from_photo`.
    eye_color
        Name of `tts2face.models.named_colours.EYE_COLOURS` or #rrggbb; that of the picture if omitted.
    age_keep
        Keep the wrinkles of the skin, which are softened otherwise: as colours, they stay when the face moves.

    no_glasses
        Leave off glasses that are seen; they are taken off the skin in any case.

    Raises
    ------
    InputError
        There is no such file, face or eye colour, or no consent.
    DataError
        A picture cannot be read, or shows no face that can be used.
    BackendError
        The landmark models or a package are missing, or the file cannot be written.
    """
    choices = LookChoices(eye_color, age_keep, not no_glasses)
    record = consent_record(name or split_number(photos[0])[0].stem, consent)
    head = read_face(find_file(SOURCE_FACE, "face"))
    seen, neutral = _read(photos, head, model, on_warning)
    mirrored = [_mirrored(observed, mirror_table(head)) for observed in seen]
    person = np.mean(neutral, axis=0)
    is_drawn = are_drawn(seen[0].points[0])
    fitted = fit_person(_child_head(head) if is_child(person, is_drawn=is_drawn) else head, person)
    face, look = paint_person(fitted, [*seen, *mirrored], lambda done, of: None, choices, model=model)
    face = replace(
        face,
        metadata={
            **head.metadata,
            "name": record["name"],
            "licence": f"mesh: {head.metadata['licence']}; likeness of the person: as stated in the consent",
            "content": CONTENT,
            "look": look.summary(),
            "consent": dict(record),
            "made_by": PHOTO_TOOL,
            "created": datetime.now(UTC).date().isoformat(),
        },
    )
    write_face(out, bake_occlusion(face, available_cores()))
    return BuiltFace(len(seen), len(photos), fitted.error_mm(), look)


def _read(
    photos: Sequence[str | Path], head: Face, model: Path | None, on_warning: Callable[[str], None]
) -> tuple[list[TrackedPictures], list[FloatArray]]:
    """The look that the pictures show, and the landmarks (478, 3) of each without its expression, mm."""
    reader = PhotoReader(model, on_warning)
    seen, neutral = [], []
    for photo in photos:
        shown = reader.read(photo)
        points = shown.found.landmarks[None].astype(np.float32)
        landmarks = remove_pose(points, 1.0).landmarks
        lips = find_lip_line(shown.picture.pixels, shown.found)
        opening = None if lips.is_closed else widened(np.concatenate([lips.upper, lips.lower[-2:0:-1]])[:, :2])
        seen.append(TrackedPictures(Path(photo), points, landmarks, (shown.picture.pixels,), 1.0, opening))
        neutral.append(person_landmarks(shown, head, reader.tracker))
    return seen, neutral


def _child_head(head: Face) -> Face:
    """The head with the skull, neck and shoulders of a child, and its own textures."""
    return replace(read_face(find_file(SOURCE_FACE, "face"), CHILD_IDENTITY), textures=head.textures)


def widened(opening: FloatArray) -> FloatArray:
    """An opening (N, 2) with the rim that its darkness colours."""
    middle = opening.mean(axis=0)
    grown: FloatArray = middle + OPENING_SCALE * (opening - middle)
    return grown


def person_landmarks(shown: PhotographedFace, head: Face, tracker: FaceTracker) -> FloatArray:
    """Landmarks (468, 3) on a head, mm, of a photographed person without the expression.

    They are those of the head, moved by the difference between what the tracker reads in the photograph and in a
    picture of the head in the same pose and with the same expression: what it errs by in both is no shape.
    """
    scores = np.array([shown.scores.get(name, 0.0) * name.startswith(EXPRESSIONS) for name in head.shape_names])
    pose = np.concatenate([np.radians(shown.found.angles_deg), np.zeros(3)])
    weights = np.maximum(scores - EXPRESSION_FROM, 0.0)
    drawn = draw(head, weights, pose, Picture(size=f"{DRAWN_PX}x{DRAWN_PX}", camera=DRAWN_CAMERA))
    rest = face_landmarks(head, head.vertices.astype(np.float64))[:N_MESH_LANDMARKS]
    own, usual = (
        align_to_head(remove_pose(found.landmarks[None].astype(np.float32), 1.0).landmarks[0], rest)
        for found in (shown.found, find_face(drawn, tracker, "the head"))
    )
    return rest + (own - usual) * (1.0, 1.0, DEPTH_SHARE)


def mirror_table(head: Face) -> NDArray[np.int64]:
    """(478,) landmark on the other side of the face."""
    places = face_landmarks(head, head.vertices.astype(np.float64))[:N_LANDMARKS]
    return np.asarray(cKDTree(places).query(places * (-1.0, 1.0, 1.0))[1], np.int64)


def _mirrored(seen: TrackedPictures, table: NDArray[np.int64]) -> TrackedPictures:
    """The mirror image of pictures, which counts where they show nothing."""
    (pixels,) = seen.pictures
    width = pixels.shape[1]
    points, landmarks = seen.points[:, table].copy(), seen.landmarks[:, table] * np.array([-1, 1, 1], np.float32)
    points[..., 0] = width - 1 - points[..., 0]
    # OpenCV reads no negative strides
    picture = np.ascontiguousarray(pixels[:, ::-1])
    opening = None if seen.opening is None else np.array([width - 1, 0]) + seen.opening * (-1, 1)
    return TrackedPictures(seen.file, points, landmarks, (picture,), MIRRORED_WEIGHT, opening)
