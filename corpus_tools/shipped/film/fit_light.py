"""Fit of a face's light to the path tracer's light of its poses."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from corpus_tools.shipped.film.fit_responses import (
    feature_zones,
    find_partners,
    fit_responses,
    limits_of,
    nearness,
    pose_terms,
)
from corpus_tools.shipped.film.look import WHITE, Look
from corpus_tools.shipped.film.pose_light import CAMERA_YAWS_DEG, FAR, MOUTH, SKIN, PoseLight
from corpus_tools.shipped.film.seen_triangles import seen_triangles, shown_skin
from corpus_tools.shipped.film.texel_light import (
    SKIN_LIT,
    STEP,
    TURN_SIDE,
    camera_changes,
    drawn_texels,
    relit_skin,
    rest_pages,
    tint_of,
    turn_changes,
)
from corpus_tools.shipped.head.eyes import EyeStyle
from tts2face.face.deformation import build_rig
from tts2face.models.baked_light import N_BALL_TERMS, BakedLight, HairLight, quantised
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, IntArray, smoothstep
from tts2face.picture.surface import weld_groups

N_TURN_MODES, HAIRCUT_TURN_MODES = 10, 4
RIDGE, MOUTH_RIDGE = 0.003, 0.1  # of responses
HIDDEN_WEIGHT, MOUTH_HIDDEN_WEIGHT = 0.02, 0.002  # of a pose that hides a vertex
MOST_SHARE = 99.9  # per cent of the responses that are not cut off
LEAST_CHANGE, CLEAR_CHANGE = 2.0, 5.0  # of 255: skin that changes less in every pose keeps its light
CHANGE_ROUNDS = 4  # of neighbours over which that fades
COLOUR_ROUNDS, TONE_SHARE = 4, 0.5  # of neighbours by which coloured noise, and that of the tone, is smoothed
UNCOVERED_BLUR, BEYOND_TEXELS = 1.0, 1  # over which the light of what other poses uncover fades, and goes on
SMALL_ROUNDS = 3  # of neighbours over which the light of small parts is averaged: teeth else are striped
METAL, METAL_LIT = ("stud", "glasses"), 0.5  # and the share of its median below which its light is that of its back
BALL_LIT = 0.45  # of the light in front below which a vertex of an eyeball lies under the lid


def fit_light(face: Face, poses: PoseLight, look: Look, eyes: EyeStyle) -> BakedLight:
    """Light of a face from that of its poses."""
    part_of = vertex_parts(face)
    still = np.flatnonzero(~poses.heads.any(axis=1))
    shown, texels = shown_skin(face, poses, still, _corners(face, SKIN), poses.skin.shape[1])
    small_rows = np.flatnonzero(np.isin(part_of, np.unique(part_of[poses.rows])))
    of_mouth = np.array([name.startswith(MOUTH) for name in part_of[small_rows]])
    of_ball = np.isin(part_of[small_rows], ("sclera", "iris"))
    others = small_rows[~of_mouth & ~of_ball]
    mouth_rows, ball_rows = small_rows[of_mouth], small_rows[of_ball]
    base_map = _base_map(poses, still, texels)
    skin_rows, skin = _skin_changes(face, poses, still, shown, base_map[0])
    small = _smoothed_small(face, poses, still, small_rows, part_of[small_rows], shown)
    plain = small[:, ~of_mouth & ~of_ball] * 255
    mouth = small[:, of_mouth] * 255
    balls = np.stack([_lit_balls(face, ball_rows, light) for light in small[:, of_ball] / WHITE])
    rows = np.concatenate([skin_rows, others]).astype(np.int32)
    lit = np.concatenate([rows, ball_rows]).astype(np.int32)
    partners = find_partners(face, lit, np.unique(_corners(face, SKIN)), ball_rows)
    terms, mouth_terms = pose_terms(face, poses, still, (lit, partners, mouth_rows.astype(np.int32)))
    n = len(rows)
    changes = np.concatenate([skin, plain - plain[:1]], axis=1)
    found = fit_responses(terms[:, :, :n], changes, shown[:, rows] + HIDDEN_WEIGHT, RIDGE)
    found[0, :, shown[0, rows]] = 0.0  # what is seen at rest is as it was baked there, with more samples
    responses, sizes = quantised(found, MOST_SHARE)
    mouth_seen = shown[:, mouth_rows] + MOUTH_HIDDEN_WEIGHT
    mouth_base = np.rint(np.clip(np.einsum("pn,pnc->nc", mouth_seen / mouth_seen.sum(axis=0), mouth), 0, 255))
    in_mouth = fit_responses(mouth_terms, mouth - mouth_base, mouth_seen, MOUTH_RIDGE, groups=part_of[mouth_rows])
    mouth_responses, mouth_sizes = quantised(in_mouth, MOST_SHARE)
    of_lids = fit_responses(terms[:, -N_BALL_TERMS:, n:], balls - balls[:1], np.ones(balls.shape[:2]), RIDGE)
    ball_responses, ball_sizes = quantised(of_lids, MOST_SHARE)
    return BakedLight(
        **_light_in_texels(face, (poses, poses), base_map[1:], N_TURN_MODES),
        page_of={name: page for page, names in enumerate((SKIN, FAR)) for name in names},
        rows=rows,
        base=np.rint(np.clip(np.concatenate([np.zeros((len(skin_rows), 3)), plain[0]]), 0, 255)).astype(np.uint8),
        responses=responses,
        response_sizes=sizes,
        limits=limits_of(changes, shown[:, rows]),
        partners=partners,
        mouth_rows=mouth_rows.astype(np.int32),
        mouth_base=mouth_base.astype(np.uint8),
        mouth_responses=mouth_responses,
        mouth_sizes=mouth_sizes,
        mouth_limits=limits_of(mouth - mouth_base, shown[:, mouth_rows]),
        ball_rows=ball_rows.astype(np.int32),
        ball_base=balls[0].astype(np.float32),
        ball_responses=ball_responses,
        ball_sizes=ball_sizes,
        lamps=poses.lamps,
        head_lamps=sum(lamp.follows_head for lamp in look.lamps.values()),
        sky=(np.array(look.sky) * look.sky_strength).astype(np.float32),
        eye_gain=look.eye.gain,
        eye_edges=np.array([eyes.pupil, eyes.iris], np.float32),
        view=np.rint(poses.view * 255).astype(np.uint8),
        backdrop=poses.backdrop,
    )


def fit_haircut(faces: tuple[Face, Face], own: PoseLight, worn: PoseLight, light: BakedLight) -> HairLight:
    """Light of a face with another haircut, baked at rest and in turns of the head.

    `faces` are with its own hair and the other; `own` and `light` are of the first, of whose skin, in expressions, the
    other has the light.
    """
    plain, face = faces
    part_of = vertex_parts(face)
    still = np.flatnonzero(~own.heads.any(axis=1))
    side = own.skin.shape[1]
    shown, texels = shown_skin(plain, own, still, _corners(plain, SKIN), side)
    texels[0] |= shown_skin(face, own, still[:1], _corners(face, SKIN), side)[1][0]  # what neither hair covers
    is_small = ~np.isin(part_of[light.rows], SKIN)
    rows = light.rows[is_small].astype(np.int64)
    small = _smoothed_small(face, worn, np.array([0]), rows, part_of[rows], shown[:1])
    base = light.base.copy()
    base[is_small] = np.rint(np.clip(small[0] * 255, 0, 255))
    found = _light_in_texels(face, (own, worn), _base_map(own, still, texels)[1:], HAIRCUT_TURN_MODES, light)
    return HairLight(base=base, **found)


def _light_in_texels(
    face: Face,
    poses: tuple[PoseLight, PoseLight],
    uncovered: tuple[FloatArray, FloatArray],
    number: int,
    light: BakedLight | None = None,
) -> dict[str, Any]:
    """All that depends on the haircut, but for the light of vertices, by the names of `HairLight`.

    The first of `poses` has those in which triangles are seen, the second the light; `uncovered` is the share (s, s)
    and light (s, s, 3) of what other poses uncover, `number` that of the modes of turns. With `light`, that of the face
    with its own hair, the skin's changes from cameras are those beside its changes.
    """
    own, worn = poses
    triangles, is_inside = seen_triangles(face, own)
    drawn = drawn_texels(face, triangles)
    turns, turn_modes, from_turns = turn_changes(worn, drawn, number)
    changes = camera_changes(worn, drawn)
    if light is not None:
        skin = changes[:, :, : TURN_SIDE**2]
        skin -= light.camera_sizes[:, None, None] * light.camera_modes[:, :, : TURN_SIDE**2]
        skin *= relit_skin(own, worn)
    cameras, camera_sizes = quantised(changes, least=STEP)
    return {
        "pages": rest_pages(worn, *uncovered),
        "triangles": triangles,
        "is_inside": is_inside,
        "turns_deg": turns.astype(np.float32),
        "turn_weights": from_turns,
        "turn_modes": turn_modes,
        "camera_yaws_deg": np.array(CAMERA_YAWS_DEG, np.float32),
        "camera_modes": cameras,
        "camera_sizes": camera_sizes,
        "tint": tint_of(worn),
    }


def vertex_parts(face: Face) -> NDArray[np.str_]:
    """(V,) name of the part of each vertex."""
    found = np.full(len(face.vertices), "", dtype="U32")
    for part in face.parts:
        found[face.triangles[part.first : part.first + part.count]] = part.name
    return found


def _skin_changes(
    face: Face, poses: PoseLight, numbers: IntArray, shown: NDArray[np.bool_], base: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Vertices (N,) of skin whose light changes with expressions, and the changes (P, N, 3) from a base map (s, s, 3).

    They are kept where they are clear in poses that show them (P, V); what no pose shows does not change.
    """
    corners = _corners(face, SKIN)
    used = np.unique(corners)
    light = read_maps(np.concatenate([base[None], poses.skin[numbers]]), _uv(face)[used]) * 255
    changes = light[1:] - light[:1]
    near = neighbours(np.searchsorted(used, corners), face.vertices[used])
    mean = changes.mean(axis=0)  # has the noise of the base, and is no noise of the poses
    tone = (changes - mean).mean(axis=2, keepdims=True)
    colour = changes - mean - tone
    away = 1 - nearness(face.vertices[used], feature_zones(face))[:, None]
    tone += TONE_SHARE * away * (np.stack([near @ item for item in tone]) - tone)
    for turn in range(COLOUR_ROUNDS):
        smooth = np.stack([near @ item for item in colour])
        colour += (1.0 if turn == 0 else away) * (smooth - colour)
    changes = mean + tone + colour
    changes[:, ~shown[:, used].any(axis=0)] = 0.0
    strength = (np.abs(changes) * shown[:, used, None]).max(axis=(0, 2))
    share = smoothstep(strength, LEAST_CHANGE, CLEAR_CHANGE)
    for _ in range(CHANGE_ROUNDS):
        share = near @ share
    changes *= share[:, None]
    kept = share > 0.02
    return used[kept], changes[:, kept]


