"""Fit of a face's light to what the path tracer saw of its poses."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import binary_erosion, distance_transform_edt, gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from corpus_tools.film.look import WHITE, Look
from corpus_tools.film.pose_light import CAMERA_YAWS_DEG, FAR, MOUTH, SKIN, PoseLight
from corpus_tools.film.poses import EXPRESSIONS
from corpus_tools.film.seen import mouth_middle, seen_triangles
from corpus_tools.film.weld import weld_vertices
from corpus_tools.head.eyes import EyeStyle
from tts2face.face.deformation import build_rig
from tts2face.models.baked_light import BLACK_SHARE, PRODUCTS, BakedLight
from tts2face.models.face import Face
from tts2face.numeric import smoothstep
from tts2face.render.film.pose_features import Features, Opening, turn_weights, yaw_and_pitch_deg

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

N_MODES, N_TURN_MODES, N_BALL_MODES = 20, 6, 6  # of the upper and the lower half of the face each
UPPER_FEATURES = ("eye", "brow", "cheekSquint", "noseSneer", "mouthSmile")  # on which the light of each depends
LOWER_FEATURES = ("jaw", "mouth", "cheek", "noseSneer", "tongue")
MIDDLE_MM = (-30.0, -14.0)  # height of the border between them
RIDGE, BALL_RIDGE = 0.03, 0.3  # of the features
LEAST_CHANGE, CLEAR_CHANGE = 2.0, 5.0  # of 255: skin that changes less in every pose keeps its light
CHANGE_ROUNDS = 4  # of neighbours over which that fades
SKIN_FLOOR = (34.0, 12.0, 11.0)  # of the texels: nothing of a face is black
SKIN_LIT, FAR_LIT = 0.05, 0.06  # displayed light below which a texel was hidden from the bake
EYE_MM, MOUTH_MM = (32.0, 26.0, 60.0), (34.0, 24.0, 48.0)  # around them what is dark at rest is lit in other poses
HIDDEN, SEEN = 0.05, 0.12  # displayed light of texels that are hidden at rest there, and of those that are seen
N_GUESSES = 4  # rounds in which the light of what a pose hides is guessed by the others
FINE_ROUNDS, CLEAN_ROUNDS = 1, 7  # of neighbours over which noise is smoothed at eyes and mouth, and elsewhere
SMALL_ROUNDS, MOUTH_ROUNDS = 3, 8  # on lashes and eyeballs; on teeth and tongue, which else are striped
MOUTH_LIT, REVEAL_SPREAD = 0.12, 1.2  # displayed light of what an opening shows, and distance of openings
METAL, METAL_LIT = ("stud", "glasses"), 0.5  # and the share of its median below which its light is that of its back
BALL_LIT = 0.45  # of the light in front below which a vertex of an eyeball lies under the lid
TURN_SIDE, TURN_BLUR = 192, 0.8  # texels; the shadows of hair are soft, what is left of noise is not


def fit_light(face: Face, poses: PoseLight, look: Look, eyes: EyeStyle) -> BakedLight:
    """Light of a face from that of its poses."""
    triangles, is_inside = seen_triangles(face, poses)
    part_of = _vertex_parts(face)
    features, turned = _features(face, poses), np.asarray(poses.heads.any(axis=1))
    rig = build_rig(face)
    opening = Opening.of_face(face)
    measures = np.stack([opening.measures(rig.pose(w, h), h) for w, h in zip(poses.weights, poses.heads, strict=True)])
    small_rows = np.flatnonzero(np.isin(part_of, np.unique(part_of[poses.rows])))
    small_parts = part_of[small_rows]
    of_mouth = np.array([name.startswith(MOUTH) for name in small_parts])
    of_ball = np.isin(small_parts, ("sclera", "iris"))
    others = ~of_mouth & ~of_ball
    shown = _base_map(face, poses)
    skin_rows, skin, hidden = _skin_changes(face, poses, turned, shown[0])
    small = _smoothed_small(face, poses, small_rows, small_parts)
    still = small[:, others] * 255
    base = np.concatenate([np.zeros((len(skin_rows), 3)), still[0]])
    changes = np.concatenate([skin, still - still[:1]], axis=1)
    rows = np.concatenate([skin_rows, small_rows[others]])
    hidden = np.concatenate([hidden, np.zeros(still.shape[:2], bool)], axis=1)
    halves = [
        fit_modes(features * used, changes * share, hidden, N_MODES)
        for used, share in zip(_used_features(face, poses), _halves(face, rows), strict=True)
    ]
    modes, weights = (np.concatenate([half[at] for half in halves], axis=at) for at in (0, 1))
    ball_rows = small_rows[of_ball]
    balls = np.stack([_lit_balls(face, ball_rows, light) for light in small[:, of_ball] / WHITE])
    ball_modes, ball_weights = principal_modes(features, balls - balls[:1], N_BALL_MODES, BALL_RIDGE)
    turns, turn_modes, from_turns = _turn_changes(poses, turned)
    mouth = _revealed(small[~turned][:, of_mouth], measures[~turned])
    cameras, sizes = _quantised(_camera_changes(poses))
    return BakedLight(
        page_of={name: page for page, names in enumerate((SKIN, FAR)) for name in names},
        pages=np.stack([_skin_page(poses, *shown[1:]), _filled(poses.far_rest, FAR_LIT)]),
        triangles=triangles,
        is_inside=is_inside,
        rows=rows.astype(np.int32),
        base=np.rint(np.clip(base, 0, 255)).astype(np.uint8),
        modes=modes,
        mode_weights=weights,
        mouth_rows=small_rows[of_mouth].astype(np.int32),
        openings=measures[~turned].astype(np.float32),
        mouth=np.rint(np.clip(mouth * 255, 0, 255)).astype(np.uint8),
        turns_deg=turns.astype(np.float32),
        turn_weights=from_turns,
        turn_modes=turn_modes,
        camera_yaws_deg=np.array(CAMERA_YAWS_DEG, np.float32),
        camera_modes=cameras,
        camera_sizes=sizes,
        ball_rows=ball_rows.astype(np.int32),
        ball_base=balls[0].astype(np.float32),
        ball_modes=ball_modes.astype(np.float32),
        ball_weights=ball_weights,
        lamps=poses.lamps,
        head_lamps=sum(lamp.follows_head for lamp in look.lamps.values()),
        sky=(np.array(look.sky) * look.sky_strength).astype(np.float32),
        eye_gain=look.eye.gain,
        eye_edges=np.array([eyes.pupil, eyes.iris], np.float32),
        view=np.rint(poses.view * 255).astype(np.uint8),
        backdrop=poses.backdrop,
    )


def fit_modes(
    features: Floats, changes: Floats, hidden: NDArray[np.bool_], number: int
) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Modes (C, N, 3) in 8 bits of changes (P, N, 3), and their weights (F, C) for features (P, F).

    What a pose hides (P, N) is guessed by the other poses.
    """
    filled = changes.copy()
    for _ in range(N_GUESSES):
        modes, weights = principal_modes(features, filled, number, RIDGE)
        filled[hidden] = predicted(features, modes, weights)[hidden]
    steps, sizes = _quantised(modes)
    return steps, (weights * sizes).astype(np.float32)


