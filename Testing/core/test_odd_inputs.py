"""Odd organs and splats: each ends in a sound result, a notice, or an InputError that says what to do.

Elsewhere: twelve voxels, single points and lines (test_bad_input), a mirrored or sheared affine and the border
(test_organ_from_mask, test_readers_segmentation), poses that are not finite (test_session, test_trajectory).
"""

from __future__ import annotations

import numpy as np
from session_examples import tiny_problem

from organphys.pipeline.register import register
from organphys.points.point_sets import GaussianCloud, Organ
from organphys.readers.organ_from_mask import organ_from_mask

SPACING, SIZE = 4.0, (24, 34, 40)  # mm; voxels (k, j, i)
PER_MM = 0.02  # scene units
AWAY = np.array([0.0, 0.0, 6.0])  # of the organ's centre from the camera, scene units


def voxels() -> np.ndarray:
    """Places (K, J, I, 3) of the voxels about the middle, mm, as (x, y, z)."""
    k, j, i = np.indices(SIZE)
    return SPACING * (np.stack([i, j, k], axis=-1) - (np.array(SIZE[::-1]) - 1) / 2)


def organ(mask: np.ndarray) -> Organ:
    affine = np.diag([SPACING] * 3 + [1.0])
    affine[:3, 3] = -SPACING * (np.array(SIZE[::-1]) - 1) / 2
    return organ_from_mask(mask, affine, opening=False)


def ellipsoid(axes_mm: tuple[float, float, float] = (70.0, 55.0, 35.0)) -> np.ndarray:
    return (np.square(voxels() / axes_mm)).sum(-1) < 1


def ring() -> np.ndarray:
    """A lopsided ring: a hole goes through the organ."""
    x, y, z = np.moveaxis(voxels(), -1, 0)
    return np.hypot(np.hypot(x, 1.3 * y) - 48, z) < 18 + 0.1 * x


def cloud(points: np.ndarray) -> GaussianCloud:
    """Opaque Gaussians at points (N, 3), scene units."""
    count = len(points)
    grey = np.full((count, 3), 0.5, dtype=np.float32)
    return GaussianCloud(points.astype(np.float32), np.ones(count, np.float32), grey, np.ones(count, dtype=bool))


def seen(shape: Organ, count: int = 2500) -> GaussianCloud:
    """What a camera on the axis sees of the organ, with noise of half a millimetre."""
    rng = np.random.default_rng(0)
    front = np.flatnonzero(shape.vertex_normals[:, 2] < -0.1)
    places = shape.vertices[rng.choice(front, count)] + rng.normal(scale=0.5, size=(count, 3))
    return cloud(PER_MM * (places - shape.vertices.mean(0)) + AWAY)


def test_of_two_pieces_the_larger_is_used_and_told() -> None:
    mask = ellipsoid((40.0, 30.0, 30.0))
    larger = int(mask.sum())
    mask[:8, :9, :10] = True
    found = organ(mask)
    assert [notice.code for notice in found.notices] == ["pieces_dropped"]
    assert len(found.volume_points) == larger


def test_a_hole_through_the_organ_stays_and_registers() -> None:
    shape = organ(ring())
    assert len(shape.vertices) - 0.5 * len(shape.faces) == 0  # Euler's number of a closed surface with one hole
    with tiny_problem():
        result = register(shape, seen(shape))
    assert np.isfinite(result.organ.scene_vertices).all()
    assert result.organ.surface_det_f.min() > 0
    assert result.metrics["elastic"]["trim30_splat_to_ct"]["value"] < 4.0  # mm


def test_the_splat_of_another_organ_is_not_trusted() -> None:
    with tiny_problem():
        result = register(organ(ellipsoid((72.0, 22.0, 22.0))), seen(organ(ring())))
    assert result.verdict is not None and result.verdict.level != "trust"
    assert result.verdict.reasons


def test_a_flat_splat_is_fitted_but_not_trusted() -> None:
    """All Gaussians in one plane: the organ lies on it, and the verdict says that this is no evidence."""
    flat = np.random.default_rng(0).uniform(-1, 1, size=(800, 3)) * [1.0, 0.8, 0.0] + AWAY
    with tiny_problem():
        result = register(organ(ellipsoid()), cloud(flat))
    assert result.verdict is not None and result.verdict.level == "do not trust"
    assert np.isfinite(result.organ.scene_vertices).all() and result.organ.surface_det_f.min() > 0