def neighbours(triangles: IntArray, places: NDArray[np.floating]) -> Any:
    """(N, N) means over the neighbours of vertices; those at one place are neighbours."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    n = len(places)
    _, group = np.unique(np.rint(1000 * places).astype(np.int64), axis=0, return_inverse=True)
    joined = sparse.coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    weld = sparse.coo_matrix((np.ones(n), (np.arange(n), group.ravel())), shape=(n, int(group.max()) + 1)).tocsr()
    among = weld.T @ (joined + joined.T) @ weld + sparse.identity(weld.shape[1])
    among.data[:] = 1
    mean = sparse.diags(1 / np.asarray(among.sum(axis=1)).ravel()) @ among
    return weld @ mean @ sparse.diags(1 / np.asarray(weld.sum(axis=0)).ravel()) @ weld.T


def _uv(face: Face) -> NDArray[np.float32]:
    return np.zeros((len(face.vertices), 2), np.float32) if face.uv is None else face.uv


def read_maps(maps: NDArray[np.floating], uv: NDArray[np.floating]) -> FloatArray:
    """(P, N, 3) values of maps (P, S, S, 3) at texture coordinates (N, 2)."""
    side = maps.shape[1]
    at = [uv[:, 1] * side - 0.5, uv[:, 0] * side - 0.5]
    return np.stack(
        [
            np.stack([map_coordinates(each_map[:, :, k], at, order=1, mode="nearest") for k in range(3)], 1)
            for each_map in maps
        ]
    ).astype(np.float64)


def _base_map(
    poses: PoseLight, numbers: IntArray, shown: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Map (s, s, 3) of the skin at rest, in which what other poses uncover has the mean light of those that show it.

    `shown` (P, s, s) is about the poses of `numbers`. Also the share (s, s) of that light, and the light (s, s, 3).
    """
    rest = poses.skin[0].astype(np.float64)
    count = shown[1:].sum(axis=0)[..., None]
    light = np.einsum("pyx,pyxc->yxc", shown[1:], poses.skin[numbers[1:]]) / np.maximum(count, 1)
    ever = count[..., 0] > 0
    away, nearest = distance_transform_edt(~ever, return_indices=True)
    light = light[tuple(nearest)]
    share: FloatArray = gaussian_filter((~shown[0] & (away <= BEYOND_TEXELS)).astype(np.float64), UNCOVERED_BLUR)
    return rest + share[..., None] * (light - rest), share, light


