"""Gaussians moved without keeping their basis: the same as those of the binding that keeps it."""

import numpy as np
import pytest
from simulation_examples import box_body
from test_simulation_quick_splat import BAND, UNIT, example

from organphys.simulation import splat_direct
from organphys.simulation.moved_splat import moved_splat
from organphys.simulation.splat_binding import bind_splat
from organphys.simulation.splat_direct import direct_splat


def test_motion_of_the_basis_is_phi_times_z_with_its_slopes():
    body = box_body()
    z = np.random.default_rng(2).normal(size=(body.basis.size, 3))
    points = body.samples.points[:50] * 1.1
    phi, slopes = body.basis.phi_and_gradient(points)
    u, gradient = body.basis.motion(z, points)
    assert np.abs(u - phi @ z).max() < 1e-10 * np.abs(u).max()
    assert np.abs(gradient - (slopes @ z).transpose(1, 2, 0)).max() < 1e-9 * np.abs(gradient).max()


@pytest.mark.parametrize("local", [False, True])
def test_direct_motion_is_that_of_the_binding(local, monkeypatch):
    monkeypatch.setattr(splat_direct, "CHUNK", 128)
    body, gaussians, z = example(local, 600)
    exact, direct = bind_splat(body, gaussians, UNIT, **BAND), direct_splat(body, gaussians, UNIT, **BAND)
    assert np.array_equal(exact.index, direct.index) and (direct.bound.share < 1).any()
    for mine, other in zip(exact.motion(body, z), direct.motion(body, z), strict=True):
        assert np.abs(mine - other).max() < 5e-6 * np.abs(mine).max()
    moved, again = (moved_splat(gaussians, binding, body, z) for binding in (exact, direct))
    assert np.abs(moved.means - again.means).max() < 5e-6 * np.abs(moved.means).max()
