"""Build a textured head of a talker from videos."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from corpus_tools.build_talker import NOT_STATED, PROVENANCE, read_provenance
from corpus_tools.dense.adapt_head import adapt_head
from corpus_tools.dense.light_cast import remove_cast
from corpus_tools.dense.mesh_fit import (
    align_to_head,
    correct_lips_and_lids,
    face_landmarks,
    select_consistent_landmarks,
)
from corpus_tools.dense.modes import MOST_MODES, DenseModel, add_modes, dense_model, mode_fitter
from corpus_tools.dense.person_look import LookSampler, PersonLook, dress_head
from corpus_tools.dense.skin_colour import average_skin_colours, build_picture_fitter
from corpus_tools.dense.texture_painting import paint_skin
from corpus_tools.dense.video_landmarks import find_videos, resting_landmarks, track_videos
from corpus_tools.dense.visible_texels import build_canvas
from corpus_tools.recordings.corpus_video import CachedTracker
from corpus_tools.run_options import RunOptions
from lexicon.errors import InputError
from tts2face.models.face_file import read_face, write_face
from tts2face.models.landmarks import N_MESH_LANDMARKS
from tts2face.render.occlusion import bake_occlusion
from tts2face.render.scene import available_cores
from tts2face.storage.files import find_file
from tts2face.types import Progress
from tts2face.video.landmark_models import find_bundle

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
    on_progress: Progress | None = None,
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
    report = on_progress or (lambda done, of: None)
    landmarks = track_videos(videos, eyes, lambda done, of: report(done, 2 * of))
    head = read_face(find_file(SOURCE_FACE, "face"))
    talker = resting_landmarks(landmarks)
    rest = face_landmarks(head, head.vertices)[:N_MESH_LANDMARKS]
    target = align_to_head(talker, rest)
    used = np.flatnonzero(select_consistent_landmarks(rest, correct_lips_and_lids(rest, target)))
    shaped = adapt_head(head, talker)
    canvas = build_canvas(shaped)
    fit = build_picture_fitter(shaped, canvas.opened, used)
    model = dense_model(shaped, mode_fitter(shaped, used), landmarks, talker, n_modes) if n_modes else None
    sampler = LookSampler(fit)
    skin = average_skin_colours(
        shaped,
        canvas,
        fit,
        landmarks,
        on_frame=sampler.add,
        on_progress=lambda done, of: report(len(videos) + done * len(videos) // of, 2 * len(videos)),
    )
    look = sampler.look()
    skin = replace(skin, colour=remove_cast(skin.colour, look.cast, look.skin))
    face = dress_head(paint_skin(shaped, canvas, skin), look)
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
    reached = face_landmarks(shaped, shaped.vertices)[:N_MESH_LANDMARKS]
    again = align_to_head(talker, reached)
    error = float(np.linalg.norm(again - reached, axis=1)[used].mean())
    return BuiltFace(len(landmarks), len(videos), error, look, model)
