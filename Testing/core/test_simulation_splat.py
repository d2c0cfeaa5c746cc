"""Gaussians that follow a body: against differences of the motion itself, and written and read again."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulation_examples import SIZE, box_body

from organphys.exports.gaussian_ply import write_gaussians
from organphys.ground.checks import InputError
from organphys.points.gaussians import Gaussians
from organphys.readers.gaussian_ply import read_gaussians
from organphys.simulation.gaussian_shapes import covariances
from organphys.simulation.local_detail import LocalDetail, with_detail
from organphys.simulation.moved_splat import moved_splat, polar_rotations
from organphys.simulation.spherical_harmonics import harmonics, rotated_harmonics
from organphys.simulation.splat_binding import bind_splat

UNIT = 0.1  # metres per scene unit
BAND = {"distance": 0.002, "band": 0.004}


def splat(points_m, dimensions=3, degree=2, seed=0):
    rng, count = np.random.default_rng(seed), len(points_m)
    quaternions = rng.normal(size=(count, 4)) if dimensions else np.zeros((count, 0))
    return Gaussians(
        means=(points_m / UNIT).astype(np.float32),
        log_scales=np.log(rng.uniform(0.001, 0.02, (count, dimensions))).astype(np.float32),
        quaternions=quaternions.astype(np.float32),
        opacity_logits=rng.normal(size=count).astype(np.float32),
        sh_dc=rng.normal(size=(count, 3)).astype(np.float32),
        sh_rest=rng.normal(size=(count, 3, (degree + 1) ** 2 - 1)).astype(np.float32),
        valid=np.ones(count, dtype=bool),
        extra={"label": np.arange(count, dtype=np.uint8)},
    )


def points(count=300, seed=1):
    """In the box, round it, and far away (the last ten)."""
    x = np.random.default_rng(seed).uniform(-0.1, 1.1, (count, 3)) * SIZE
    x[-10:] += 1.0
    return x


def bent(body, size=0.3):
    z = np.random.default_rng(3).normal(size=(body.basis.size, 3))
    return z * size / np.abs(body.strain.rates(z)).max()


@pytest.mark.parametrize("local", [False, True])
def test_gradients_are_those_of_the_motion_in_the_body_and_in_the_band(local):
    body = box_body()
    x = points()
    x[:40] = [0.05, 0.02, 0.038] + 0.004 * (x[:40] / SIZE - 0.5)
    binding = bind_splat(body, splat(x), UNIT, **BAND)
    if local:
        body = with_detail(body, np.array([0.05, 0.02, 0.04]), LocalDetail(radius=0.008))
    z, step = bent(body), 2e-5
    u, f = binding.motion(body, z)
    fading = (binding.share > 0.05) & (binding.share < 0.95)
    assert fading.sum() > 10 and (binding.share == 1).sum() > 100
    for m in range(3):
        ends = []
        for side in (-step, step):
            moved = x.copy()
            moved[binding.index, m] += side
            again = bind_splat(box_body(), splat(moved), UNIT, **BAND)
            row = np.searchsorted(again.index, np.intersect1d(binding.index, again.index))
            ends.append((again.index[row], again.motion(body, z)[0][row] * UNIT))
        both = np.intersect1d(ends[0][0], ends[1][0])
        high, low = (e[1][np.searchsorted(e[0], both)] for e in ends[::-1])
        slope = (high - low) / (2 * step) + np.eye(3)[m]
        mine = f[np.searchsorted(binding.index, both), :, m]
        # the closest surface point jumps along the edges of the box's neighbourhood: the few there are left out
        error = np.abs(slope - mine).max(1)
        assert np.quantile(error, 0.93) < 0.02 * np.abs(mine - np.eye(3)[m]).max()
    exact = body.basis.phi(binding.points) @ z / UNIT
    assert np.abs(u - binding.share[:, None] * exact).max() < 1e-5 * np.abs(exact).max()


def test_covariances_are_those_of_the_mapped_samples():
    body = box_body()
    x = np.tile(SIZE / 2, (1, 1))
    gaussians = splat(x)
    binding = bind_splat(body, gaussians, UNIT)
    z = bent(body)
    _, covariance = binding.frame(body, z)
    noise = 0.02 * np.random.default_rng(0).normal(size=(200_000, 3))
    cloud = x + noise @ np.linalg.cholesky(covariances(gaussians, np.array([0]))[0]).T * UNIT
    moved = (cloud + body.basis.phi(cloud) @ z) / UNIT
    assert np.allclose(np.cov(moved.T) / 0.02**2, covariance[0], atol=0.02 * np.abs(covariance[0]).max())


@pytest.mark.parametrize("dimensions", [3, 2])
def test_scales_and_quaternions_written_give_the_same_covariances(dimensions):
    body, gaussians = box_body(), splat(points(), dimensions)
    binding = bind_splat(body, gaussians, UNIT, **BAND)
    z = bent(body)
    moved = moved_splat(gaussians, binding, body, z)
    u, expected = binding.frame(body, z)
    written = covariances(moved, binding.index)
    assert np.abs(written - expected).max() < 1e-4 * np.abs(expected).max()
    assert np.allclose(moved.means[binding.index], gaussians.means[binding.index] + u, atol=1e-6)
    free = np.setdiff1d(np.arange(len(gaussians)), binding.index)
    assert len(free) >= 10
    for name in ("means", "log_scales", "quaternions", "sh_rest"):
        assert np.array_equal(getattr(moved, name)[free], getattr(gaussians, name)[free])


def test_plain_points_and_masked_gaussians():
    body, gaussians = box_body(), splat(points(), dimensions=0, degree=0)
    gaussians.valid[:5] = False
    gaussians.means[:5] = np.nan
    binding = bind_splat(body, gaussians, UNIT, **BAND)
    assert binding.index.min() >= 5
    moved = moved_splat(gaussians, binding, body, bent(body))
    assert np.isnan(moved.means[:5]).all() and np.isfinite(moved.means[5:]).all()
    with pytest.raises(InputError, match="is the scale right"):
        bind_splat(body, gaussians, 1000.0)
    with pytest.raises(InputError, match="distance"):
        bind_splat(body, gaussians, UNIT, distance=-1.0)


def test_a_turn_of_the_body_turns_gaussians_and_colours():
    body, gaussians = box_body(), splat(points(), degree=4)
    turn = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix()
    z = body.basis.affine_coordinates(turn - np.eye(3), np.zeros(3))
    binding = bind_splat(body, gaussians, UNIT, distance=0.02)
    whole = binding.share == 1
    f = binding.motion(body, z)[1]
    assert np.allclose(f[whole], turn, atol=1e-5)
    assert np.allclose(polar_rotations(f[whole].astype(float)), turn, atol=1e-5)
    moved = moved_splat(gaussians, binding, body, z)
    d = np.random.default_rng(0).normal(size=(50, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    columns = np.concatenate([harmonics(d, k) for k in range(1, 5)], axis=1)
    turned = np.concatenate([harmonics(d @ turn.T, k) for k in range(1, 5)], axis=1)
    for k in binding.index[whole][:20]:
        assert np.allclose(turned @ moved.sh_rest[k].T, columns @ gaussians.sh_rest[k].T, atol=2e-4)
    same = rotated_harmonics(gaussians.sh_rest[:5], np.tile(np.eye(3), (5, 1, 1)))
    assert np.allclose(same, gaussians.sh_rest[:5], atol=1e-5)


def test_a_written_splat_reads_back_row_by_row(tmp_path):
    gaussians = splat(points(), degree=3)
    write_gaussians(tmp_path / "frame.ply", gaussians)
    again = read_gaussians(tmp_path / "frame.ply")
    for name in ("means", "log_scales", "quaternions", "opacity_logits", "sh_dc", "sh_rest"):
        assert np.array_equal(getattr(again, name), getattr(gaussians, name)), name
    assert np.array_equal(again.extra["label"], gaussians.extra["label"])
    write_gaussians(tmp_path / "again.ply", again)
    assert (tmp_path / "again.ply").read_bytes() != b"" and len(read_gaussians(tmp_path / "again.ply")) == 300