def _used_features(face: Face, poses: PoseLight) -> tuple[Floats, Floats]:
    """Features (F,) of the upper and the lower half of the face, 1 or 0; turns of the head belong to both."""
    names = [*face.shape_names, *(pair[0] for pair in PRODUCTS)]
    turns = np.ones(int(poses.heads.any(axis=1).sum()))
    upper, lower = (
        np.append([float(name.startswith(used)) for name in names], turns) for used in (UPPER_FEATURES, LOWER_FEATURES)
    )
    return upper, lower


def _halves(face: Face, rows: Ints) -> tuple[Floats, Floats]:
    """Shares (N, 1) of vertices (N,) in the upper and the lower half of the face."""
    upper = smoothstep(face.vertices[rows, 1].astype(np.float64), *MIDDLE_MM)[:, None]
    return upper, 1 - upper


def principal_modes(features: Floats, changes: Floats, number: int, ridge: float) -> tuple[Floats, NDArray[np.float32]]:
    """Principal modes (C, ...) of changes (P, ...), and their weights (F, C) by ridge regression on features (P, F)."""
    flat = changes.reshape(len(changes), -1)
    u, s, v = np.linalg.svd(flat, full_matrices=False)
    n = min(number, len(s))
    gram = features @ features.T + ridge * np.eye(len(features))
    weights: NDArray[np.float32] = (features.T @ np.linalg.solve(gram, u[:, :n] * s[:n])).astype(np.float32)
    return v[:n].reshape(n, *changes.shape[1:]), weights


def predicted(features: Floats, modes: Floats, weights: NDArray[np.floating]) -> Floats:
    """(P, ...) changes by modes (C, ...) and their weights (F, C) for features (P, F)."""
    found: Floats = (features @ weights @ modes.reshape(len(modes), -1)).reshape(len(features), *modes.shape[1:])
    return found


