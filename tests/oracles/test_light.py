"""The shading kernels against their formulas, one fragment or vertex at a time, in double precision."""

import numpy as np

from tts2face.picture.kernels.lamps import BRIGHTNESS
from tts2face.picture.kernels.shade import (
    DARK_ALBEDO,
    INTERREFLECTION,
    KEPT_HUE,
    LIGHT_ALBEDO,
    N_SCATTER_PASSES,
    N_SCRATCH_ROWS,
    REFLECTANCE,
    SECOND_ROUGHNESS,
    SKIN_SCATTERING,
    SKY_GLOSS,
    light_vertices,
    scatter_light,
    shade_fragments,
)
from tts2face.picture.kernels.tables import (
    AT_ALBEDO,
    AT_DARK_GLOSS,
    AT_DIFFUSE,
    AT_EXPOSURE,
    AT_GLOSS,
    AT_GLOW,
    AT_NORMAL,
    AT_OPACITY,
    AT_RAY,
    AT_ROUGHNESS,
    AT_SECOND_LOBE,
    DIFFUSE,
    N_ROWS,
    N_VERTEX_COLUMNS,
    NORMAL,
)

N = 200


def random_lights(rng):
    lights = rng.uniform(0, 1, (7, 6))
    lights[2:, :3] = rng.normal(size=(5, 3))
    lights[2:, :3] /= np.linalg.norm(lights[2:, :3], axis=1, keepdims=True)
    return lights


def tone(light):
    x = BRIGHTNESS * light
    return np.minimum(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 1)


def expected(row, lights):
    """Light of one fragment."""
    normal = row[AT_NORMAL : AT_NORMAL + 3] / np.linalg.norm(row[AT_NORMAL : AT_NORMAL + 3])
    view = -np.array([*row[AT_RAY : AT_RAY + 2], 1.0])
    view /= np.linalg.norm(view)
    albedo, seen = row[AT_ALBEDO : AT_ALBEDO + 3], row[AT_EXPOSURE : AT_EXPOSURE + 4]
    facing, rough = max(normal @ view, 1e-3), row[AT_ROUGHNESS]
    bright = np.clip((albedo[:2].mean() - DARK_ALBEDO) / (LIGHT_ALBEDO - DARK_ALBEDO), 0, 1)
    gloss = row[AT_GLOSS] * (1 - row[AT_DARK_GLOSS] * (1 - bright))
    grazing = 0.25 * row[AT_GLOSS] + (1 - rough**0.25) * (1 - facing) ** 5
    grazing *= SKY_GLOSS * min(8 * row[AT_GLOSS], 1)
    shine = grazing * seen[0] ** 2 * (0.7 + 0.3 * normal @ lights[2, :3]) * lights[0, :3]
    shine = shine + row[AT_GLOW] * lights[3, 3:]
    depth = np.sqrt(rough) / 2
    for lamp, reached in zip(lights[3:], (seen[1], seen[0], seen[2], seen[3]), strict=True):
        towards = max(normal @ lamp[:3], 0)
        halfway = (lamp[:3] + view) / np.linalg.norm(lamp[:3] + view)
        cosine = max(normal @ halfway, 0)
        fresnel = 1 + (1 / REFLECTANCE - 1) * (1 - lamp[:3] @ halfway) ** 5
        lobes = [(a / (cosine**2 * (a - 1) + 1)) ** 2 for a in (rough, rough * SECOND_ROUGHNESS)]
        shadow = (towards * (1 - depth) + depth) * (facing * (1 - depth) + depth)
        both = (lobes[0] + row[AT_SECOND_LOBE] * lobes[1]) / shadow
        shine = shine + lamp[3:] * gloss * fresnel * towards * both * reached * min(1.3 * seen[0], 1)
    matt = row[AT_DIFFUSE : AT_DIFFUSE + 3] * albedo / (1 - (1 - seen[0]) ** 2 * albedo * INTERREFLECTION)
    return row[AT_OPACITY] * shown(matt + shine)


def shown(light):
    """Tone curve of (3,) light: by channel where it is bright, of the strongest channel where it is dark."""
    strongest = light.max()
    kept = KEPT_HUE * (1 - tone(strongest))
    return kept * tone(strongest) * light / strongest + (1 - kept) * tone(light)


def test_the_highlights_and_the_tone_curve_are_the_formula():
    rng = np.random.default_rng(0)
    rows = rng.uniform(0, 1, (N, N_ROWS))
    rows[:, AT_NORMAL : AT_NORMAL + 3] = rng.normal(size=(N, 3))
    rows[:, AT_RAY : AT_RAY + 2] = rng.uniform(-0.3, 0.3, (N, 2))
    rows[:, AT_ROUGHNESS] = rng.uniform(0.01, 0.5, N)
    lights = random_lights(rng)
    table, colour = np.ascontiguousarray(rows.T, np.float32), np.zeros((3, N), np.float32)
    shade_fragments(table, N, lights.astype(np.float32), np.zeros((N_SCRATCH_ROWS, N), np.float32), colour)
    wanted = np.array([expected(row, lights) for row in rows])
    np.testing.assert_allclose(colour.T, wanted, atol=2e-4)  # single precision, narrow highlights
    assert 0 <= colour.min() <= colour.max() <= 1


