"""A small organ and its splat for the simulation's tests: an ellipsoid of 120 x 70 x 50 mm before the camera."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from organphys.asset.asset_file import save_asset
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.basis.reduced_basis import ReducedBasis
from organphys.basis.rkpm import rkpm_weights
from organphys.exports.gaussian_ply import write_gaussians
from organphys.ground.frames import Normalisation, Similarity
from organphys.points.gaussians import SH_C0, Gaussians

AXES_MM = np.array([60.0, 35.0, 25.0])
SCALE = 0.01  # scene units per mm
DEPTH = 1.5  # scene units from the camera
FINENESS = {"handles": 8, "quadrature": 300}


class ExampleFiles(NamedTuple):
    """An .organphys file and a splat .ply."""

    asset: Path
    splat: Path


def write_example(folder: Path, gaussians: int = 3000) -> ExampleFiles:
    """Both files, made in a second or two."""
    organ = example_organ()
    save_asset(organ, folder / "organ.organphys")
    write_gaussians(folder / "splat.ply", example_gaussians(organ, gaussians))
    return ExampleFiles(folder / "organ.organphys", folder / "splat.ply")


def example_organ() -> RegisteredOrgan:
    """An ellipsoid, registered without a deformation."""
    vertices, faces = _ellipsoid()
    ball = np.random.default_rng(0).normal(size=(3000, 5))
    points = 0.97 * AXES_MM * ball[:, :3] / np.linalg.norm(ball, axis=1, keepdims=True)
    normalisation = Normalisation(vertices.mean(0), 60.0)
    x = normalisation.apply(points)
    basis = ReducedBasis.whitened(rkpm_weights(x, handles=6, nodes=60, samples=800), x)
    return RegisteredOrgan(
        T_scene_ct=Similarity(SCALE, np.eye(3), np.array([0.0, 0.0, DEPTH])),
        normalisation=normalisation,
        basis=basis,
        z=np.zeros((basis.size, 3)),
        vertices=vertices,
        faces=faces,
        volume_points=points,
        quadrature_points=points[:200],
        quadrature_weights=np.full(200, 1 / 200),
        volume_ml=4 / 3 * np.pi * AXES_MM.prod() / 1000,
        name="liver",
    )


def example_gaussians(organ: RegisteredOrgan, count: int) -> Gaussians:
    """Flat Gaussians on the organ's surface, striped, and a wall behind it that is not bound to it."""
    rng = np.random.default_rng(1)
    faces = organ.faces[rng.integers(len(organ.faces), size=count)]
    weights = rng.dirichlet(np.ones(3), size=count)
    means = np.einsum("nk,nkd->nd", weights, organ.scene_vertices[faces])
    wall = rng.uniform([-1, -0.8, DEPTH + 0.6], [1, 0.8, DEPTH + 0.6], size=(count // 3, 3))
    means = np.concatenate([means, wall]).astype(np.float32)
    colours = np.tile([0.72, 0.30, 0.27], (len(means), 1))
    colours[np.sin(40 * means[:, 0]) > 0] = [0.85, 0.45, 0.38]
    colours[count:] = [0.30, 0.32, 0.38]
    sizes = np.full((len(means), 3), 0.02)
    sizes[count:] = 0.06
    return Gaussians(
        means=means,
        log_scales=np.log(sizes * [1.0, 1.0, 0.6]).astype(np.float32),
        quaternions=np.tile(np.float32([1, 0, 0, 0]), (len(means), 1)),
        opacity_logits=np.full(len(means), 3.0, dtype=np.float32),
        sh_dc=((colours - 0.5) / SH_C0).astype(np.float32),
        sh_rest=np.zeros((len(means), 3, 0), dtype=np.float32),
        valid=np.ones(len(means), dtype=bool),
    )


def _ellipsoid(rings: int = 20, around: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Closed surface in CT mm, faces counter-clockwise from outside."""
    polar, angle = np.linspace(0, np.pi, rings + 1)[1:-1], np.arange(around) * 2 * np.pi / around
    ring = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)),
            np.outer(np.sin(polar), np.sin(angle)),
            np.outer(np.cos(polar), np.ones(around)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    vertices = np.concatenate([[[0, 0, 1.0]], ring, [[0, 0, -1.0]]])
    k = np.arange(around)
    next_k, last = (k + 1) % around, len(vertices) - 1
    faces = [np.stack([0 * k, 1 + k, 1 + next_k], 1)]
    for row in range(rings - 2):
        a, b = 1 + row * around + k, 1 + row * around + next_k
        faces += [np.stack([a, a + around, b], 1), np.stack([b, a + around, b + around], 1)]
    start = 1 + (rings - 2) * around
    faces.append(np.stack([start + k, 0 * k + last, start + next_k], 1))
    return vertices * AXES_MM, np.concatenate(faces)
