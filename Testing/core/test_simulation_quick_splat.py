"""Quick followers against the exact ones: error of the grid, its order, numpy against warp's kernels."""

import importlib.util
import sys
from dataclasses import replace

import numpy as np
import pytest
from simulation_examples import box_body
from test_simulation_splat import BAND, UNIT, bent, points, splat

from organphys.exports.splat_frames import FollowingSplat
from organphys.ground.checks import InputError
from organphys.simulation import splat_numpy, splat_threads
from organphys.simulation.local_detail import LocalDetail, with_detail
from organphys.simulation.moved_splat import moved_splat
from organphys.simulation.quick_splat import on_device, quick_splat
from organphys.simulation.scene import Scene
from organphys.simulation.session import Snapshot
from organphys.simulation.splat_binding import bind_splat

HAVE_WARP = importlib.util.find_spec("warp") is not None
needs_warp = pytest.mark.skipif(not HAVE_WARP, reason="warp-lang (extra 'gpu') is not installed")
CENTRE = np.array([0.05, 0.02, 0.04])


def example(local, count=3000):
    body, x = box_body(), points(count)
    gaussians = splat(x, degree=0)
    if local:
        body = with_detail(body, CENTRE, LocalDetail(radius=0.008))
    return body, gaussians, bent(body)


def in_splat_order(splat_like, body, z):
    u, covariance = splat_like.frame(body, z)
    order = np.argsort(splat_like.index)
    return u[order] * UNIT, covariance[order], splat_like.motion(body, z)[1][order]


@pytest.mark.parametrize("local", [False, True])
def test_quick_frames_are_the_exact_ones_up_to_the_error_of_the_grid(local):
    body, gaussians, z = example(local)
    exact = bind_splat(body, gaussians, UNIT, **BAND)
    truth = in_splat_order(exact, body, z)
    errors = []
    for spacing in (0.006, 0.003):
        quick = quick_splat(body, gaussians, UNIT, **BAND, spacing=spacing)
        assert np.array_equal(np.sort(quick.index), exact.index)
        got = in_splat_order(quick, body, z)
        errors.append([np.abs(a - b).max() for a, b in zip(got, truth, strict=True)])
    moved = np.abs(truth[0]).max()
    assert errors[1][0] < 0.03 * moved and errors[1][2] < 0.1
    assert errors[1][0] < 0.4 * errors[0][0]  # second order in the spacing


def test_threads_change_nothing(monkeypatch):
    body, gaussians, z = example(False, 20_000)
    quick = quick_splat(body, gaussians, UNIT, **BAND)
    monkeypatch.setattr(splat_threads, "THREADS", 1)
    one = quick.frame(body, z)
    monkeypatch.setattr(splat_threads, "THREADS", 2)
    monkeypatch.setattr(splat_numpy, "CHUNK", 1024)
    two = quick_splat(body, gaussians, UNIT, **BAND).frame(body, z)
    assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))


@needs_warp
@pytest.mark.parametrize("local", [False, True])
def test_warp_moves_gaussians_as_numpy_does(local):
    body, gaussians, z = example(local)
    quick = quick_splat(body, gaussians, UNIT, **BAND)
    warp = on_device(quick, "cpu")
    for of_numpy, of_warp in ((quick.frame, warp.frame), (quick.motion, warp.motion)):
        for mine, other in zip(of_numpy(body, z), of_warp(body, z), strict=True):
            assert np.abs(mine - other).max() < 2e-5 * np.abs(mine).max()


@needs_warp
def test_the_kernel_of_the_nodes_moves_them_as_numpy_does():
    """A GPU moves the nodes too; here the same kernel runs on the CPU."""
    from organphys.simulation.splat_warp import WarpMover

    body, gaussians, z = example(True)
    quick = quick_splat(body, gaussians, UNIT, **BAND)
    nodes_too = WarpMover(quick.bound, quick.grid, quick.exact.covariance, "cpu", nodes_too=True)
    for mine, other in zip(quick.frame(body, z), replace(quick, mover=nodes_too).frame(body, z), strict=True):
        assert np.abs(mine - other).max() < 2e-5 * np.abs(mine).max()


@needs_warp
def test_a_splat_that_follows_by_warp_stays_beside_the_exact_one():
    body, gaussians, z = example(False, 500)
    scene = Scene((body,), ())
    state = scene.initial_state()
    moved = replace(state, bodies=(replace(state.bodies[0], z=z),))
    moment = Snapshot(scene, moved)
    exact, quick = (FollowingSplat(gaussians, body, UNIT, device=device).at(moment) for device in (None, "cpu"))
    assert np.abs(exact.means - quick.means).max() * UNIT < 3e-4
    assert np.abs(exact.means - gaussians.means).max() * UNIT > 3e-3


@needs_warp
def test_a_device_that_is_not_there_is_named():
    import warp

    body, gaussians, _ = example(False, 100)
    if warp.is_cuda_available():
        pytest.skip("there is a CUDA device")
    with pytest.raises(InputError, match="no CUDA device"):
        quick_splat(body, gaussians, UNIT, **BAND, device="cuda")


def test_without_warp_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "warp", None)
    body, gaussians, _ = example(False, 100)
    with pytest.raises(InputError, match=r"organphys\[gpu\]"):
        quick_splat(body, gaussians, UNIT, **BAND, device="cpu")
    with pytest.raises(InputError, match="device"):
        quick_splat(body, gaussians, UNIT, **BAND, device="tpu")


def test_quick_followers_can_be_exported():
    body, gaussians, z = example(False, 300)
    exact = moved_splat(gaussians, bind_splat(body, gaussians, UNIT, **BAND), body, z)
    quick = moved_splat(gaussians, quick_splat(body, gaussians, UNIT, **BAND), body, z)
    assert np.abs(exact.means - quick.means).max() * UNIT < 3e-4
    assert np.array_equal(quick.means[-10:], gaussians.means[-10:])
