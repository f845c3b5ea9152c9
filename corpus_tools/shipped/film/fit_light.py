"""Fit of a face's light to what the path tracer saw of its poses.

Fit of a face's light in texels: its pages at rest, and how they change with turns of the head and cameras.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import binary_dilation, binary_erosion, distance_transform_edt, gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from corpus_tools.dense.texels import find_texels
from corpus_tools.shipped.film.fit_responses import (
    feature_zones,
    find_partners,
    fit_responses,
    limits_of,
    nearness,
    pose_terms,
)
from corpus_tools.shipped.film.look import WHITE, Look
from corpus_tools.shipped.film.poses import CAMERA_YAWS_DEG, FAR, MOUTH, SKIN, PoseLight, seen_triangles, shown_skin
from corpus_tools.shipped.head.eyes import EyeStyle
from tts2face.face.deformation import build_rig
from tts2face.models.baked_light import BLACK_SHARE, N_BALL_TERMS, BakedLight, HairLight, HairTint, quantised
from tts2face.models.face import Face
from tts2face.numeric.arrays import smoothstep
from tts2face.picture.baked.interpolation import yaw_and_pitch_deg
from tts2face.picture.surface import weld_groups

Floats = NDArray[np.float64]

SKIN_FLOOR = (34.0, 12.0, 11.0)  # of the texels: nothing of a face is black
SKIN_LIT, FAR_LIT, BLACK_LIT = 0.05, 0.06, 0.02  # displayed light below which a texel was hidden from the bake
TURN_SIDE, TURN_BLUR = 256, 1.1  # texels; the shadows of hair are soft, what is left of noise is not
DRAWN_MARGIN = 2  # texels
NO_CHANGE, CHANGE = 1.0, 3.0  # of 255, in any turn or camera
RELIT = 4.0, 12.0  # of 255, of skin with another haircut
STEP = 0.75  # of 255, of changes: finer ones are noise, which cannot be packed


def principal_modes(changes: Floats, number: int) -> tuple[Floats, Floats]:
    """Principal modes (C, ...) of changes (P, ...), and their weights (P, C)."""
    u, s, v = np.linalg.svd(changes.reshape(len(changes), -1), full_matrices=False)
    n = min(number, len(s))
    return v[:n].reshape(n, *changes.shape[1:]), u[:, :n] * s[:n]


def _shrunk(maps: NDArray[np.floating]) -> Floats:
    """(P, s, s, 3) means of squares of maps (P, S, S, 3); s is `TURN_SIDE`, of which S need be no multiple."""
    shared = math.gcd(maps.shape[1], TURN_SIDE)
    n = maps.shape[1] // shared
    finer = maps.repeat(TURN_SIDE // shared, axis=1).repeat(TURN_SIDE // shared, axis=2)
    means: Floats = finer.reshape(len(maps), TURN_SIDE, n, TURN_SIDE, n, 3).mean(axis=(2, 4)).astype(np.float64)
    return means


def _far_changes(poses: PoseLight) -> Floats:
    """(T + C + 1, 3, s s) changes of the second page from rest."""
    shrunk = _shrunk(poses.far - poses.far[:1]) * 255
    return shrunk.transpose(0, 3, 1, 2).reshape(len(shrunk), 3, -1)


def _skin_turns(poses: PoseLight, light: NDArray[np.floating]) -> Floats:
    """(N, 3, s s) changes of the skin's light (N, S, S, 3) from rest, without noise."""
    changes = gaussian_filter(_shrunk(light - poses.skin[:1]) * 255, (0, TURN_BLUR, TURN_BLUR, 0))
    return np.asarray(changes.transpose(0, 3, 1, 2).reshape(len(light), 3, -1))


