"""Stand-in for a face on which no landmarks were found: the default head with that face's shapes, by their names.

Weights that speech and gestures give it are weights of the face's own shapes: of ARKit's as they are, of visemes as the
sums of ARKit's that `visemes.tsv` states. A head of an animal or a robot speaks so.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files

import numpy as np

from tts2face.face.lip_constraints import SPEECH_SHAPE_PREFIXES
from tts2face.face.mesh_calibration import calibrate_on_mesh
from tts2face.face.shape_transfer import append_shapes, default_head
from tts2face.models.face import Face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_LOWER, OUTER_LIP_UPPER
from tts2face.numeric.arrays import Float32Array

VISEME_TABLE, VISEME_PREFIX = "visemes.tsv", "mouthViseme_"
VOWELS = tuple(VISEME_PREFIX + vowel for vowel in ("aa", "ih", "ou", "ee", "oh"))
ENOUGH_VOWELS = 3  # of which speech is made without the visemes of consonants
BOTH_SIDES = "*"
LIPS = frozenset({*INNER_LIP_UPPER, *INNER_LIP_LOWER, *OUTER_LIP_UPPER, *OUTER_LIP_LOWER})


def stand_in(face: Face) -> Face:
    """The face itself where it has the landmarks of lips, otherwise the default head with shapes of its names.

    Shapes of names that the head does not know move nothing.
    """
    if set(face.landmarks.tolist()) >= LIPS:
        return face
    head = default_head()
    shapes = np.stack([_shape(head, name) for name in face.shape_names])
    model = replace(
        head,
        shape_names=face.shape_names,
        shapes=shapes,
        limits=face.limits,
        eyes=tuple(
            replace(eye, turns={name: turn for name, turn in eye.turns.items() if name in face.shape_names})
            for eye in head.eyes
        ),
        occlusion=None,
        scores=None,
        opened_by=face.opened_by,
    )
    speaks = any(name.startswith(SPEECH_SHAPE_PREFIXES) for name in face.shape_names)
    # the jaw drops as on the head itself; its tolerance is the head's, too
    return replace(model, scores=calibrate_on_mesh(model).scores) if speaks else model


def consonants_beside_vowels(names: Sequence[str]) -> frozenset[str]:
    """Visemes of consonants among the names of shapes, if jaw or vowels open the mouth without them.

    As further terms of a sum, a tenth of each would make up for what no vowel does; articulation uses them for what
    they are.
    """
    if "jawOpen" not in names and len({*VOWELS} & {*names}) < ENOUGH_VOWELS:
        return frozenset()
    return frozenset(name for name in names if name.startswith(VISEME_PREFIX) and name not in VOWELS)


def with_channels_of(face: Face, model: Face) -> Face:
    """A face with the shapes that were added to its stand-in; they move nothing."""
    added = model.shape_names[len(face.shape_names) :]
    still = np.zeros((len(added), *face.vertices.shape), np.float32)
    return append_shapes(face, added, still, model.limits[len(face.shape_names) :])


def _shape(head: Face, name: str) -> Float32Array:
    parts = viseme_table().get(name.removeprefix(VISEME_PREFIX), {}) if name.startswith(VISEME_PREFIX) else {name: 1.0}
    moved = np.zeros(head.vertices.shape, np.float32)
    for part, weight in parts.items():
        if part in head.shape_names:
            moved += np.float32(weight) * head.shapes[head.shape_names.index(part)]
    return moved


@cache
def viseme_table() -> Mapping[str, Mapping[str, float]]:
    """Weights of ARKit's shapes in each viseme."""
    lines = files("tts2face.face").joinpath(VISEME_TABLE).read_text("utf-8").splitlines()
    table: dict[str, dict[str, float]] = {}
    for row in csv.DictReader((line for line in lines if not line.startswith("#")), delimiter="\t"):
        sides = ("Left", "Right") if row["shape"].endswith(BOTH_SIDES) else ("",)
        parts = {row["shape"].removesuffix(BOTH_SIDES) + side: float(row["weight"]) for side in sides}
        table.setdefault(row["viseme"], {}).update(parts)
    return table
