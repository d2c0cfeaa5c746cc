"""Samples put on quadratic patches: on shapes whose surface is known."""

import numpy as np

from organphys.align.surface_patches import on_patches


def saddle(a, b):
    return 0.4 * a * a - 0.3 * a * b - 0.2 * b * b


def saddle_normals(a, b):
    n = np.stack([-(0.8 * a - 0.3 * b), 0.3 * a + 0.4 * b, np.ones_like(a)], axis=1)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def scattered(count, noise, seed=0):
    """Points (N, 3) of the saddle over a square of side 1, with noise along the third axis."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-0.5, 0.5, (2, count))
    return np.stack([a, b, saddle(a, b) + noise * rng.normal(size=count)], axis=1)


def angles_deg(found, a, b):
    return np.degrees(np.arccos(np.clip((found * saddle_normals(a, b)).sum(1), -1, 1)))


def test_without_noise_samples_land_on_the_curved_surface():
    points, rng = scattered(6000, 0.0), np.random.default_rng(1)
    a, b = rng.uniform(-0.35, 0.35, (2, 200))
    lifted = np.stack([a, b, saddle(a, b) + 0.02], axis=1)
    moved, normals = on_patches(points, lifted, np.tile([0.0, 0, 1], (200, 1)), neighbours=80)
    off = moved[:, 2] - saddle(moved[:, 0], moved[:, 1])
    assert np.abs(off).max() < 2e-4
    assert angles_deg(normals, moved[:, 0], moved[:, 1]).max() < 0.5


def test_noise_is_reduced_without_flattening():
    noise = 0.01
    points = scattered(12_000, noise)
    samples = points[(np.abs(points[:, :2]) < 0.4).all(1)][:800]
    moved, normals = on_patches(points, samples, np.tile([0.0, 0, 1], (len(samples), 1)), neighbours=100)
    off = moved[:, 2] - saddle(moved[:, 0], moved[:, 1])
    assert np.abs(off).mean() < 0.35 * noise and abs(off.mean()) < 0.05 * noise
    assert np.median(angles_deg(normals, moved[:, 0], moved[:, 1])) < 4


def test_an_outlier_among_the_neighbours_hardly_counts():
    points = scattered(4000, 0.0)
    points[::25, 2] += 0.3
    moved, _ = on_patches(points, np.array([[0.0, 0, 0]]), np.array([[0.0, 0, 1]]), neighbours=100)
    assert abs(moved[0, 2] - saddle(moved[0, 0], moved[0, 1])) < 0.01


def test_normals_keep_the_side_they_had():
    points = scattered(3000, 0.002)
    for side in (1.0, -1.0):
        normals = on_patches(points, points[:50], np.tile([0.0, 0, side], (50, 1)), neighbours=60)[1]
        assert (np.sign(normals[:, 2]) == side).all()


def test_neighbours_on_a_line_give_finite_results():
    line = np.linspace(0, 1, 40)[:, None] * [1.0, 0, 0]
    moved, normals = on_patches(line, line[10:20], np.tile([0.0, 0, 1], (10, 1)), neighbours=500)
    np.testing.assert_allclose(moved, line[10:20], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
