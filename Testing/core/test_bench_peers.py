"""The benchmark's peers on an ellipsoid whose true place is known."""

import numpy as np
import pytest
from bench_examples import RADII, T_SCENE_CT, Bent, ball, problem
from scipy.spatial import cKDTree

from organphys.ground.frames import Similarity, rotation_about
from organphys_bench.peers.rigid_icp import rigid_icp, similarity_icp
from organphys_bench.peers.surface_extension import extended
from organphys_bench.problem.outcome import Clock

SEEN = ball(800)[0] * RADII
SEEN = SEEN[(T_SCENE_CT.turn(SEEN / RADII**2) * -T_SCENE_CT.apply(SEEN)).sum(1) > 0]


def error_mm(map_points, truth, points):
    return np.linalg.norm(map_points(points) - truth(points), axis=1).mean() / T_SCENE_CT.scale


def gap_mm(map_points, given):
    """How far the splat lies from the mapped surface."""
    surface = map_points(ball(6000)[0] * RADII)
    return cKDTree(surface).query(given.case.scene.target)[0].mean() / T_SCENE_CT.scale


def off(scale):
    """A start some degrees and millimetres beside the truth."""
    turn = rotation_about(np.array([1.0, 1.0, 0.0]), 0.08)
    return T_SCENE_CT @ Similarity(scale, turn, np.array([2.0, -1.5, 2.0]))


def test_rigid_icp_finds_a_pose_and_keeps_the_scale():
    start = off(1.0)
    given = problem(Bent(0.0), start=start)
    found = rigid_icp(given, Clock())
    assert error_mm(found.map_points, Bent(0.0), SEEN) < 0.5 * error_mm(start.apply, Bent(0.0), SEEN)
    assert found.T_scene_ct.scale == start.scale


def test_similarity_icp_mends_the_scale():
    start = off(1.05)
    found = similarity_icp(problem(Bent(0.0), start=start), Clock())
    assert abs(found.T_scene_ct.scale / T_SCENE_CT.scale - 1) < 0.01
    assert found.facts["icp_steps"] < 200


def test_coherent_drift_follows_a_bend(monkeypatch):
    pytest.importorskip("pycpd", reason="pycpd (extra 'bench') is not installed")
    from organphys_bench.peers import coherent_drift

    monkeypatch.setattr(coherent_drift, "MOVING", 250)
    monkeypatch.setattr(coherent_drift, "FIXED", 400)
    given = problem(Bent(12.0))
    rigid = gap_mm(similarity_icp(given, Clock()).map_points, given)
    clock = Clock()
    found = coherent_drift.coherent_drift(given, clock)
    assert gap_mm(found.map_points, given) < 0.7 * rigid
    assert set(clock.stages) == {"start", "icp", "drift"}


def test_amberg_follows_a_bend(monkeypatch):
    pytest.importorskip("trimesh", reason="trimesh (extra 'bench') is not installed")
    from organphys_bench.peers import amberg

    monkeypatch.setattr(amberg, "VERTICES", 250)
    given = problem(Bent(12.0))
    rigid = gap_mm(similarity_icp(given, Clock()).map_points, given)
    found = amberg.amberg(given, Clock())
    assert gap_mm(found.map_points, given) < 0.7 * rigid
    assert found.extension


def test_surface_displacements_are_carried_inside():
    vertices = ball(400)[0] * RADII
    carried = extended(vertices, Bent(5.0)(vertices), T_SCENE_CT)
    inside = 0.6 * ball(60)[0] * RADII
    assert error_mm(carried, Bent(5.0), inside) < 0.4 * error_mm(T_SCENE_CT.apply, Bent(5.0), inside)
    assert error_mm(carried, Bent(5.0), vertices) < 1e-6
