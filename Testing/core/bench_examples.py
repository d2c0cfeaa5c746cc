"""A small problem with known answer for the benchmark's peers: an ellipsoid, bent, scaled and seen from one side."""

import sys
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from scipy.spatial import ConvexHull

from organphys.ground.frames import Normalisation, Similarity, rotation_about
from organphys.points.point_sets import Camera
from organphys.points.surface_samples import SurfaceSamples
from organphys_bench.runs.conditions import Condition
from organphys_bench.runs.run_file import RunKey

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
sys.path.append(str(BENCHMARKS))

KEY = RunKey("tiny", "rigid_icp", Condition())
"""Of the run that the fixture ``finished`` makes."""
RADII = np.array([40.0, 30.0, 22.0])
T_SCENE_CT = Similarity(0.01, rotation_about(np.array([0.2, 1.0, 0.1]), 0.3), np.array([0.05, -0.02, 2.0]))


def ball(count):
    """Unit sphere: vertices (N, 3) and faces turned outward."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    points = np.column_stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z])
    faces = ConvexHull(points).simplices
    corners = points[faces]
    inward = (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * corners[:, 0]).sum(1) < 0
    return points, np.where(inward[:, None], faces[:, ::-1], faces).astype(np.int64)


@dataclass(frozen=True)
class Bent:
    """x moves by ``mm`` (x_0 / 40)^2 along axis 2, then by T_SCENE_CT."""

    mm: float

    def __call__(self, points_ct):
        shift = np.zeros_like(points_ct)
        shift[:, 2] = self.mm * (points_ct[:, 0] / RADII[0]) ** 2
        return T_SCENE_CT.apply(points_ct + shift)


def problem(truth, *, start=T_SCENE_CT, seen=900):
    """What the adapters look at in a Problem; the splat: points of the side that faces the camera, by ``truth``."""
    unit, faces = ball(2500)
    vertices, normals = unit * RADII, unit / RADII
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    dense = ball(6000)[0] * RADII
    outward = dense / RADII**2
    front = (T_SCENE_CT.turn(outward) * -T_SCENE_CT.apply(dense)).sum(1) > 0
    target = truth(dense[front])[:: max(1, front.sum() // seen)]
    frame = Normalisation(vertices.mean(0), float(np.sqrt((vertices**2).sum(1).mean())))
    samples = SurfaceSamples(frame.apply(vertices), normals, 0.05, frame)
    return SimpleNamespace(
        organ=SimpleNamespace(vertices=vertices, faces=faces, vertex_normals=normals),
        case=SimpleNamespace(scene=SimpleNamespace(target=target)),
        method=SimpleNamespace(samples=samples),
        camera=Camera(),
        start=start,
        seed=0,
    )
