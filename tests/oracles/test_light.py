"""The lighting kernel against its formula written out plainly, one fragment at a time, in double precision."""

import numpy as np

from tts2face.render.fragments import (
    AT_ALBEDO,
    AT_EXPOSURE,
    AT_NORMAL,
    AT_OPACITY,
    AT_RAY,
    AT_SHININESS,
    AT_SPECULAR,
    AT_WRAP,
    N_ROWS,
)
from tts2face.render.shade import (
    INTERREFLECTION,
    N_SCRATCH_ROWS,
    SKIN_SCATTERING,
    SKY_GLOSS,
    TONE_SHOULDER,
    shade_fragments,
)

N = 200


def expected(row, lights):
    """Light of one fragment."""
    normal = row[AT_NORMAL : AT_NORMAL + 3] / np.linalg.norm(row[AT_NORMAL : AT_NORMAL + 3])
    view = -np.array([*row[AT_RAY : AT_RAY + 2], 1.0])
    view /= np.linalg.norm(view)
    albedo, seen = row[AT_ALBEDO : AT_ALBEDO + 3], row[AT_EXPOSURE : AT_EXPOSURE + 4]
    sky_share = 0.5 + 0.5 * normal @ lights[2, :3]
    around = seen[0] * (sky_share * lights[0, :3] + (1 - sky_share) * lights[1, :3])
    matt = around / (1 - (1 - seen[0]) * albedo * INTERREFLECTION)
    shine = SKY_GLOSS * around
    for lamp, reached in zip(lights[3:], seen[1:], strict=True):
        towards = normal @ lamp[:3]
        reach = row[AT_WRAP] * SKIN_SCATTERING
        soaked = reached + reach * reached * (1 - reached)
        matt = matt + lamp[3:] * soaked * np.maximum(towards + reach, 0) / (1 + reach)
        halfway = (lamp[:3] + view) / np.linalg.norm(lamp[:3] + view)
        off = 1 - max(normal @ halfway, 0)
        lobe = (1 + off * row[AT_SHININESS] / 8) ** -8
        shine = shine + lamp[3:] * reached * lobe * np.clip(4 * towards, 0, 1)
    gloss = row[AT_SPECULAR] * (1 + 3 * (1 - max(normal @ view, 0)) ** 3)
    value = row[AT_OPACITY] * matt * albedo + gloss * shine
    over = np.maximum(value - TONE_SHOULDER, 0) / (1 - TONE_SHOULDER)
    return np.minimum(value, TONE_SHOULDER) + (1 - TONE_SHOULDER) * over / (1 + over)


def test_the_kernel_is_the_formula():
    rng = np.random.default_rng(0)
    rows = rng.uniform(0, 1, (N, N_ROWS))
    rows[:, AT_NORMAL : AT_NORMAL + 3] = rng.normal(size=(N, 3))
    rows[:, AT_RAY : AT_RAY + 2] = rng.uniform(-0.3, 0.3, (N, 2))
    rows[:, AT_SHININESS] = rng.uniform(1, 300, N)
    lights = rng.uniform(0, 1, (6, 6))
    lights[2:, :3] = rng.normal(size=(4, 3))
    lights[2:, :3] /= np.linalg.norm(lights[2:, :3], axis=1, keepdims=True)
    table, colour = np.ascontiguousarray(rows.T, np.float32), np.zeros((3, N), np.float32)
    shade_fragments(table, N, lights.astype(np.float32), np.zeros((N_SCRATCH_ROWS, N), np.float32), colour)
    wanted = np.array([expected(row, lights) for row in rows])
    np.testing.assert_allclose(colour.T, wanted, atol=2e-4)  # single precision, highlights of exponent 300
    assert colour.min() >= 0
    assert colour.max() < 1