def _smoothed_small(
    face: Face, poses: PoseLight, numbers: IntArray, rows: IntArray, parts: NDArray[np.str_], shown: NDArray[np.bool_]
) -> FloatArray:
    """(P, N, 3) light of the vertices (N,) of the small parts (N,) in poses, without the noise of single ones.

    Lit ones are averaged with each other, and in the mouth those that the poses show (P, V): a tooth does not take the
    dark of what the lip hides of it. Metal, whose light is that of the camera in front, takes its median where it turns
    away.
    """
    group = weld_groups(face, build_rig(face))
    first = np.unique(group, return_index=True)[1]
    at = np.full(len(face.vertices), -1)
    at[poses.rows] = np.arange(len(poses.rows))
    light = poses.small[numbers][:, at[first[group[rows]]]].astype(np.float64)
    for name in np.unique(parts):
        own = np.flatnonzero(parts == name)
        near = neighbours(np.searchsorted(rows[own], _corners(face, (str(name),))), face.vertices[rows[own]])
        for pose, seen in zip(light, shown, strict=True):
            is_lit = seen[rows[own]] if name.startswith(MOUTH) else pose[own].max(axis=1) > SKIN_LIT
            lit = is_lit.astype(np.float64)[:, None]
            among = np.maximum(near @ lit, 1e-9)
            for _ in range(SMALL_ROUNDS):
                pose[own] = np.where(lit > 0, near @ (pose[own] * lit) / among, pose[own])
            if name in METAL and lit.any():
                usual = np.median(pose[own][lit[:, 0] > 0], axis=0)
                dull = pose[own].max(axis=1) < METAL_LIT * usual.max()
                pose[own[dull]] = usual
    return light


def _corners(face: Face, names: Sequence[str]) -> IntArray:
    """(F, 3) triangles of parts."""
    spans = [slice(part.first, part.first + part.count) for part in face.parts if part.name in names]
    return np.concatenate([face.triangles[span] for span in spans]).astype(np.int64)


def _lit_balls(face: Face, rows: IntArray, light: NDArray[np.floating]) -> FloatArray:
    """(B, 3) light on eyeballs whose vertices under the lids take the light beside them."""
    filled = np.array(light, np.float64)
    for eye in face.eyes:
        own = np.flatnonzero((rows >= eye.first) & (rows < eye.first + eye.count))
        ahead = face.vertices[rows[own]] - eye.centre
        ahead = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
        tone = filled[own].mean(axis=1)
        lit = tone > BALL_LIT * np.percentile(tone[ahead[:, 2] > 0.75], 75)
        nearest = cKDTree(ahead[lit]).query(ahead[~lit])[1]
        filled[own[~lit]] = filled[own[lit]][nearest]
    return filled
