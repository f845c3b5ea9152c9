"""Fit of how the light of vertices answers to the terms of a pose (`tts2face.picture.baked.response`)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from corpus_tools.shipped.film.pose_light import PoseLight
from corpus_tools.shipped.film.seen_triangles import mouth_middle
from tts2face.face.deformation import build_rig
from tts2face.models.baked_light import LIMIT_STEP
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, IntArray, smoothstep
from tts2face.picture.baked.response import LightTerms, still_eyes

EYE_MM, MOUTH_MM = (32.0, 26.0, 60.0), (34.0, 24.0, 48.0)  # around them vertices may lie across lids or lips
JAW_SHARE, LID_SHARE = 0.5, 0.35  # of the most that a vertex moves with the jaw or a blink: it lies on what moves
PART_SHARE = 0.3  # of that, by which it parts from its partner


def pose_terms(
    face: Face, poses: PoseLight, numbers: IntArray, rows: tuple[Any, Any, Any]
) -> tuple[FloatArray, FloatArray]:
    """Terms (P, T, N) of lit vertices, which are given with their partners, and (P, 6, M) of the mouth's, in poses."""
    rig = build_rig(face)
    made = LightTerms.of_rows(face, rig, *rows)
    buffers = made.allocate_buffers()
    found: tuple[list[Any], list[Any]] = ([], [])
    for number in numbers:
        points = rig.deform(poses.weights[number])
        still_eyes(face, points)
        made.update(points, buffers)
        found[0].append(buffers.terms.copy())
        found[1].append(buffers.mouth.copy())
    return np.array(found[0], np.float64), np.array(found[1], np.float64)


def fit_responses(
    terms: FloatArray,
    changes: FloatArray,
    weights: NDArray[np.floating],
    ridge: float,
    groups: NDArray[np.str_] | None = None,
) -> FloatArray:
    """(T, 3, N) responses of vertices to terms (P, T, N) by which their light has changes (P, N, 3).

    Poses count by weights (P, N). Responses are kept near 0, or near those of a group (N,).
    """
    gram = np.einsum("ptn,pn,psn->nts", terms, weights, terms, optimize=True)
    moments = np.einsum("ptn,pn,pnc->ntc", terms, weights, changes, optimize=True)
    usual = np.zeros_like(moments)
    keep = ridge * np.eye(gram.shape[1])
    for name in [] if groups is None else np.unique(groups):
        own = groups == name
        usual[own] = np.linalg.solve(gram[own].sum(axis=0) + keep, moments[own].sum(axis=0))
    responses: FloatArray = usual + np.linalg.solve(gram + keep, moments - gram @ usual)
    return responses.transpose(1, 2, 0)


def limits_of(changes: FloatArray, shown: NDArray[np.bool_]) -> NDArray[np.int8]:
    """(2, 3, N) least and most of changes (P, N, 3) and 0 in the poses that show a vertex (P, N), in steps."""
    held = shown | ~shown.any(axis=0)
    found = [np.where(held[..., None], changes, 0.0).min(axis=0), np.where(held[..., None], changes, 0.0).max(axis=0)]
    steps: NDArray[np.int8] = np.clip(np.rint(np.array(found) / LIMIT_STEP), -127, 127).astype(np.int8)
    return steps.transpose(0, 2, 1)


def find_partners(face: Face, rows: NDArray[np.int32], skin: IntArray, balls: IntArray) -> NDArray[np.int32]:
    """(N,) vertex of the skin across the lips or lids from each vertex (N,); itself where there is none."""
    shapes = {name: face.shapes[number].astype(np.float64) for number, name in enumerate(face.shape_names)}
    mouth, *eyes = feature_zones(face)
    at_mouth, at_eyes = (nearness(face.vertices, zones) > 0 for zones in ([mouth], eyes))
    found = np.arange(len(face.vertices))
    is_ball = np.isin(found, balls)
    for zone, opens, share in (
        (at_mouth, shapes["jawOpen"], JAW_SHARE),
        (at_eyes & ~at_mouth, shapes["eyeBlinkLeft"] + shapes["eyeBlinkRight"], LID_SHARE),
    ):
        away = np.abs(opens[:, 1])
        moves = away > share * away.max()
        for side in (False, True):
            across = skin[(zone & (moves != side))[skin]]
            own = np.flatnonzero(zone & (moves == side) & ~is_ball)
            nearest = across[cKDTree(face.vertices[across]).query(face.vertices[own])[1]]
            parts = np.abs(away[own] - away[nearest]) > PART_SHARE * away.max()
            found[own[parts]] = nearest[parts]
        if zone is not at_mouth:
            upper = skin[(zone & moves)[skin]]
            found[balls] = upper[cKDTree(face.vertices[upper]).query(face.vertices[balls])[1]]
    return found[rows].astype(np.int32)


def feature_zones(face: Face) -> list[tuple[Any, Any]]:
    """Centres and half sizes, mm, of the mouth and of each eye."""
    return [(mouth_middle(face), MOUTH_MM), *((eye.centre, EYE_MM) for eye in face.eyes)]


def nearness(places: NDArray[np.floating], zones: Sequence[tuple[Any, Any]]) -> FloatArray:
    """(N,) 1 in the middle of zones, each a centre and half sizes, and 0 outside them, of places (N, 3)."""
    off = np.min([np.linalg.norm((places - centre) / np.array(size), axis=1) for centre, size in zones], axis=0)
    near: FloatArray = 1 - smoothstep(off.astype(np.float64), 0.75, 1.0)
    return near
