"""Last steps of an import: size and origin of the face, and checks of the shapes that lips and lids need."""

from dataclasses import replace

import numpy as np

from lexicon.errors import DataError
from tts2face.face.expressions import GAZE_SHAPES, add_expression_shapes, expression_table
from tts2face.face.eyelids import BLINK_SHAPES, LID_LANDMARK_PAIRS, WIDE_SHAPES, build_eyelid_model
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.face.lip_constraints import build_lip_constraints
from tts2face.face.shape_transfer import default_head, eye_distance
from tts2face.face.stand_in import VISEME_PREFIX
from tts2face.interchange.characters.character import Character
from tts2face.interchange.characters.head_mesh import HeadMesh
from tts2face.interchange.characters.shape_names import ARKIT_SHAPES
from tts2face.interchange.characters.surface import Placement
from tts2face.models.face import Face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT

TRUE_EYE_DISTANCES_MM = (60.0, 140.0)  # outer corners; other sizes are scaled to the default head's
# By which the lips must part at weight 1 of some shape, over the mouth's width: drawn characters have small mouths.
MIN_GAP_SHARE = 0.04


def place_face(face: Face, character: Character, head: HeadMesh, provisional: Placement) -> Face:
    """Face in mm with its origin between the eyes and the pivot of its head."""
    model = default_head()
    if not len(face.landmarks):
        return _place_by_eyes(face, model)
    distance = eye_distance(face)
    # glTF counts in metres; other sizes of eyes are stylised or in other units
    metres = distance / provisional.scale * 1000.0
    low, high = TRUE_EYE_DISTANCES_MM
    scale = (metres if low <= metres <= high else eye_distance(model)) / distance
    if len(face.eyes) == 2:
        origin = np.mean([eye.centre for eye in face.eyes], axis=0)
    else:
        places = scatter_landmarks(face, landmark_positions(face))
        corners = scatter_landmarks(model, landmark_positions(model))[[EYE_OUTER_LEFT, EYE_OUTER_RIGHT]]
        origin = places[[EYE_OUTER_LEFT, EYE_OUTER_RIGHT]].mean(axis=0) - corners.mean(axis=0) / scale
    pivot = model.pivot * (scale * distance / eye_distance(model))
    if "head" in character.bone_places:
        bone = provisional.millimetres((head.turn @ character.bone_places["head"])[None])[0]
        inside = (bone > face.vertices.min(axis=0)) & (bone < face.vertices.max(axis=0))
        pivot = (bone - origin) * scale if inside.all() else pivot
    factor = np.float32(scale)
    return replace(
        face,
        vertices=((face.vertices - origin) * scale).astype(np.float32),
        shapes=face.shapes * factor,
        eyes=tuple(replace(eye, centre=((eye.centre - origin) * scale).astype(np.float32)) for eye in face.eyes),
        pivot=np.asarray(pivot, np.float32),
    )


def _place_by_eyes(face: Face, model: Face) -> Face:
    """A face without landmarks in mm: its eyeballs where the default head has them, otherwise its moved part."""
    if len(face.eyes) == 2:
        near, far = ([eye.centre.astype(np.float64) for eye in shown.eyes] for shown in (face, model))
        scale = float(np.linalg.norm(far[0] - far[1]) / np.linalg.norm(near[0] - near[1]))
        origin = np.mean(near, axis=0)
    else:
        moved = face.vertices[np.abs(face.shapes).max(axis=(0, 2), initial=0.0) > 0]
        scale, origin = 1.0, moved.mean(axis=0)
    return replace(
        face,
        vertices=((face.vertices - origin) * scale).astype(np.float32),
        shapes=face.shapes * np.float32(scale),
        eyes=tuple(replace(eye, centre=((eye.centre - origin) * scale).astype(np.float32)) for eye in face.eyes),
        pivot=model.pivot,
    )


def drop_unsuited_shapes(face: Face) -> tuple[Face, list[str]]:
    """Face without blinks that do not close the eyes and wide eyes that do not open them, and notes about them."""
    mouth = build_lip_constraints(face)
    widest = float(mouth.gaps[:, mouth.moving].max(initial=0.0)) if len(mouth.moving) else 0.0
    places = scatter_landmarks(face, landmark_positions(face))
    width = float(np.linalg.norm(places[MOUTH_CORNER_LEFT] - places[MOUTH_CORNER_RIGHT]))
    if widest < MIN_GAP_SHARE * width:
        raise DataError(
            f"no shape parts the character's lips by more than {widest:.1f} mm, of a mouth {width:.0f} mm wide; check "
            "the landmarks in a picture (--preview) and the names of the shapes"
        )
    complete = add_expression_shapes(face)
    motion = scatter_landmarks(complete, landmark_motion(complete, np.arange(len(complete.shape_names))))[:, 1]
    dropped = []
    for name in (*BLINK_SHAPES, *WIDE_SHAPES):
        upper, lower = LID_LANDMARK_PAIRS[0 if name.endswith("Left") else 1]
        change = float((motion[list(upper)] - motion[list(lower)]).mean(axis=0)[complete.shape_names.index(name)])
        if name in face.shape_names and not (change < 0 if name in BLINK_SHAPES else change > 0):
            dropped.append(name)
    kept = np.array([name not in dropped for name in face.shape_names])
    notes = [f"{name} does not move the lids at their landmarks and is replaced" for name in dropped]
    names = tuple(name for name in face.shape_names if name not in dropped)
    face = replace(face, shape_names=names, shapes=face.shapes[kept], limits=face.limits[kept])
    build_eyelid_model(add_expression_shapes(face) if dropped else complete)
    return face, notes


def missing_shapes(face: Face) -> dict[str, str]:
    """ARKit shapes that a face lacks, and what replaces each of them."""
    speaks_by_visemes = any(name.startswith(VISEME_PREFIX) for name in face.shape_names)
    moved_by_gestures = {*expression_table(), *BLINK_SHAPES, *WIDE_SHAPES, *GAZE_SHAPES}
    missing = {}
    for name in ARKIT_SHAPES:
        if name in face.shape_names:
            continue
        if name in moved_by_gestures:
            missing[name] = "landmarks moved as on the default head, in expressions and gestures"
        elif name.startswith(("jaw", "mouth")):
            missing[name] = "the character's own visemes" if speaks_by_visemes else "the other shapes of its mouth"
        else:
            missing[name] = "nothing"
    return missing
