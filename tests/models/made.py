"""Small synthetic model files: a face with lips, a palette, a talker, and a talker with an appearance."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tests.corpus_tools.gesture_study.made_palette import made_palette
from tests.picture.tiny_face import tiny_face
from tests.picture.tiny_talker import own_talker
from tts2face.models.audio_map import FEATURE_SIZES, AudioMap
from tts2face.models.face_file import Identity, write_face
from tts2face.models.palette_file import write_palette
from tts2face.models.phone_network import N_PHONES_SEEN, N_PLACE, PhoneNetwork
from tts2face.models.talker import Talker, Utterance
from tts2face.models.talker_file import write_talker

INVENTORY = ("i", "m", "p", "s", SILENCE, "ɑ")


def write_made_models(folder: Path, words: bytes) -> dict[str, Path]:
    """Files of a talker, a face, a palette and a dictionary with the given lines, by their kinds."""
    paths = {kind: folder / f"made.{kind}" for kind in ("talker", "face", "palette", "dictionary")}
    write_made_talker(paths["talker"], has_face=False)
    write_made_face(paths["face"])
    write_made_palette(paths["palette"])
    paths["dictionary"].write_bytes(words)
    return paths


def write_made_face(path: Path) -> None:
    """A ball with eyes, all landmarks on its skin, two speech shapes and an identity."""
    face, rng = tiny_face(textured=True), np.random.default_rng(5)
    skin = face.triangles[: face.parts[0].count]
    weights = rng.dirichlet(np.ones(3), 478).astype(np.float32)
    landmarks = {
        "landmarks": np.arange(478, dtype=np.int32),
        "landmark_vertices": skin[rng.integers(0, len(skin), 478)],
        "landmark_weights": weights / weights.sum(axis=1, keepdims=True),
    }
    older = Identity(np.ones_like(face.vertices), {"skin": (0.5, 0.75, 1.0)}, "another")
    write_face(path, replace(face, **landmarks), {"older": older})


def write_made_palette(path: Path) -> None:
    """Two styles with motion of head, brows and lids."""
    write_palette(path, made_palette(10))


def write_made_talker(path: Path, *, has_face: bool) -> None:
    """Six utterances of random shapes, a network, an audio map; with `has_face` an appearance model."""
    rng = np.random.default_rng(6)
    talker = own_talker(has_face=has_face)
    n_looks = 0 if talker.appearance is None else len(talker.appearance.channels)
    utterances = []
    for number in range(6):
        labels = [SILENCE, *rng.permutation([label for label in INVENTORY if label != SILENCE]), SILENCE]
        phones = PhoneSequence([str(label) for label in labels], np.arange(len(labels) + 1) * 0.12)
        n_frames = int(phones.end * talker.fps)
        shape = rng.normal(0.0, 1.0, (n_frames, 3)).astype(np.float32)
        head, looks = np.zeros((n_frames, 6), np.float32), rng.normal(0.0, 5.0, (n_frames, n_looks))
        seen = looks.astype(np.float32) if n_looks else None
        word = WordSpan("word", 1, len(labels) - 1)
        utterances.append(Utterance(f"u{number}", phones, (word,), shape, head, head[:, 0], seen))
    sizes = (N_PHONES_SEEN * len(INVENTORY) + N_PLACE, 4, 2)
    layers = [rng.normal(0, 0.1, (2, a, b)).astype(np.float32) for a, b in pairwise(sizes)]
    network = PhoneNetwork(INVENTORY, tuple(layers), tuple(layer[:, 0] for layer in layers))
    n = FEATURE_SIZES["mfcc"]
    weights = [rng.normal(0, 0.1, size).astype(np.float32) for size in ((4, 3 * n), (2, 4), (4,), (2,))]
    scale = np.zeros(n, np.float32), np.ones(n, np.float32)
    audio_map = AudioMap("mfcc", 1, 1, *scale, tuple(weights[:2]), tuple(weights[2:]), "tanh")
    metadata = {"name": "Ada", "refused": [["u9", "no face"]], "phones_recognised": ["u1"]}
    written = Talker(
        talker.fps, talker.model, tuple(utterances), metadata, talker.appearance, network, {"linear": audio_map}
    )
    write_talker(path, written)
