"""Haircuts: MakeHuman's hair cards on the reference head, as `Hair`."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import sparse
from scipy.spatial import cKDTree

from corpus_tools.dense.texels import find_texels
from corpus_tools.shipped.head.assets import ASSETS_PACKAGE, Asset, read_asset
from corpus_tools.shipped.head.cage import Cage
from corpus_tools.shipped.head.locks import FRINGE, GROWN, grow_locks, lock_tangents, paint_ribbons
from corpus_tools.shipped.head.noise import value_noise
from corpus_tools.shipped.head.scalp import (
    MIDDLE,
    covered_share,
    hair_share,
    paint_scalp,
    paint_stubble,
    share_levels,
    stubble_share,
)
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from corpus_tools.shipped.head.strands import (
    Cards,
    StrandStyle,
    bake_strands,
    edge_graph,
    number_islands,
    strand_tangents,
)
from corpus_tools.shipped.head.subdivision import triangulate
from tts2face.models.hair import Hair
from tts2face.numeric.arrays import FloatArray, IntArray, smoothstep, unit_vectors

Edit = Callable[[Cards], Cards]
Shown = tuple[Cards, FloatArray, tuple[NDArray[np.uint8], NDArray[np.uint8]]]  # with tangents, relief and coverage
Finish = Callable[
    [Cards, NDArray[np.uint8], FloatArray], tuple[NDArray[np.uint8], FloatArray]
]  # of coverage and tangents
AXIS_Z, FRONT_DEG = -60.0, (36.0, 60.0)  # the vertical axis of the head; a fringe lies in front of these angles
FRINGE_TOP, BROW_Y = 62.0, 25.0  # heights between which a fringe ends up
BUST_Y, SUNK_MM = -335.0, 3.0
# the lock ahead of the temple, below these heights
LOCK_DEG = (36.0, 53.0)
LOCK_Y = (36.0, 46.0)
LOCK_SHARE = 0.1
ROOTS_Y, ROOTS_Z = 46.0, -40.0  # above the forehead
ROOT_MM, ROOT_SPREAD_MM = 7.0, 2.2  # width of a hairline, and that of its raggedness
# Half width of a parting in the middle, heights between which it begins, and share of the direction of its roots.
PARTING_MM = 9.0
PARTING_Y = (50.0, 75.0)
ROOT_TURN = 1.0
# shares of the texture
CURL_TOP = 0.68
CURL_ROOT = (0.86, 0.98)
CURL_SIDE = 0.08
CURL_SPREAD = 0.03
# coverage of haze and of curls, of 255; spread of directions
CURL_HAZE = 70.0
CURL_SOLID = 190.0
CURL_TURN = 0.42
CROWN_Y, N_CROWN_MEANS = (40.0, 80.0), 12  # heights between which the crown begins
# share of the coverage of cropped hair
CROPPED = "cropped"
STUBBLE = "stubble"
STUBBLE_COVER = 0.5
PACKAGED = {"data": ASSETS_PACKAGE}
N_ANCHORS = 180
N_SAMPLES = 60_000  # points on the cards
SOLID = 0.4  # coverage of a card from which it hides the scalp
SCALP_SIDE, STUBBLE_SIDE = 1024, 1024
# height of the layer above a cropped scalp, coverage, pixels
FUZZ_MM = 1.6
FUZZ = 0.42
FUZZ_SIDE = 512
SEED = 11
FRINGED = "long01"  # the haircut that `fringe01` is with a fringe; beside this share its picture has room
FREE_SHARE = 0.64


def trim_fringe(cards: Cards) -> Cards:
    """Cards whose fringe ends above the brows."""
    x, y, z = cards.vertices.T
    angle = np.degrees(np.arctan2(np.abs(x), z - AXIS_Z))
    share = 1 - smoothstep(angle, *FRONT_DEG)
    low = y[angle < FRONT_DEG[0]].min()
    raised = BROW_Y + (FRINGE_TOP - BROW_Y) * np.clip((y - low) / (FRINGE_TOP - low), 0, None)
    moved = cards.vertices.copy()
    moved[:, 1] = np.where(y < FRINGE_TOP, y + share * (raised - y), y)
    return Cards(moved, cards.triangles, cards.uv, cards.weld)


def smooth_sheet(cards: Cards) -> Cards:
    """The largest sheet, smooth on the crown; the others run so close to it that they would cut through."""
    welded = cards.weld[cards.triangles]
    n = int(cards.weld.max()) + 1
    islands = number_islands(n, welded)[cards.weld]
    is_main = islands == np.bincount(islands).argmax()
    share = smoothstep(cards.vertices[:, 1], *CROWN_Y)[:, None]
    graph = edge_graph(n, welded)
    mean = sparse.diags_array(1.0 / np.maximum(graph.sum(axis=1), 1.0)) @ graph
    places = np.zeros((n, 3))
    places[cards.weld] = cards.vertices
    for _ in range(N_CROWN_MEANS):  # without shrinking: Taubin 1995
        for step in (0.5, -0.53):
            places = places + step * (mean @ places - places)
    moved = cards.vertices + share * (places[cards.weld] - cards.vertices)
    return _used_cards(Cards(moved, cards.triangles, cards.uv, cards.weld), is_main[cards.triangles].all(axis=1))


def sink_strands(cards: Cards) -> Cards:
    """Cards whose small ones lie below the largest sheet, which they would cut through."""
    islands = number_islands(int(cards.weld.max()) + 1, cards.weld[cards.triangles])[cards.weld]
    is_small = islands != np.bincount(islands).argmax()
    moved = cards.vertices + SUNK_MM * unit_vectors(MIDDLE - cards.vertices) * is_small[:, None]
    return Cards(moved, cards.triangles, cards.uv, cards.weld)


def tuck_lock(cards: Cards) -> Cards:
    """Cards without the pointed lock ahead of the left temple, which a shortened fringe leaves: it turns backwards."""
    off = cards.vertices - [0.0, 0.0, AXIS_Z]
    angle = np.degrees(np.arctan2(off[:, 0], off[:, 2]))
    is_lock = (off[:, 0] > 0) & (angle > LOCK_DEG[0]) & (angle < LOCK_DEG[1])
    share = is_lock * (1 - smoothstep(off[:, 1], *LOCK_Y)) * (1 - LOCK_SHARE)
    turn = np.radians(share * (LOCK_DEG[1] - angle))
    moved = cards.vertices.copy()
    moved[:, 0] = off[:, 0] * np.cos(turn) + off[:, 2] * np.sin(turn)
    moved[:, 2] = off[:, 2] * np.cos(turn) - off[:, 0] * np.sin(turn) + AXIS_Z
    return Cards(moved, cards.triangles, cards.uv, cards.weld)


def cut_at_bust(cards: Cards) -> Cards:
    """Cards without what hangs below the bust."""
    return _used_cards(cards, (cards.vertices[cards.triangles, 1] > BUST_Y).any(axis=1))


def _used_cards(cards: Cards, is_kept: NDArray[np.bool_]) -> Cards:
    used, packed = np.unique(cards.triangles[is_kept], return_inverse=True)
    return Cards(cards.vertices[used], packed.reshape(-1, 3), cards.uv[used], cards.weld[used])


def coverage_levels(coverage: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Coverage of 0 to 255 in steps of 8, which compress well."""
    levels: NDArray[np.uint8] = (np.rint(coverage / 8) * 8).clip(0, 255).astype(np.uint8)
    return levels


