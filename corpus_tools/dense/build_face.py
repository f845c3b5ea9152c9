"""Build a textured head of a talker from videos."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.adapt_head import adapt_head
from corpus_tools.dense.glasses import covered_skin, find_glasses, wear_glasses
from corpus_tools.dense.light_colour import remove_cast, skin_texture
from corpus_tools.dense.mesh_fit import (
    align_to_head,
    correct_lips_and_lids,
    face_landmarks,
    select_consistent_landmarks,
)
from corpus_tools.dense.modes import MOST_MODES, DenseModel, add_modes, dense_model, mode_fitter
from corpus_tools.dense.person_look import AS_SEEN, LookChoices, LookSampler, PersonLook, dress_head
from corpus_tools.dense.skin_canvas import build_canvas
from corpus_tools.dense.skin_colour import average_skin_colours, build_picture_fitter
from corpus_tools.dense.texture import paint_skin, without_covered
from corpus_tools.dense.tracked_pictures import TrackedPictures, find_videos, resting_landmarks, track_videos
from corpus_tools.recordings.provenance import PROVENANCE, read_provenance
from corpus_tools.recordings.video import CachedTracker
from corpus_tools.run_options import RunOptions
from lexicon.errors import InputError
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.landmarks import N_MESH_LANDMARKS
from tts2face.models.talker import NOT_STATED
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.occlusion import bake_occlusion
from tts2face.processes.threads import available_cores
from tts2face.storage.shipped import find_file
from tts2face.types import Progress, ignore_progress
from tts2face.video.networks import LandmarkNetwork, find_bundle, find_segmenter

LEAST_SEEN = 1e-6  # weight of what hair hides
AROUND_GLOSS = 30.0  # texels, Gaussian, about 5 mm, whose colours lie under gloss
SOURCE_FACE = "head"  # the shipped face that is adapted
CONTENT = "a head with the shape and, with the stated consent, the skin of a real person"


@dataclass(frozen=True, slots=True, eq=False)
class BuiltFace:
    """Result of a build: videos used and found, mean distance of the landmarks from the talker's, look, dense model."""

    n_videos: int
    n_found: int
    error_mm: float
    look: PersonLook
    model: DenseModel | None = None


