"""The organ as tetrahedra in normalised coordinates, and points carried by them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from organphys.exports.tetrahedra import TetrahedralMesh, tetrahedra
from organphys.ground.checks import Array
from organphys.points.point_sets import Organ

CANDIDATES = 24  # tetrahedra with the nearest centres, among which the one that holds a point is looked for


@dataclass(frozen=True)
class Carried:
    """Points as affine combinations of a tetrahedron's nodes: cells (K,), barycentric (K, 4) summing to 1; one or more
    negative where the point lies outside the mesh."""

    cells: NDArray[np.int64]
    barycentric: Array


@dataclass(frozen=True)
class OrganMesh(TetrahedralMesh):
    """Tetrahedra as finite elements."""

    @cached_property
    def slopes(self) -> Array:
        """Gradients (M, 4, 3) of the four linear shape functions."""
        corners = self.nodes[self.cells]
        inverse = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))  # rows: gradients of 1, 2, 3
        return np.concatenate([-inverse.sum(1, keepdims=True), inverse], axis=1)

    @cached_property
    def _centres(self) -> cKDTree:
        return cKDTree(self.nodes[self.cells].mean(1))

    def carry(self, points: Array) -> Carried:
        """Points (K, 3): each by the tetrahedron it lies in, or out of which it lies least."""
        near = self._centres.query(points, k=min(CANDIDATES, len(self.cells)))[1]
        offset = points[:, None] - self.nodes[self.cells[near, 0]]
        later = np.einsum("kcid,kcd->kci", self.slopes[near, 1:], offset)
        barycentric = np.concatenate([1 - later.sum(2, keepdims=True), later], axis=2)
        best = barycentric.min(2).argmax(1)
        rows = np.arange(len(points))
        return Carried(near[rows, best], barycentric[rows, best])

    def moved(self, carried: Carried, displacement: Array) -> Array:
        """Displacement (K, 3) of carried points under nodal displacements (N, 3)."""
        return np.einsum("ki,kid->kd", carried.barycentric, displacement[self.cells[carried.cells]])

    def gradients(self, displacement: Array) -> Array:
        """Deformation gradients F (M, 3, 3), [a, m] = delta + d u_a / d X_m."""
        return np.eye(3) + np.einsum("cia,cim->cam", displacement[self.cells], self.slopes)


def mesh_of(organ: Organ, *, cells: int) -> tuple[Array, NDArray[np.int64]]:
    """Nodes (N, 3) in RAS mm and tetrahedra of the organ, about ``cells`` of them."""
    cubed = 6 * np.sqrt(2) * organ.volume_ml * 1000 / cells  # regular tetrahedra: volume edge^3 / (6 sqrt 2)
    mesh = tetrahedra(organ.vertices, organ.faces, edge=float(cubed ** (1 / 3)))
    return mesh.nodes, mesh.cells