def drawn_texels(face: Face, triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(2 s s,) texels of change of both pages that any of these triangles of the face shows, ``~t`` for a back."""
    numbers = np.unique(np.where(triangles < 0, ~triangles, triangles))
    part_names = np.repeat([part.name for part in face.parts], [part.count for part in face.parts])[numbers]
    uv = np.zeros((len(face.vertices), 2)) if face.uv is None else face.uv.astype(np.float64)
    found = np.zeros((2, TURN_SIDE, TURN_SIDE), bool)
    for page, parts in zip(found, (SKIN, FAR), strict=True):
        own = face.triangles[numbers[np.isin(part_names, parts)]].astype(np.int64)
        texels = find_texels(uv, own, TURN_SIDE)
        page[texels.rows, texels.columns] = True
        page[:] = binary_dilation(page, iterations=DRAWN_MARGIN)
    return found.ravel()


def camera_changes(poses: PoseLight, drawn: NDArray[np.bool_]) -> Floats:
    """(C, 3, 2 s s) changes of both pages from the cameras, in texels (2 s s,) that are drawn."""
    skin = _skin_turns(poses, poses.skin_from)
    return _clear(np.concatenate([skin, _far_changes(poses)[-len(skin) :]], axis=2), drawn)


def relit_skin(own: PoseLight, worn: PoseLight) -> Floats:
    """(s s,) share of the texels of the skin whose light at rest is another with another haircut."""
    apart = np.abs(_shrunk(worn.skin[:1])[0] - _shrunk(own.skin[:1])[0]).max(axis=2) * 255
    share: Floats = smoothstep(gaussian_filter(apart, TURN_BLUR), *RELIT)
    return share.ravel()


def turn_changes(
    poses: PoseLight, drawn: NDArray[np.bool_], number: int
) -> tuple[Floats, NDArray[np.int8], NDArray[np.float32]]:
    """Turns (T, 2) of the head, so many modes (A, 3, n) of the change of both pages, and their weights (T, A)."""
    turned = np.asarray(poses.heads.any(axis=1))
    n = int(turned.sum())
    changes = _clear(np.concatenate([_skin_turns(poses, poses.skin[turned]), _far_changes(poses)[1 : n + 1]], 2), drawn)
    below = np.zeros((n, 3, TURN_SIDE * (TURN_SIDE // BLACK_SHARE)))
    modes, weights = principal_modes(np.concatenate([changes, below], axis=2), number)
    steps, sizes = quantised(modes, least=STEP / np.abs(weights).max(axis=0))
    return (
        np.array([yaw_and_pitch_deg(head) for head in poses.heads[turned]]),
        steps,
        (weights * sizes).astype(np.float32),
    )


def _clear(changes: Floats, drawn: NDArray[np.bool_]) -> Floats:
    """Changes (N, 3, n) without those of texels that are not drawn (n,) or hardly change in any of them."""
    return np.asarray(changes * drawn * smoothstep(np.abs(changes).max(axis=(0, 1)), NO_CHANGE, CHANGE))


def rest_pages(poses: PoseLight, share: Floats, light: Floats) -> NDArray[np.uint8]:
    """(2, S, S, 3) pages at rest; the skin has a share (s, s) of light (s, s, 3) of other poses."""
    return np.stack([_skin_page(poses, share, light), _filled(poses.far_rest, FAR_LIT)])


def tint_of(poses: PoseLight) -> HairTint:
    """The hair in its other colours."""
    pages = np.stack([_filled(one, BLACK_LIT) for one in poses.far_other])
    return HairTint(poses.other_colours, pages, poses.other_vertices)


def _filled(page: NDArray[np.floating], least: float, keeps: NDArray[np.bool_] | None = None) -> NDArray[np.uint8]:
    """Page (S, S, 3) of displayed light, 0 to 255, whose hidden texels take the light of the nearest lit ones."""
    lit = binary_erosion(page.max(axis=2) > least)
    nearest = distance_transform_edt(~lit, return_distances=False, return_indices=True)
    filled = page[tuple(nearest)]
    if keeps is not None:
        filled[keeps] = page[keeps]
    pixels: NDArray[np.uint8] = np.rint(np.clip(filled, 0, 1) * 255).astype(np.uint8)
    return pixels


def _skin_page(poses: PoseLight, share: Floats, light: Floats) -> NDArray[np.uint8]:
    """Colours of the skin at rest, with a share (s, s) of light (s, s, 3) of other poses."""
    side = poses.skin_rest.shape[0]
    share, larger = _enlarged(share, side), np.stack([_enlarged(one, side) for one in np.moveaxis(light, 2, 0)], 2)
    page = np.maximum(poses.skin_rest, np.array(SKIN_FLOOR) / 255)
    page = page + share[..., None] * (larger - page)
    return _filled(page, SKIN_LIT, share > 0.5)


def _enlarged(values: Floats, side: int) -> Floats:
    """(S, S) values (s, s) between their places."""
    places = (np.arange(side) + 0.5) * values.shape[0] / side - 0.5
    found: Floats = map_coordinates(values, np.meshgrid(places, places, indexing="ij"), order=1, mode="nearest")
    return found


Ints = NDArray[np.int64]

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
    uncovered: tuple[Floats, Floats],
    number: int,
    light: BakedLight | None = None,
) -> dict[str, Any]:
    """What depends on the haircut, but for the light of vertices, by the names of `HairLight`.

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
    face: Face, poses: PoseLight, numbers: Ints, shown: NDArray[np.bool_], base: Floats
) -> tuple[Ints, Floats]:
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
    tone += TONE_SHARE * away * (np.stack([near @ one for one in tone]) - tone)
    for turn in range(COLOUR_ROUNDS):
        smooth = np.stack([near @ one for one in colour])
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


