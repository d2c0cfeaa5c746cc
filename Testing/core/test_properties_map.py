"""The map CT -> scene and its inverse undo each other, for organs of any pose, size of the unit and bending."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from asset_examples import bent_organ, inside_points
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.ground.frames import Similarity

ROUND_TRIP_MM = 0.01
bent = cache(bent_organ)


def organ_of(strength: float, scale: float, seed: int) -> RegisteredOrgan:
    rotation = Rotation.random(random_state=seed).as_matrix()
    translation = np.random.default_rng(seed).normal(size=3) * scale * 300
    base = bent()
    return replace(base, T_scene_ct=Similarity(scale, rotation, translation), z=strength * base.z)


@pytest.mark.parametrize(("strength", "scale", "seed"), [(-2.0, 1e-4, 1), (2.0, 1e3, 2)])
def test_there_and_back_within_the_organ(strength, scale, seed):
    organ, points = organ_of(strength, scale, seed), inside_points(500, seed)
    assert np.linalg.det(organ.deformation_gradient(points)).min() > 0
    mapped = organ.map_points(points)
    back = organ.inverse_map(mapped)
    assert back.converged.all()
    assert np.linalg.norm(back.points - points, axis=1).max() < ROUND_TRIP_MM
    assert np.linalg.norm(organ.map_points(back.points) - mapped, axis=1).max() * organ.mm_per_unit < ROUND_TRIP_MM


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.floats(-2.0, 2.0), st.floats(1e-4, 1e3), st.integers(0, 2**31))
def test_a_similarity_of_the_scene_is_one_of_the_mapped_points(strength, scale, seed):
    organ, points = organ_of(strength, 0.01, seed), inside_points(100, seed)
    moved = organ_of(strength, scale, seed + 1)
    T_moved_scene = moved.T_scene_ct @ organ.T_scene_ct.inverse()
    np.testing.assert_allclose(
        moved.map_points(points), T_moved_scene.apply(organ.map_points(points)), atol=1e-9 * scale, rtol=1e-9
    )
    assert moved.mm_per_unit == pytest.approx(1 / scale)
