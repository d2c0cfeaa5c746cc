"""Even samples of the organ surface in unit-free coordinates, and an O(1) closest-sample lookup."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError
from ..ground.frames import Normalisation
from .neighbours import nearest_neighbours
from .point_sets import Organ
from .sampling import one_per_cell


@dataclass(frozen=True)
class SurfaceSamples:
    """Surface points (S, 3) and outward unit normals (S, 3) in X = (x - centre) / length.

    ``length`` is the rms distance of the samples from their centroid in mm (the unit of all lengths of the
    default method); ``spacing`` is their mean spacing in that unit.
    """

    points: Array
    normals: Array
    spacing: float
    normalisation: Normalisation

    @cached_property
    def grid(self) -> ClosestSampleGrid:
        """Lookup of the nearest sample, built once."""
        return ClosestSampleGrid(self.points)


def sample_surface(organ: Organ, *, count: int = 5000, seed: int = 0) -> SurfaceSamples:
    """At most ``count`` samples, uniform by area, thinned to one per cell of the mean spacing."""
    rng = np.random.default_rng(seed)
    corners = organ.vertices[organ.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    if not area.sum() > 0:
        raise InputError("organ surface: it has no area; check the label map")
    drawn = rng.choice(len(area), 3 * count, p=area / area.sum())
    barycentric = rng.dirichlet([1.0, 1.0, 1.0], len(drawn))[:, None, :]
    points = (barycentric @ corners[drawn])[:, 0]
    normals = (barycentric @ organ.vertex_normals[organ.faces[drawn]])[:, 0]
    kept = one_per_cell(points, np.sqrt(area.sum() / count))
    if len(kept) > count:
        kept = np.sort(rng.permutation(kept)[:count])
    points, normals = points[kept], normals[kept]
    centre = points.mean(0)
    normalisation = Normalisation(centre, float(np.sqrt(((points - centre) ** 2).sum(1).mean())))
    return SurfaceSamples(
        points=normalisation.apply(points),
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        spacing=float(np.sqrt(area.sum() / len(points)) / normalisation.length),
        normalisation=normalisation,
    )


class ClosestSampleGrid:
    """Nearest surface sample by table lookup on a regular grid round the organ; outside it the border cell answers."""

    def __init__(self, points: Array, *, cells: int = 72, margin: float = 0.7) -> None:
        low, high = points.min(0) - margin, points.max(0) + margin
        self.cell = float((high - low).max() / cells)
        self.low = low
        self.shape = np.ceil((high - low) / self.cell).astype(np.int64) + 1
        axes = [low[k] + self.cell * np.arange(self.shape[k]) for k in range(3)]
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        # eps: a table rounded to cells needs no exact neighbour
        self.nearest: NDArray[np.int32] = nearest_neighbours(cKDTree(points), nodes, eps=0.2)[1].astype(np.int32)

    def mirrored(self) -> ClosestSampleGrid:
        """The grid of the samples mirrored x -> -x, in the same order."""
        grid = copy(self)
        grid.low = self.low.copy()
        grid.low[0] = -(self.low[0] + self.cell * (self.shape[0] - 1))
        grid.nearest = self.nearest.reshape(self.shape)[::-1].ravel()
        return grid

    def lookup(self, x: NDArray[np.floating], y: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.int32]:
        """Indices of the nearest samples, any shape, for coordinates given per axis."""
        flat: NDArray[np.int32] = np.zeros(x.shape, dtype=np.int32)
        for k, coordinate in enumerate((x, y, z)):
            index = (coordinate - np.float32(self.low[k])) * np.float32(1 / self.cell) + np.float32(0.5)
            np.clip(index, 0, self.shape[k] - 1, out=index)
            flat = flat * np.int32(self.shape[k]) + index.astype(np.int32)
        return self.nearest[flat]