def neighbours(triangles: Ints, places: NDArray[np.floating]) -> Any:
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


def read_maps(maps: NDArray[np.floating], uv: NDArray[np.floating]) -> Floats:
    """(P, N, 3) values of maps (P, S, S, 3) at texture coordinates (N, 2)."""
    side = maps.shape[1]
    at = [uv[:, 1] * side - 0.5, uv[:, 0] * side - 0.5]
    return np.stack(
        [np.stack([map_coordinates(one[:, :, k], at, order=1, mode="nearest") for k in range(3)], 1) for one in maps]
    ).astype(np.float64)


def _base_map(poses: PoseLight, numbers: Ints, shown: NDArray[np.bool_]) -> tuple[Floats, Floats, Floats]:
    """Map (s, s, 3) of the skin at rest, in which what other poses uncover has the mean light of those that show it.

    `shown` (P, s, s) is about the poses of `numbers`. Also the share (s, s) of that light, and the light (s, s, 3).
    """
    rest = poses.skin[0].astype(np.float64)
    count = shown[1:].sum(axis=0)[..., None]
    light = np.einsum("pyx,pyxc->yxc", shown[1:], poses.skin[numbers[1:]]) / np.maximum(count, 1)
    ever = count[..., 0] > 0
    away, nearest = distance_transform_edt(~ever, return_indices=True)
    light = light[tuple(nearest)]
    share: Floats = gaussian_filter((~shown[0] & (away <= BEYOND_TEXELS)).astype(np.float64), UNCOVERED_BLUR)
    return rest + share[..., None] * (light - rest), share, light


def _smoothed_small(
    face: Face, poses: PoseLight, numbers: Ints, rows: Ints, parts: NDArray[np.str_], shown: NDArray[np.bool_]
) -> Floats:
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


def _corners(face: Face, names: Sequence[str]) -> Ints:
    """(F, 3) triangles of parts."""
    spans = [slice(part.first, part.first + part.count) for part in face.parts if part.name in names]
    return np.concatenate([face.triangles[span] for span in spans]).astype(np.int64)


def _lit_balls(face: Face, rows: Ints, light: NDArray[np.floating]) -> Floats:
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
