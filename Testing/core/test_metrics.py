"""Trimmed means, distances in mm and in the paper's unit, volume drift and strains: known answers."""

import numpy as np
import pytest

from organphys.align.metrics import (
    strain_percentiles,
    surface_distances,
    trimmed_mean,
    trimmed_means,
    volume_drift_percent,
)
from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about


def test_trimmed_mean_discards_the_worst_thirty_percent():
    distances = np.array([9.0, 1.0, 100.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 50.0])
    assert trimmed_mean(distances) == pytest.approx(4.0)  # 1..7
    assert trimmed_mean(distances, 0.0) == pytest.approx(distances.mean())
    assert trimmed_mean(distances, 0.9) == 1.0
    assert trimmed_mean(np.array([3.0])) == 3.0
    rows = np.stack([distances, 2 * distances])
    np.testing.assert_allclose(trimmed_means(rows), [4.0, 8.0])


def test_distances_both_ways_in_mm_and_normalised():
    plane = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0), [0.0]), -1).reshape(-1, 3)
    half = plane[plane[:, 0] < 5] + [0, 0, 0.25]
    found = surface_distances(plane, half, mm_per_unit=4.0, box_mm=20.0)
    assert found.mean_splat_to_ct_mm == pytest.approx(1.0) and found.trim30_splat_to_ct_mm == pytest.approx(1.0)
    expected = 4 * np.hypot(np.maximum(plane[:, 0] - 4, 0), 0.25)
    assert found.mean_ct_to_splat_mm == pytest.approx(expected.mean())
    assert found.trim30_ct_to_splat_mm == pytest.approx(np.sort(expected)[:70].mean())
    assert found.mean_ct_to_splat_normalised == pytest.approx(expected.mean() / 20)
    metrics = found.as_metrics()
    assert metrics["mean_ct_to_splat"] == {"value": pytest.approx(expected.mean()), "unit": "mm"}
    assert metrics["trim30_ct_to_splat_normalised"]["unit"] == "CT unit box"
    with pytest.raises(InputError, match="at least one"):
        surface_distances(plane, plane[:0], mm_per_unit=1.0, box_mm=1.0)


def test_volume_drift_and_strains_of_known_deformations():
    rotation = rotation_about(np.array([1.0, 0.0, 1.0]), 0.4)
    f = np.stack([rotation @ np.diag([1.2, 1.0, 0.9]), np.eye(3)])
    assert volume_drift_percent(f) == pytest.approx(100 * (1.08 + 1) / 2 - 100)
    assert volume_drift_percent(f, np.array([1.0, 0.0])) == pytest.approx(8.0)
    strains = strain_percentiles(f, (0, 100))
    np.testing.assert_allclose(strains["largest_stretch"], [1.0, 1.2], rtol=1e-12)
    np.testing.assert_allclose(strains["smallest_stretch"], [0.9, 1.0], rtol=1e-12)