def thin_roots(cards: Cards, alpha: NDArray[np.uint8], tangents: FloatArray) -> tuple[NDArray[np.uint8], FloatArray]:
    """Coverage that falls off in single strands towards the edge of the cards above the forehead."""
    side = len(alpha)
    texels = find_texels(cards.uv, cards.triangles, side)
    place = texels.interpolate(cards.vertices)
    edge = border_points(cards)
    edge = edge[(edge[:, 1] > ROOTS_Y) & (edge[:, 2] > ROOTS_Z)]
    distance = cKDTree(edge).query(place)[0]
    streak = np.random.default_rng(SEED).standard_normal(side)[texels.columns]  # strands run along v
    share = smoothstep(distance + ROOT_SPREAD_MM * streak, 0.0, ROOT_MM)
    thinned = alpha.astype(np.float64)
    thinned[texels.rows, texels.columns] *= share
    return coverage_levels(thinned), raise_roots(cards, tangents)


def raise_roots(cards: Cards, tangents: FloatArray) -> FloatArray:
    """Tangents (N, 3) that point into the head at the parting, where strands rise from it and no highlight lies."""
    x, y, _ = cards.vertices.T
    near = np.exp(-((x / PARTING_MM) ** 2)) * smoothstep(y, *PARTING_Y)
    return unit_vectors(tangents + ROOT_TURN * near[:, None] * unit_vectors(MIDDLE - cards.vertices))


