"""Training of an appearance model from tracked recordings (T07 section 2, eqs 1 and 2) in bounded memory."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from corpus_tools.appearance.frame import (
    MOUTH_LANDMARKS,
    ReferenceFrame,
    build_reference_frame,
    face_ring,
    face_triangles,
    mouth_triangles,
)
from corpus_tools.appearance.lighting import LightingCorrection, fit_lighting
from corpus_tools.appearance.pca import IncrementalPca
from corpus_tools.appearance.plate import choose_plate_frames, encode_plate_video
from corpus_tools.appearance.procrustes import align_shapes
from corpus_tools.appearance.videos import AppearanceRecording
from lexicon.errors import InputError
from tts2face.models.appearance import Appearance, Plate, TextureModel
from tts2face.models.landmarks import FACE_OVAL, MOUTH_REGION, N_MESH_LANDMARKS, lip_opening
from tts2face.types import Progress, ignore_progress

N_REFERENCE_SHAPES = 4000  # frames from which the reference shape is made
OPEN_LIP_QUANTILE = 0.9  # the reference is the mean of the frames with lip gaps above this quantile
MIN_OPEN_GAP = 0.03  # of the eye distance, from which the inner mouth is visible
TEXTURE_STRIDE = 3  # of training frames; neighbouring frames hardly differ
BLOCK_FRAMES = 128  # frames per block of the incremental PCA
N_SPARE_COMPONENTS = 20  # extra components during the incremental PCA
MAX_STILL_WEIGHT = 0.02  # pixels with less change by speech are used to estimate lighting
N_LIGHTING_FRAMES = 25  # from which a recording's lighting is estimated
SIDE_PX, MOUTH_SIDE_PX = 128, 64  # longer sides of the textures
N_MODES, N_MOUTH_MODES = 40, 20  # components of the textures
N_SMOOTHINGS = 4  # smoothing steps of the speech weights over the mesh


@dataclass(frozen=True, slots=True, eq=False)
class LearnedAppearance:
    """An appearance model and results of its training.

    ``frames`` and ``lights`` belong to the textures; ``parameters`` holds the appearance parameters (T, A + B) of each
    recording; ``explained_variance`` the share of the variance in the first 1, 2, ... modes of the face and the mouth.
    """

    appearance: Appearance
    frames: tuple[ReferenceFrame, ReferenceFrame]
    lights: "LightingReference"
    parameters: tuple[NDArray[np.float32], ...]
    explained_variance: tuple[NDArray[np.float64], NDArray[np.float64]]


def learn_appearance(
    recordings: Sequence[AppearanceRecording],
    *,
    on_progress: Progress = ignore_progress,
) -> LearnedAppearance:
    """Texture models of the face and of the inner mouth, the plate, and the appearance parameters of every frame.

    Raises
    ------
    InputError
        There is no recording, or too few frames for the modes.
    """
    if not recordings:
        raise InputError("no recording could be used; give at least one")
    frames = reference_frames(recordings)
    moving = speech_weights(frames[0])
    stretch = choose_plate_frames([recording.points for recording in recordings])
    lights = LightingReference(frames[0], mean_texture(recordings[stretch[0]], frames[0]), moving < MAX_STILL_WEIGHT)
    grown = IncrementalPca(N_MODES + N_SPARE_COMPONENTS), IncrementalPca(N_MOUTH_MODES + N_SPARE_COMPONENTS)
    steps, found = 2 * len(recordings), []
    for number, recording in enumerate(recordings):
        found.append(lights.of(recording))
        _add_textures(recording, frames, found[-1], grown)
        on_progress(number + 1, steps)
    models = (
        _build_texture_model(frames[0], grown[0], N_MODES, "the face"),
        _build_texture_model(frames[1], grown[1], N_MOUTH_MODES, "the inside of the mouth"),
    )
    parameters = []
    for number, (recording, light) in enumerate(zip(recordings, found, strict=True)):
        parameters.append(appearance_parameters(recording, frames, light, models))
        on_progress(len(recordings) + number + 1, steps)
    plate = _build_plate(recordings, stretch, parameters, models[0].n_modes)
    appearance = Appearance(models[0], models[1], np.array(MOUTH_LANDMARKS, np.int32), moving, plate)
    return LearnedAppearance(
        appearance, frames, lights, tuple(parameters), (grown[0].explained_variance(), grown[1].explained_variance())
    )


@dataclass(frozen=True, slots=True, eq=False)
class LightingReference:
    """Reference lighting of the textures: that of the plate, whose mean ``texture`` (P, 3) this is.

    ``still`` (P,) marks the pixels of the face's ``frame`` that speech leaves.
    """

    frame: ReferenceFrame
    texture: NDArray[np.float32]
    is_still: NDArray[np.bool_]

    def of(self, recording: AppearanceRecording) -> LightingCorrection:
        """The light of a recording."""
        return fit_lighting(mean_texture(recording, self.frame), self.texture, self.is_still)


def mean_texture(recording: AppearanceRecording, frame: ReferenceFrame) -> NDArray[np.float32]:
    """(P, 3) mean of the first textures of a recording."""
    pictures = islice(recording.pictures(), N_LIGHTING_FRAMES)
    textures = [frame.texture(picture, points) for picture, points in zip(pictures, recording.points, strict=False)]
    return np.asarray(np.mean(textures, axis=0), np.float32)


def reference_frames(
    recordings: Sequence[AppearanceRecording],
) -> tuple[ReferenceFrame, ReferenceFrame]:
    """Reference frames of the face and of the inner mouth: the mean of the frames with lips well apart."""
    n_frames = sum(len(recording.points) for recording in recordings)
    every = max(1, n_frames // N_REFERENCE_SHAPES)
    points = np.concatenate([recording.points for recording in recordings])[::every]
    shapes, _ = align_shapes(points[:, :N_MESH_LANDMARKS])
    gaps = lip_opening(shapes)
    opened = shapes[gaps >= np.quantile(gaps, OPEN_LIP_QUANTILE)].mean(axis=0)
    face = build_reference_frame(opened, face_triangles(opened), SIDE_PX)
    return face, build_reference_frame(opened[list(MOUTH_LANDMARKS)], mouth_triangles(), MOUTH_SIDE_PX)


def _add_textures(
    recording: AppearanceRecording,
    frames: tuple[ReferenceFrame, ReferenceFrame],
    light: LightingCorrection,
    grown: tuple[IncrementalPca, IncrementalPca],
) -> None:
    gaps = lip_opening(recording.points)
    faces, mouths = [], []
    for number, picture in enumerate(recording.pictures()):
        points = recording.points[number]
        if number % TEXTURE_STRIDE == 0:
            faces.append(light.apply(frames[0].texture(picture, points)).ravel())
        if gaps[number] >= MIN_OPEN_GAP:
            mouths.append(light.apply(frames[1].texture(picture, points[list(MOUTH_LANDMARKS)])).ravel())
        for rows, components in ((faces, grown[0]), (mouths, grown[1])):
            if len(rows) >= BLOCK_FRAMES:
                components.add(np.array(rows))
                rows.clear()
    for rows, components in ((faces, grown[0]), (mouths, grown[1])):
        if rows:
            components.add(np.array(rows))


def _build_texture_model(frame: ReferenceFrame, grown: IncrementalPca, n_modes: int, what: str) -> TextureModel:
    if len(grown.basis) < n_modes:
        raise InputError(f"{grown.n_rows} pictures of {what} have no {n_modes} modes; record more, or request fewer")
    n_pixels = len(frame.pixels)
    return TextureModel(
        reference=frame.points,
        triangles=frame.triangles,
        size=frame.size,
        pixels=frame.pixels,
        mean=grown.mean.reshape(n_pixels, 3),
        basis=grown.basis[:n_modes].reshape(n_modes, n_pixels, 3),
        spread=grown.spread()[:n_modes].astype(np.float32),
    )


def appearance_parameters(
    recording: AppearanceRecording,
    frames: tuple[ReferenceFrame, ReferenceFrame],
    light: LightingCorrection,
    models: tuple[TextureModel, TextureModel],
) -> NDArray[np.float32]:
    """(T, A + B) appearance parameters of a recording; those of a hidden mouth are interpolated linearly."""
    face, mouth = frames
    n_frames, n_face = len(recording.points), models[0].n_modes
    parameters = np.zeros((n_frames, n_face + models[1].n_modes), np.float32)
    seen = lip_opening(recording.points) >= MIN_OPEN_GAP
    for number, picture in enumerate(recording.pictures()):
        points = recording.points[number]
        parameters[number, :n_face] = models[0].parameters(light.apply(face.texture(picture, points))[None])[0]
        if seen[number]:
            inner = light.apply(mouth.texture(picture, points[list(MOUTH_LANDMARKS)]))
            parameters[number, n_face:] = models[1].parameters(inner[None])[0]
    if seen.any():
        for column in range(n_face, parameters.shape[1]):
            parameters[:, column] = np.interp(np.arange(n_frames), np.flatnonzero(seen), parameters[seen, column])
    return parameters


def speech_weights(face: ReferenceFrame) -> NDArray[np.float32]:
    """(P,) how far each pixel of the face's texture follows speech: 1 about the mouth, 0 on the oval and above."""
    weight = np.isin(np.arange(N_MESH_LANDMARKS), MOUTH_REGION).astype(np.float64)
    weight[list(FACE_OVAL)] = 0.0
    ends = np.concatenate([face.triangles[:, [0, 1]], face.triangles[:, [1, 2]], face.triangles[:, [2, 0]]])
    for _ in range(N_SMOOTHINGS):
        total, count = weight.copy(), np.ones(N_MESH_LANDMARKS)
        for here, there in (ends.T, ends.T[::-1]):
            np.add.at(total, here, weight[there])
            np.add.at(count, here, 1.0)
        weight = total / count
        weight[list(FACE_OVAL)] = 0.0
    weight = np.minimum(weight / np.quantile(weight[list(MOUTH_LANDMARKS)], 0.1), 1.0)
    spread: NDArray[np.float32] = (weight[face.corners] * face.weights).sum(axis=1).astype(np.float32)
    return spread


def _build_plate(
    recordings: Sequence[AppearanceRecording],
    stretch: tuple[int, int, int],
    parameters: Sequence[NDArray[np.float32]],
    n_face: int,
) -> Plate:
    number, first, last = stretch
    recording, here = recordings[number], slice(first, last)
    points = recording.points[here, :N_MESH_LANDMARKS]
    return Plate(
        video=encode_plate_video(islice(recording.pictures(), first, last)),
        points=np.concatenate([points, face_ring(points)], axis=1).astype(np.float32),
        axes=camera_axes(recording.points[here], recording.landmarks[here]),
        shape=recording.shape[here],
        texture_parameters=parameters[number][here, :n_face],
    )


def camera_axes(points: NDArray[np.floating], landmarks: NDArray[np.floating]) -> NDArray[np.float32]:
    """(T, 2, 3) pixels for each millimetre along the landmarks' axes: the camera without perspective, least squares."""
    seen = points - points.mean(axis=1, keepdims=True)
    local = landmarks - landmarks.mean(axis=1, keepdims=True)
    axes = [np.linalg.lstsq(shape, picture, rcond=None)[0].T for shape, picture in zip(local, seen, strict=True)]
    return np.array(axes, np.float32)