def _quantised(values: Floats) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Rows (C, ...) in 8 bits, and the size (C,) of a step of each."""
    flat = values.reshape(len(values), -1)
    sizes = np.maximum(np.abs(flat).max(axis=1) / 127, 1e-9)
    steps = np.rint(flat / sizes[:, None]).astype(np.int8)
    return steps.reshape(values.shape), sizes.astype(np.float32)


def _features(face: Face, poses: PoseLight) -> Floats:
    """(P, F + T) features of the poses: those of the weights, then those of the turns of the head."""
    own = Features.of_shapes(face.shape_names)
    turned = poses.heads.any(axis=1)
    turns = turn_weights(np.array([yaw_and_pitch_deg(head) for head in poses.heads[turned]]))
    rows = [
        np.concatenate([own.of(w), turns.at(yaw_and_pitch_deg(h))])
        for w, h in zip(poses.weights, poses.heads, strict=True)
    ]
    return np.array(rows, np.float64)


def _vertex_parts(face: Face) -> NDArray[np.str_]:
    """(V,) name of the part of each vertex."""
    found = np.full(len(face.vertices), "", dtype="U32")
    for part in face.parts:
        found[face.triangles[part.first : part.first + part.count]] = part.name
    return found


def _skin_changes(
    face: Face, poses: PoseLight, turned: NDArray[np.bool_], base: Floats
) -> tuple[Ints, Floats, NDArray[np.bool_]]:
    """Vertices (N,) of skin whose light changes with expressions, and the changes (P, N, 3) from a base map (s, s, 3).

    The changes are 0 where the head turns. Also whether a pose (P, N) hides them at eyes or mouth.
    """
    corners = _corners(face, SKIN)
    used = np.unique(corners)
    light = read_maps(np.concatenate([base[None], poses.skin]), _uv(face)[used]) * 255
    changes = light[1:] - light[:1]
    changes[turned] = 0.0
    changes[0] = 0.0  # at rest the base is what is seen
    near = _neighbours(np.searchsorted(used, corners), face.vertices[used])
    fine = _near_features(face, face.vertices[used])[:, None]
    for turn in range(CLEAN_ROUNDS):
        cleaned = np.stack([near @ one for one in changes])
        changes += (cleaned - changes) * (1.0 if turn < FINE_ROUNDS else 1 - fine)
    fine = fine[:, 0]
    hidden = (
        (light[1:].max(axis=2) < 255 * SEEN) & (light[0].max(axis=1) > 255 * SEEN) & (fine > 0.5) & ~turned[:, None]
    )
    strength = np.where(hidden[..., None], 0, np.abs(changes)).max(axis=(0, 2))
    share = smoothstep(strength, LEAST_CHANGE, CLEAR_CHANGE)
    for _ in range(CHANGE_ROUNDS):
        share = near @ share
    changes *= share[:, None]
    kept = share > 0.02
    return used[kept], changes[:, kept], hidden[:, kept]


def _neighbours(triangles: Ints, places: NDArray[np.floating]) -> Any:
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


def _halved(maps: NDArray[np.floating]) -> Floats:
    """(P, 192, 192, 3) means of squares of maps (P, S, S, 3)."""
    n = maps.shape[1] // TURN_SIDE
    means: Floats = maps.reshape(len(maps), TURN_SIDE, n, TURN_SIDE, n, 3).mean(axis=(2, 4)).astype(np.float64)
    return means


def _far_changes(poses: PoseLight) -> Floats:
    """(T + C + 1, 3, s s) changes of the second page from rest."""
    halved = _halved(poses.far - poses.far[:1]) * 255
    return halved.transpose(0, 3, 1, 2).reshape(len(halved), 3, -1)


def _skin_turns(poses: PoseLight, light: NDArray[np.floating]) -> Floats:
    """(N, 3, s s) changes of the skin's light (N, S, S, 3) from rest, without noise."""
    changes = gaussian_filter(_halved(light - poses.skin[:1]) * 255, (0, TURN_BLUR, TURN_BLUR, 0))
    return np.asarray(changes.transpose(0, 3, 1, 2).reshape(len(light), 3, -1))


def _camera_changes(poses: PoseLight) -> Floats:
    """(C, 3, 2 s s) changes of both pages from the cameras."""
    skin = _skin_turns(poses, poses.skin_from)
    return np.concatenate([skin, _far_changes(poses)[-len(skin) :]], axis=2)


