"""Sparse matrices over the nodes of a tetrahedral mesh: the pattern is found once, entries are summed into it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from organphys.ground.checks import Array
from organphys.mechanics.neo_hookean import NeoHookean

from .organ_mesh import Carried, OrganMesh


@dataclass(frozen=True)
class Assembly:
    """places (M, 144): where the entries of an element's (12, 12) matrix go among the ``count`` stored ones."""

    mesh: OrganMesh
    places: NDArray[np.int64]
    rows: NDArray[np.int32]
    starts: NDArray[np.int32]

    @classmethod
    def of(cls, mesh: OrganMesh) -> Assembly:
        dofs = (3 * mesh.cells[:, :, None] + np.arange(3)).reshape(-1, 12)
        size = 3 * len(mesh.nodes)
        keys = (dofs[:, None, :] * size + dofs[:, :, None]).reshape(-1)  # column by column
        stored, places = np.unique(keys, return_inverse=True)
        starts = np.searchsorted(stored // size, np.arange(size + 1))
        return cls(mesh, places.reshape(-1, 144), (stored % size).astype(np.int32), starts.astype(np.int32))

    def matrix(self, entries: Array) -> csc_array:
        """(3N, 3N) with stored entries (count,)."""
        size = len(self.starts) - 1
        return csc_array((entries, self.rows, self.starts), shape=(size, size))

    def summed(self, local: Array, cells: NDArray[np.int64] | None = None) -> Array:
        """Stored entries (count,) of element matrices (K, 12, 12), of all elements or of ``cells`` (K,)."""
        places = self.places if cells is None else self.places[cells]
        return np.bincount(places.ravel(), local.ravel(), len(self.rows))

    def vector(self, local: Array, cells: NDArray[np.int64] | None = None) -> Array:
        """(3N,) of element vectors (K, 4, 3)."""
        nodes = self.mesh.cells if cells is None else self.mesh.cells[cells]
        at = (3 * nodes[:, :, None] + np.arange(3)).ravel()
        return np.bincount(at, local.ravel(), len(self.starts) - 1)


@dataclass(frozen=True)
class Elasticity:
    """Sum over tetrahedra of weight times Psi(F); weights (M,)."""

    assembly: Assembly
    material: NeoHookean
    weights: Array

    def energy_and_gradient(self, u: Array) -> tuple[float, Array]:
        """Energy and its derivative (3N,) at nodal displacements u (N, 3)."""
        mesh = self.assembly.mesh
        energy, stress = self.material.energy_and_stress(mesh.gradients(u))
        forces = np.einsum("c,cam,cim->cia", self.weights, stress, mesh.slopes, optimize=True)
        return float(self.weights @ energy), self.assembly.vector(forces)

    def hessian_entries(self, u: Array) -> Array:
        """Stored entries of the Hessian, every element's projected to positive semi-definite."""
        mesh, slopes = self.assembly.mesh, self.assembly.mesh.slopes
        local = self.material.hessian(mesh.gradients(u), project=True).reshape(-1, 3, 3, 3, 3)
        local *= self.weights[:, None, None, None, None]
        half = np.matmul(slopes[:, None, None], local.transpose(0, 1, 3, 2, 4))  # c, a, b, i, n
        full = np.matmul(half, slopes.transpose(0, 2, 1)[:, None, None])  # c, a, b, i, j
        return self.assembly.summed(full.transpose(0, 3, 1, 4, 2).reshape(-1, 12, 12))


def spring_entries(assembly: Assembly, carried: Carried, metric: Array) -> Array:
    """Stored entries of the Hessian of sum_k |x_k - a_k|^2 in metrics (K, 3, 3), x_k carried by the mesh."""
    b = carried.barycentric
    local = 2 * np.einsum("ki,kj,kab->kiajb", b, b, metric, optimize=True).reshape(-1, 12, 12)
    return assembly.summed(local, carried.cells)


def spring_forces(assembly: Assembly, carried: Carried, force: Array) -> Array:
    """(3N,): forces (K, 3) at carried points handed to the nodes."""
    return assembly.vector(carried.barycentric[:, :, None] * force[:, None, :], carried.cells)