def test_darker_skin_has_less_gloss():
    rows = np.zeros((2, N_ROWS), np.float32)
    rows[:, AT_NORMAL + 2], rows[:, AT_EXPOSURE : AT_EXPOSURE + 4], rows[:, AT_OPACITY] = -1, 1, 1
    rows[:, AT_GLOSS], rows[:, AT_ROUGHNESS], rows[:, AT_DARK_GLOSS] = 0.1, 0.05, 0.6
    rows[0, AT_ALBEDO : AT_ALBEDO + 3], rows[1, AT_ALBEDO : AT_ALBEDO + 3] = 0.35, 0.04
    lights = random_lights(np.random.default_rng(1)).astype(np.float32)
    lights[3, :3] = (0, 0, -1)
    colour = np.zeros((3, 2), np.float32)
    shade_fragments(np.ascontiguousarray(rows.T), 2, lights, np.zeros((N_SCRATCH_ROWS, 2), np.float32), colour)
    assert colour[0, 1] < 0.7 * colour[0, 0]  # there is no diffuse light here


def diffuse(normal, position, exposure, lights, wrap):
    """Diffuse light of one vertex."""
    if wrap < 0:  # an open sheet
        wrap, normal = -1 - wrap, -normal if normal @ position > 0 else normal
    share = 0.5 + 0.5 * normal @ lights[2, :3]
    light = exposure[0] * (share * lights[0, :3] + (1 - share) * lights[1, :3])
    for lamp, seen in zip(lights[3:], exposure[1:], strict=True):
        reach = wrap * SKIN_SCATTERING
        soaked = seen + reach * seen * (1 - seen)
        light = light + lamp[3:] * soaked * np.maximum(normal @ lamp[:3] + reach, 0) / (1 + reach)
    return light


def test_the_light_of_vertices_is_the_formula():
    rng = np.random.default_rng(2)
    vertex = np.zeros((N, N_VERTEX_COLUMNS), np.float32)
    vertex[:, :3] = rng.normal(size=(N, 3))
    normals = rng.normal(size=(N, 3))
    vertex[:, NORMAL : NORMAL + 3] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    exposure, lights = rng.uniform(0, 1, (N, 5)), random_lights(rng)
    wrap = rng.uniform(0, 1, N)
    wrap[::2] = -1 - wrap[::2]
    light_vertices(exposure.astype(np.float32), lights.astype(np.float32), wrap.astype(np.float32), vertex)
    for v in range(N):
        normal = vertex[v, NORMAL : NORMAL + 3].astype(float)
        wanted = diffuse(normal, vertex[v, :3], exposure[v], lights, wrap[v])
        np.testing.assert_allclose(vertex[v, DIFFUSE : DIFFUSE + 3], wanted, atol=1e-5)


def test_scattered_light_is_a_mean_that_keeps_even_light():
    """On a strip of triangles: the mean over the vertices around by plain sums, and no change of even light."""
    triangles = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]], np.int32)
    around = [[t for t in range(4) if v in triangles[t]] for v in range(6)]
    starts = np.concatenate([[0], np.cumsum([len(a) for a in around])]).astype(np.int64)
    members = np.concatenate(around).astype(np.int32)
    share = np.full((6, 3), [0.8, 0.4, 0.1], np.float32)
    skin, every = np.arange(6, dtype=np.int32), np.arange(4, dtype=np.int32)
    light = np.random.default_rng(3).uniform(0, 1, (6, 3))
    wanted = light.copy()
    for _ in range(N_SCATTER_PASSES):
        before = wanted.copy()
        for v in range(6):
            others = [w for t in around[v] for w in triangles[t] if w != v]
            wanted[v] += share[v] * (before[others].mean(axis=0) - before[v])
    vertex = np.zeros((6, N_VERTEX_COLUMNS), np.float32)
    vertex[:, DIFFUSE : DIFFUSE + 3] = light
    scatter_light(triangles, (skin, starts, members, every), share, vertex, np.zeros((4, 3), np.float32))
    np.testing.assert_allclose(vertex[:, DIFFUSE : DIFFUSE + 3], wanted, atol=1e-6)
    vertex[:, DIFFUSE : DIFFUSE + 3] = 0.3
    scatter_light(triangles, (skin, starts, members, every), share, vertex, np.zeros((4, 3), np.float32))
    np.testing.assert_allclose(vertex[:, DIFFUSE : DIFFUSE + 3], 0.3, atol=1e-6)