def _turn_changes(poses: PoseLight, turned: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.int8], NDArray[np.float32]]:
    """Turns (T, 2) of the head, modes (A, 3, n) of the change of both pages, and their weights (T, A)."""
    n = int(turned.sum())
    skin = _skin_turns(poses, poses.skin[turned])
    below = np.zeros((n, 3, TURN_SIDE * (TURN_SIDE // BLACK_SHARE)))
    changes = np.concatenate([skin, _far_changes(poses)[1 : n + 1], below], axis=2)
    modes, weights = principal_modes(np.eye(n), changes, N_TURN_MODES, 0.0)
    steps, sizes = _quantised(modes)
    return (
        np.array([yaw_and_pitch_deg(head) for head in poses.heads[turned]]),
        steps,
        (weights * sizes).astype(np.float32),
    )


def _filled(page: NDArray[np.floating], least: float, keeps: NDArray[np.bool_] | None = None) -> NDArray[np.uint8]:
    """Page (S, S, 3) of displayed light, 0 to 255, whose hidden texels take the light of the nearest lit ones."""
    lit = binary_erosion(page.max(axis=2) > least)
    nearest = distance_transform_edt(~lit, return_distances=False, return_indices=True)
    filled = page[tuple(nearest)]
    if keeps is not None:
        filled[keeps] = page[keeps]
    pixels: NDArray[np.uint8] = np.rint(np.clip(filled, 0, 1) * 255).astype(np.uint8)
    return pixels


def _near_features(face: Face, places: NDArray[np.floating]) -> Floats:
    """(N,) 1 at eyes and mouth, 0 away from them, of places (N, 3)."""
    zones = [(mouth_middle(face), MOUTH_MM), *((eye.centre, EYE_MM) for eye in face.eyes)]
    off = np.min([np.linalg.norm((places - centre) / np.array(size), axis=1) for centre, size in zones], axis=0)
    near: Floats = 1 - smoothstep(off.astype(np.float64), 0.75, 1.0)
    return near


def _base_map(face: Face, poses: PoseLight) -> tuple[Floats, Floats, Floats]:
    """Map (s, s, 3) of the skin at rest with what is hidden at eyes and mouth as the poses show it that light it most.

    Also the share (s, s) of these poses, and their light (s, s, 3).
    """
    side = poses.skin.shape[1]
    used = np.unique(_corners(face, SKIN))
    grid = (np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) + 0.5) / side
    nearest = cKDTree(_uv(face)[used]).query(grid)[1]
    zone = _near_features(face, face.vertices[used])[nearest].reshape(side, side)
    rest = poses.skin[0].astype(np.float64)
    shown = [number for number, name in enumerate(poses.names) if name in EXPRESSIONS]
    tone = poses.skin[shown].max(axis=3)
    brightest = np.take_along_axis(poses.skin[shown], tone.argmax(axis=0)[None, :, :, None], axis=0)[0]
    share = zone * (1 - smoothstep(rest.max(axis=2), HIDDEN, SEEN))
    return rest + share[..., None] * (brightest - rest), share, brightest.astype(np.float64)


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


def _smoothed_small(face: Face, poses: PoseLight, rows: Ints, parts: NDArray[np.str_]) -> Floats:
    """(P, N, 3) light of the vertices (N,) of the small parts (N,), without the noise of single ones.

    Lit ones are averaged with each other: a tooth does not take the dark of what the lip hides of it. Metal, whose
    light is that of the camera in front, takes its median where it turns away.
    """
    first, group = weld_vertices(face)
    at = np.full(len(face.vertices), -1)
    at[poses.rows] = np.arange(len(poses.rows))
    light = poses.small[:, at[first[group[rows]]]].astype(np.float64)
    for name in np.unique(parts):
        own = np.flatnonzero(parts == name)
        near = _neighbours(np.searchsorted(rows[own], _corners(face, (str(name),))), face.vertices[rows[own]])
        for pose in light:
            lit = (pose[own].max(axis=1) > SKIN_LIT).astype(np.float64)[:, None]
            among = np.maximum(near @ lit, 1e-9)
            for _ in range(MOUTH_ROUNDS if name.startswith(MOUTH) else SMALL_ROUNDS):
                pose[own] = np.where(lit > 0, near @ (pose[own] * lit) / among, pose[own])
            if name in METAL and lit.any():
                usual = np.median(pose[own][lit[:, 0] > 0], axis=0)
                dull = pose[own].max(axis=1) < METAL_LIT * usual.max()
                pose[own[dull]] = usual
    return light


def _revealed(light: Floats, openings: Floats) -> Floats:
    """(J, M, 3) light of the mouth in openings (J, 5): what one of them hides has the light of those that show it.

    Between baked openings it is seen, and else black: side teeth would be missing.
    """
    shown = light.max(axis=2) > MOUTH_LIT
    squared = ((openings[:, None] - openings[None]) ** 2).sum(axis=2)
    near = np.exp(-squared / (2 * REVEAL_SPREAD**2))
    weights = near @ shown
    found = np.einsum("jk,km,kmc->jmc", near, shown.astype(np.float64), light) / np.maximum(weights, 1e-12)[..., None]
    revealed: Floats = np.where((shown | ~shown.any(axis=0))[..., None], light, found)
    return revealed


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
