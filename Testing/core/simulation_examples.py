"""Small bodies for the simulator's tests: a box of soft tissue, 100 x 40 x 40 mm."""

from functools import lru_cache

import numpy as np

from organphys.mechanics.tissue import Tissue
from organphys.simulation.body import Body, build_body
from organphys.simulation.pins import Pin
from organphys.simulation.rest_shape import RestShape, rest_shape

SIZE = np.array([0.10, 0.04, 0.04])
TISSUE = Tissue("test", 5000.0, 0.45, 1000.0, "made up")
BOTTOM = Pin((0.05, 0.02, -0.02), 0.045)


def box_grid(size: np.ndarray, cell: float) -> np.ndarray:
    """Centres of the cubic cells of a box with one corner at the origin."""
    counts = np.rint(size / cell).astype(int)
    axes = [(np.arange(n) + 0.5) * length / n for n, length in zip(counts, size, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def box_surface(size: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Closed triangle surface of a box, outward, with vertices about ``cell`` apart."""
    vertices, faces, count = [], [], 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        n, m = (max(round(size[k] / cell), 1) for k in (u, v))
        i, j = (k.ravel() for k in np.mgrid[: n + 1, : m + 1])
        corner = (np.arange(n)[:, None] * (m + 1) + np.arange(m)).ravel()
        quads = np.stack([corner, corner + m + 1, corner + m + 2, corner + 1], axis=1)
        for side in (0, 1):
            points = np.zeros(((n + 1) * (m + 1), 3))
            points[:, axis], points[:, u], points[:, v] = side * size[axis], i * size[u] / n, j * size[v] / m
            turned = quads if side else quads[:, ::-1]
            faces += [count + turned[:, [0, 1, 2]], count + turned[:, [0, 2, 3]]]
            vertices.append(points)
            count += len(points)
    places, same = np.unique(np.concatenate(vertices).round(9), axis=0, return_inverse=True)
    return places, same.ravel()[np.concatenate(faces)]


@lru_cache(maxsize=8)
def box_shape(handles: int = 8, sample_spacing: float = 2e-3, beside: float = 0.0) -> RestShape:
    """The box, ``beside`` m along y from the origin."""
    shift = np.array([0, beside, 0])
    points = box_grid(SIZE, 0.005) + shift
    vertices, faces = box_surface(SIZE, 0.005)
    vertices = vertices + shift
    volumes = np.full(len(points), SIZE.prod() / len(points))
    return rest_shape(
        points,
        volumes,
        vertices,
        faces,
        tissue=TISSUE,
        handles=handles,
        quadrature=500,
        nodes=100,
        sample_spacing=sample_spacing,
    )


@lru_cache(maxsize=8)
def box_body(*pins: Pin, handles: int = 8, sample_spacing: float = 2e-3) -> Body:
    return build_body(box_shape(handles, sample_spacing), pins=pins, tissue=TISSUE, name="box")
