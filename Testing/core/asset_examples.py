"""A small registered organ for the asset and export tests: a bent ellipsoid."""

import numpy as np

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.basis.reduced_basis import ReducedBasis
from organphys.basis.rkpm import rkpm_weights
from organphys.ground.frames import Normalisation, Similarity, rotation_about

AXES_MM = np.array([60.0, 35.0, 25.0])
CENTRE_MM = np.array([20.0, -40.0, 110.0])


def ellipsoid(rings: int = 24, around: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """Closed surface: vertices (Nv, 3) in CT mm, faces counter-clockwise seen from outside."""
    polar = np.linspace(0, np.pi, rings + 1)[1:-1]
    angle = np.arange(around) * 2 * np.pi / around
    ring = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)),
            np.outer(np.sin(polar), np.sin(angle)),
            np.outer(np.cos(polar), np.ones(around)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    vertices = np.concatenate([[[0, 0, 1.0]], ring, [[0, 0, -1.0]]])
    k, last = np.arange(around), len(vertices) - 1
    following = (k + 1) % around
    faces = [np.stack([0 * k, 1 + k, 1 + following], 1)]
    for row in range(rings - 2):
        a, b = 1 + row * around + k, 1 + row * around + following
        faces += [np.stack([a, a + around, b], 1), np.stack([b, a + around, b + around], 1)]
    start = 1 + (rings - 2) * around
    faces.append(np.stack([start + k, 0 * k + last, start + following], 1))
    return CENTRE_MM + vertices * AXES_MM, np.concatenate(faces)


def inside_points(count: int, seed: int = 0) -> np.ndarray:
    ball = np.random.default_rng(seed).normal(size=(count, 4))
    return CENTRE_MM + 0.98 * AXES_MM * ball[:, :3] / np.linalg.norm(ball, axis=1, keepdims=True)


def bent_organ(strength: float = 1.0, mm_per_scene_unit: float | None = None) -> RegisteredOrgan:
    """An ellipsoid bent by up to 9 mm * strength, 12 handles."""
    vertices, faces = ellipsoid()
    volume = inside_points(3000)
    normalisation = Normalisation(vertices.mean(0), 40.0)
    x = normalisation.apply(volume)
    basis = ReducedBasis.whitened(rkpm_weights(x, handles=12, nodes=120, samples=1500), x)
    u = strength * np.stack([-0.1 * x[:, 0] * x[:, 2], 0.05 * np.sin(2 * x[:, 0]), 0.1 * x[:, 0] ** 2], axis=1)
    z = np.linalg.lstsq(basis.phi(x), u, rcond=None)[0]
    return RegisteredOrgan(
        T_scene_ct=Similarity(0.01, rotation_about(np.array([1.0, 2, 3]), 0.7), np.array([0.1, -0.2, 1.5])),
        normalisation=normalisation,
        basis=basis,
        z=z,
        vertices=vertices,
        faces=faces,
        volume_points=volume,
        quadrature_points=volume[:200],
        quadrature_weights=np.full(200, 1 / 200),
        volume_ml=4 / 3 * np.pi * AXES_MM.prod() / 1000,
        name="ellipsoid",
        tissue={"youngs_pa": 5000.0, "nu": 0.45},
        mm_per_scene_unit=mm_per_scene_unit,
        provenance={"seed": 0, "inputs": {"splat.ply": "00ff"}},
    )