def border_points(cards: Cards) -> FloatArray:
    """(B, 3) points on the borders of the cards, at most 1 mm apart on edges of up to 40 mm."""
    welded = cards.weld[cards.triangles]
    ends = np.sort(np.stack([welded, np.roll(welded, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    pairs, count = np.unique(ends, axis=0, return_counts=True)
    places = np.zeros((int(cards.weld.max()) + 1, 3))
    places[cards.weld] = cards.vertices
    start, end = places[pairs[count == 1]].transpose(1, 0, 2)
    along = np.linspace(0, 1, 41)[:, None, None]
    points: FloatArray = (start + along * (end - start)).reshape(-1, 3)
    return points


def finish_curls(cards: Cards, alpha: NDArray[np.uint8], tangents: FloatArray) -> tuple[NDArray[np.uint8], FloatArray]:
    """Curls point away from the head, each its own way, so that single ones shine; no haze, no straight lower edge."""
    height = np.linspace(0, 1, len(alpha))[:, None]
    across = np.linspace(0, 1, len(alpha))[None]
    ragged = CURL_SPREAD * np.random.default_rng(SEED).standard_normal(alpha.shape)
    is_card = height > CURL_TOP
    low = 1 - smoothstep(height + ragged, *CURL_ROOT)
    side = smoothstep(np.minimum(across, 1 - across) + ragged, 0.0, CURL_SIDE)
    solid = np.clip((alpha.astype(np.float64) - CURL_HAZE) * 255 / (CURL_SOLID - CURL_HAZE), 0, 255)
    thinned: FloatArray = solid * np.where(is_card, low * side, 1.0)
    outwards = unit_vectors(cards.vertices - MIDDLE)
    turned = np.random.default_rng(SEED).standard_normal((int(cards.weld.max()) + 1, 3))[cards.weld]
    return coverage_levels(thinned), unit_vectors(outwards + CURL_TURN * turned)


@dataclass(frozen=True, slots=True)
class Haircut:
    """A haircut of the package: summary, side of the texture in pixels, strands, edits of cards, and of coverage."""

    summary: str
    side: int = 896
    style: StrandStyle = field(default_factory=StrandStyle)
    edits: tuple[Edit, ...] = ()
    finish: Finish | None = None


HAIRCUTS: Mapping[str, Haircut] = {
    "long01": Haircut(
        "long, straight, parted in the middle",
        896,
        StrandStyle(14.0, 3.0, matte=True, contrast=0.6, shade_px=5.0, broad=0.10),
        (smooth_sheet, cut_at_bust),
        thin_roots,
    ),
    "bob01": Haircut("chin-length bob with a fringe", 704, edits=(trim_fringe,)),
    "bob02": Haircut(
        "chin-length bob with a long side fringe",
        896,
        StrandStyle(10.0, 0.6, contrast=0.6, broad=0.12),
        (trim_fringe, tuck_lock, sink_strands),
    ),
    "ponytail01": Haircut("combed back into a ponytail", 768, StrandStyle(9.0, contrast=0.6)),
    "braid01": Haircut("side fringe and a braid at the back", 640, StrandStyle(contrast=0.3), (trim_fringe,)),
    "afro01": Haircut("rounded afro", 640, StrandStyle(contrast=1.3), finish=finish_curls),
    "short01": Haircut("short, tousled on top", 640),
    "short02": Haircut("short with a full fringe", 896, StrandStyle(12.0, contrast=0.5, broad=0.12)),
    "short03": Haircut("short bob with a side fringe", edits=(trim_fringe,)),
    "short04": Haircut("short, combed back", 768, edits=(sink_strands,)),
}


def build_haircuts(folder: Path, cage: Cage, skin: HeadSkin, head: FloatArray) -> Iterator[tuple[str, Hair]]:
    """Each haircut by name, on the reference head with vertices (V, 3), whose first ones are the skin's."""
    for name in HAIRCUTS:
        metadata = _metadata(name, HAIRCUTS[name].summary) | PACKAGED
        yield name, _on_head(dressed_cards(folder, name, cage), skin, head, metadata)
    for name, (summary, style) in GROWN.items():
        generator = np.random.default_rng(SEED)
        cards = grow_locks(skin, head, style, generator)
        shown = cards, lock_tangents(cards, style.n_steps), paint_ribbons(generator)
        yield name, _on_head(shown, skin, head, _metadata(name, summary))
    shown = with_fringe(dressed_cards(folder, FRINGED, cage), skin, head)
    summary = "long, straight, with a fringe"
    yield "fringe01", _on_head(shown, skin, head, _metadata("fringe01", summary) | PACKAGED)
    yield CROPPED, build_cropped(skin, head)
    yield STUBBLE, build_cropped(skin, head, STUBBLE, STUBBLE_COVER)


def dressed_cards(folder: Path, name: str, cage: Cage) -> Shown:
    """A haircut of the package: its cards on the head of a cage, their tangents, and relief and coverage."""
    cut, asset = HAIRCUTS[name], read_asset(folder, f"hair/{name}", cage.source.vertices)
    cards = split_seams(asset, asset.fit(cage.vertices, cage.source.vertices))
    for edit in cut.edits:
        cards = edit(cards)
    relief, alpha, angles = bake_strands(asset.picture, cut.style, cut.side, np.random.default_rng(SEED))
    tangents = strand_tangents(cards, angles)
    if cut.finish is not None:
        alpha, tangents = cut.finish(cards, alpha, tangents)
    return cards, tangents, (relief, alpha)


def with_fringe(shown: Shown, skin: HeadSkin, head: FloatArray) -> Shown:
    """Cards with a fringe, whose ribbons lie in the free part of their picture."""
    cards, tangents, pictures = shown
    generator = np.random.default_rng(SEED)
    fringe = grow_locks(skin, head, FRINGE, generator)
    left, joined = round(FREE_SHARE * pictures[0].shape[1]), []
    for picture, ribbons in zip(pictures, paint_ribbons(generator), strict=True):
        size = picture.shape[1] - left, picture.shape[0]
        wide = picture.copy()
        wide[:, left:] = np.asarray(Image.fromarray(ribbons).resize(size, Image.Resampling.BILINEAR))
        joined.append(wide)
    start = left / pictures[0].shape[1]
    n, n_places = len(cards.vertices), int(cards.weld.max()) + 1
    both = Cards(
        np.concatenate([cards.vertices, fringe.vertices]),
        np.concatenate([cards.triangles, fringe.triangles + n]),
        np.concatenate([cards.uv, [start, 0.0] + fringe.uv * [1 - start, 1.0]]),
        np.concatenate([cards.weld, fringe.weld + n_places]),
    )
    return both, np.concatenate([tangents, lock_tangents(fringe, FRINGE.n_steps)]), (joined[0], joined[1])


def _on_head(shown: Shown, skin: HeadSkin, head: FloatArray, metadata: Mapping[str, str]) -> Hair:
    """Cards as a haircut of a head with vertices (V, 3), whose scalp is painted under them, wholly under grown ones."""
    cards, tangents, (relief, alpha) = shown
    share = np.ones(len(skin.vertices))
    if metadata["name"] not in GROWN:
        share = covered_share(skin, solid_points(cards, alpha, np.random.default_rng(SEED)))
    anchors = choose_anchors(head)
    return Hair(
        vertices=cards.vertices.astype(np.float32),
        triangles=cards.triangles.astype(np.int32),
        uv=cards.uv.astype(np.float32),
        tangents=tangents.astype(np.float32),
        pictures=(relief, alpha, paint_scalp(skin, share, SCALP_SIDE, np.random.default_rng(SEED))),
        anchors=anchors.astype(np.int32),
        anchor_places=head[anchors].astype(np.float32),
        n_face_vertices=len(head),
        metadata=metadata,
    )


def build_cropped(skin: HeadSkin, head: FloatArray, name: str = CROPPED, cover: float = 1.0) -> Hair:
    """Hair of a few millimetres: painted, with a layer of fuzz above the scalp; shaved with a share of its coverage."""
    generator = np.random.default_rng(SEED)
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)
    grown = hair_share(skin.vertices)[skin.quads].max(axis=1) > 0.0
    used, quads = np.unique(skin.quads[grown], return_inverse=True)
    vertices = skin.vertices[used] + FUZZ_MM * normals[used]
    triangles, uv = triangulate(quads.reshape(-1, 4)), flatten_skull(vertices)
    anchors = choose_anchors(head)
    fuzz, scalp = (
        paint_fuzz(skin.vertices[used], triangles, uv, generator),
        paint_stubble(skin, STUBBLE_SIDE, generator),
    )
    if cover < 1:
        fuzz, scalp = np.zeros_like(fuzz), share_levels(cover * scalp.astype(np.float64) / 255.0)
    return Hair(
        vertices=vertices.astype(np.float32),
        triangles=triangles.astype(np.int32),
        uv=uv.astype(np.float32),
        tangents=normals[used].astype(np.float32),
        pictures=(np.full((FUZZ_SIDE, FUZZ_SIDE), 128, np.uint8), fuzz, scalp),
        anchors=anchors.astype(np.int32),
        anchor_places=head[anchors].astype(np.float32),
        n_face_vertices=len(head),
        metadata=_metadata(name, "cropped to a few millimetres" if name == CROPPED else "shaved, with stubble"),
    )


def paint_fuzz(
    places: FloatArray, triangles: IntArray, uv: FloatArray, generator: np.random.Generator
) -> NDArray[np.uint8]:
    """(FUZZ_SIDE, FUZZ_SIDE) coverage of a layer with vertices above `places` (N, 3): none at the hairline."""
    texels = find_texels(uv, triangles, FUZZ_SIDE)
    place = texels.interpolate(places)
    cover = FUZZ * stubble_share(place) ** 4 * np.clip(1 + value_noise(place, 0.9, generator), 0, 3)
    alpha = np.zeros((FUZZ_SIDE, FUZZ_SIDE))
    alpha[texels.rows, texels.columns] = np.clip(cover, 0, 1)
    return share_levels(alpha)


def flatten_skull(places: FloatArray) -> FloatArray:
    """(N, 2) texture coordinates by the direction about the crown and the angle from it, of places (N, 3)."""
    off = places - MIDDLE
    angle = np.arccos(off[:, 1] / np.linalg.norm(off, axis=1)) / np.pi
    across = off[:, [0, 2]] / np.maximum(np.linalg.norm(off[:, [0, 2]], axis=1, keepdims=True), 1e-9)
    flat: FloatArray = 0.5 + 0.5 * angle[:, None] * across
    return flat


def _metadata(name: str, summary: str) -> dict[str, str]:
    return {
        "name": name,
        "summary": summary,
        "licence": "CC0-1.0",
        "attribution": "MakeHuman team: Data Collection AB, Joel Palmius, Jonas Hauquier",
        "made_by": "python -m corpus_tools.shipped.make_models",
    }


def split_seams(asset: Asset, places: FloatArray) -> Cards:
    """Cards of an asset at places (N, 3), with a vertex for each pair of place and texture coordinates."""
    pairs = np.stack([asset.triangles.ravel(), asset.uv_triangles.ravel()], axis=1)
    unique, corners = np.unique(pairs, axis=0, return_inverse=True)
    return Cards(places[unique[:, 0]], corners.reshape(-1, 3), asset.uv[unique[:, 1]], unique[:, 0])


def solid_points(cards: Cards, alpha: NDArray[np.uint8], generator: np.random.Generator) -> FloatArray:
    """(S, 3) random points on the cards, spread by area, where the strands are dense."""
    corners = cards.vertices[cards.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = generator.choice(len(area), N_SAMPLES, p=area / area.sum())
    weights = generator.dirichlet(np.ones(3), N_SAMPLES)
    points = np.einsum("sk,skd->sd", weights, corners[chosen])
    where = np.einsum("sk,skd->sd", weights, cards.uv[cards.triangles[chosen]])
    texel = np.clip((where * len(alpha)).astype(np.int64), 0, len(alpha) - 1)
    solid: FloatArray = points[alpha[texel[:, 1], texel[:, 0]] > 255 * SOLID]
    return solid


def choose_anchors(head: FloatArray) -> IntArray:
    """(A,) vertices spread over a head (V, 3): each is the farthest from those before it."""
    chosen = [int(head[:, 1].argmax())]
    distance = np.linalg.norm(head - head[chosen[0]], axis=1)
    while len(chosen) < N_ANCHORS:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(head - head[chosen[-1]], axis=1))
    return np.array(sorted(chosen), np.int64)
