"""The benchmark's figures against known answers."""

import bench_examples  # noqa: F401  (puts the benchmarks on the path)
import numpy as np

from organphys.ground.frames import Similarity, rotation_about
from organphys.pipeline.evaluation import Truth
from organphys_bench.figures.accuracy import oracle_mean_mm, tre_figures
from organphys_bench.figures.deformation import deformation_figures, map_gradients
from organphys_bench.figures.residuals import residual_figures

T_SCENE_CT = Similarity(0.02, rotation_about(np.array([1.0, 0.5, 0.0]), 0.8), np.array([1.0, 2.0, 3.0]))
STRETCH = np.array([[1.1, 0.05, 0.0], [0.0, 0.95, 0.0], [0.0, 0.0, 1.02]])


def points(count=300):
    return np.random.default_rng(0).uniform(-30, 30, (count, 3))


def stretched(points_ct):
    return T_SCENE_CT.apply(points_ct @ STRETCH.T)


def test_gradients_of_an_affine_map_are_its_matrix():
    assert np.allclose(map_gradients(stretched, T_SCENE_CT, points(20)), STRETCH, atol=1e-9)


def test_volume_and_stretches_are_beyond_the_similarity():
    figures = deformation_figures(stretched, T_SCENE_CT, points())
    assert np.isclose(figures["volume_drift_percent"], 100 * (np.linalg.det(STRETCH) - 1))
    assert np.isclose(figures["min_det_f"], figures["max_det_f"])
    assert np.isclose(figures["largest_stretch"]["p50"], np.linalg.svd(STRETCH)[1][0])
    assert np.isclose(deformation_figures(T_SCENE_CT.apply, T_SCENE_CT, points())["volume_drift_percent"], 0)


def test_tre_is_in_mm_by_region():
    ct = points(30)
    truth = Truth(ct, T_SCENE_CT.apply(ct), np.repeat([0, 1, 2], 10), 50.0)
    moved = ct + np.repeat([1.0, 2.0, 6.0], 10)[:, None] * np.array([1.0, 0.0, 0.0])
    figures = tre_figures(truth, T_SCENE_CT.apply(moved))
    assert np.allclose([figures[name]["mean"] for name in ("visible", "hidden", "interior", "all")], [1, 2, 6, 3])
    assert np.isclose(figures["all"]["max"], 6)
    assert oracle_mean_mm(truth) < 1e-9


def test_residuals_are_in_mm_and_in_the_papers_unit():
    surface = points(400)
    target = T_SCENE_CT.apply(surface + np.array([0.0, 0.0, 0.5]))[:100]
    figures = residual_figures(surface, T_SCENE_CT.apply(surface), target, mm_per_unit=50.0)
    assert np.isclose(figures["mean_splat_to_ct_mm"], 0.5)
    box = np.abs(surface - surface.mean(0)).max()
    assert np.isclose(figures["mean_splat_to_ct_normalised"], 0.5 / box)
    assert figures["trim30_ct_to_splat_mm"] < figures["mean_ct_to_splat_mm"]
    assert figures["mean_ct_to_splat_mm"] > 2 * figures["mean_splat_to_ct_mm"]