def build_face(
    recordings: Path,
    out: Path,
    *,
    consent: Mapping[str, str],
    n_modes: int = 0,
    run_options: RunOptions | None = None,
    on_progress: Progress = ignore_progress,
) -> BuiltFace:
    """Adapt the default head to the talker in videos, and write it as a face.

    Parameters
    ----------
    recordings
        A folder of recordings, or one video; transcripts are not needed. A ``provenance.json`` in the folder states the
        licence of the person's likeness, which that of the mesh does not cover.
    consent
        Consent of the person shown, from `tts2face.models.consent.consent_record`; kept in the file.
    n_modes
        Modes of the talker's own dense shape model, added as the shapes denseMean, dense1, dense2, ...
    run_options
        Cache folder and landmark models; one process is used.
    on_progress
        Called with the number of finished steps and of all steps, two for each video.

    Raises
    ------
    InputError
        There is no video, or too few frames for the modes.
    DataError
        No video shows a face, or the provenance cannot be read.
    BackendError
        A package or the landmark models are missing, or the file cannot be written.
    """
    if not 0 <= n_modes <= MOST_MODES:
        raise InputError(f"a basis has 0 to {MOST_MODES} dense modes, not {n_modes}")
    run_options = run_options or RunOptions()
    videos = find_videos(recordings)
    stated = read_provenance(recordings / PROVENANCE, must_exist=False)
    eyes = CachedTracker(run_options.folder(), find_bundle(run_options.model))
    landmarks = track_videos(videos, eyes, lambda done, of: on_progress(done, 2 * of))
    head = read_face(find_file(SOURCE_FACE, "face"))
    fitted = fit_person(head, resting_landmarks(landmarks))
    model = None
    if n_modes:
        mode = mode_fitter(fitted.shaped, fitted.used)
        model = dense_model(fitted.shaped, mode, landmarks, fitted.person, n_modes)
    face, look = paint_person(
        fitted,
        landmarks,
        lambda done, of: on_progress(len(videos) + done * len(videos) // of, 2 * len(videos)),
        model=run_options.model,
    )
    words = ["tts2face", "corpus", "face", recordings.name, "--out", out.name]
    metadata = {
        **head.metadata,
        "name": consent["name"],
        "licence": f"mesh: {head.metadata['licence']}; likeness of the person: {stated.get('licence', NOT_STATED)}",
        "attribution": "; ".join(filter(None, [head.metadata["attribution"], stated.get("attribution")])),
        "content": CONTENT,
        "look": look.summary(),
        "consent": dict(consent),
        "command": shlex.join([*words, *(["--basis", str(n_modes)] if n_modes else [])]),
        "created": datetime.now(UTC).date().isoformat(),
    }
    if model is not None:
        face, metadata = add_modes(face, model), {**metadata, "dense": model.summary()}
    write_face(out, bake_occlusion(replace(face, metadata=metadata), available_cores()))
    return BuiltFace(len(landmarks), len(videos), fitted.error_mm(), look, model)


@dataclass(frozen=True, slots=True, eq=False)
class FittedHead:
    """The head in the shape of a person with landmarks (468 or more, 3) at rest, and those that it was fitted to."""

    shaped: Face
    person: FloatArray
    used: NDArray[np.int64]

    def error_mm(self) -> float:
        """Mean distance of the head's landmarks from the person's."""
        reached = face_landmarks(self.shaped, self.shaped.vertices)[:N_MESH_LANDMARKS]
        again = align_to_head(self.person, reached)
        return float(np.linalg.norm(again - reached, axis=1)[self.used].mean())


def fit_person(head: Face, person: FloatArray) -> FittedHead:
    """The head in the shape of a person whose landmarks (468 or more, 3) at rest have any size."""
    rest = face_landmarks(head, head.vertices)[:N_MESH_LANDMARKS]
    target = correct_lips_and_lids(rest, align_to_head(person, rest))
    return FittedHead(adapt_head(head, person), person, np.flatnonzero(select_consistent_landmarks(rest, target)))


def paint_person(
    fitted: FittedHead,
    seen: Sequence[TrackedPictures],
    on_progress: Progress,
    choices: LookChoices = AS_SEEN,
    *,
    model: Path | None = None,
) -> tuple[Face, PersonLook]:
    """The head with the skin, eyes, hair and shirt that frames show, and what was found or chosen.

    `model` is the bundle of landmark models beside which the network lies that reads persons; found if None.
    """
    canvas = build_canvas(fitted.shaped)
    seen_vertices = np.unique(canvas.texels.corners[canvas.share > 0])
    fit = build_picture_fitter(fitted.shaped, canvas.opened, fitted.used, seen_vertices)
    segmenter = find_segmenter(model)
    sampler = LookSampler(fit, None if segmenter is None else LandmarkNetwork(segmenter.read_bytes()))
    skin = average_skin_colours(fitted.shaped, canvas, fit, seen, on_frame=sampler.add, on_progress=on_progress)
    look = choices.applied(sampler.look())
    shown, side = canvas.texels.at(skin.rows), len(canvas.texture)

    def blurred(values: FloatArray, spread: float = AROUND_GLOSS) -> FloatArray:
        return shown.blurred(values, side, spread)

    surface = shown.interpolate(fitted.shaped.vertices.astype(np.float64))
    places, free = surface[:, :2], ~sampler.under_hair(surface)
    skin = replace(skin, weight=skin.weight * np.maximum(free, LEAST_SEEN))
    glasses = find_glasses(places, skin.colour, fit.marks)
    if glasses is not None:
        look = replace(look, notes=(*look.notes, "glasses"))
        skin = replace(skin, colour=without_covered(skin.colour, covered_skin(glasses, places), blurred))
    clean = remove_cast(skin.colour, look.cast, look.skin)
    skin = replace(skin, colour=skin_texture(clean, blurred))
    painted = paint_skin(fitted.shaped, canvas, skin, keeps_lines=choices.keeps_lines)
    dressed = dress_head(painted, look)
    return dressed if glasses is None or not choices.wears_glasses else wear_glasses(dressed, glasses), look
