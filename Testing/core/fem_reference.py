"""An independent full finite-element solution to compare the simulator with: quadratic tetrahedra.

scikit-fem makes mesh, shape functions and numbering; the material law is written out here once more. The organ is a
polyhedron, so that refining its tetrahedra leaves its shape as it is. Springs and forces are spread over its volume
with a density that is smooth in space: where it jumped, the reference would converge slowly.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTetP2, MeshTet


@dataclass(frozen=True)
class Loads:
    """At points (N, 3), m, at rest: springs held(x) (N,) in N/m per m^3, forces force(x) (N, 3) in N/m^3."""

    held: Callable[[np.ndarray], np.ndarray]
    force: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Quadratic:
    """Shape functions of a mesh at its quadrature points: values (10, q), slopes (nt, q, 10, 3), weights (nt, q)."""

    basis: Basis
    values: np.ndarray
    slopes: np.ndarray
    weights: np.ndarray
    nodes: np.ndarray

    @classmethod
    def of(cls, mesh):
        basis = Basis(mesh, ElementTetP2(), intorder=4)
        fields = [function[0] for function in basis.basis]
        values = np.stack([np.broadcast_to(np.asarray(f), basis.dx.shape)[0] for f in fields])
        slopes = np.stack([f.grad for f in fields]).transpose(2, 3, 0, 1)
        return cls(basis, values, slopes, basis.dx, basis.element_dofs.T)

    @property
    def points(self):
        """Quadrature points (nt q, 3), m."""
        return np.asarray(self.basis.global_coordinates()).reshape(3, -1).T

    def at_points(self, u):
        """Nodal values (N, 3) at the quadrature points, (nt q, 3)."""
        return np.einsum("iq,eia->eqa", self.values, u[self.nodes]).reshape(-1, 3)


def ellipsoid_mesh(radii, cells):
    """Tetrahedra (six to a cube, ``cells`` cubes along each axis) of a cube drawn out to an ellipsoid."""
    axis = np.linspace(-1, 1, cells + 1)
    mesh = MeshTet.init_tensor(axis, axis, axis)
    length = np.sqrt((mesh.p**2).sum(0))
    scale = np.abs(mesh.p).max(0) / np.maximum(length, 1e-12)
    return MeshTet(np.asarray(radii)[:, None] * scale * mesh.p, mesh.t)


def boundary(mesh):
    """Closed surface of the mesh: vertices (Nv, 3) and faces (Nf, 3), outward."""
    facets = mesh.boundary_facets()
    faces, cells = mesh.facets[:, facets].T, mesh.f2t[0, facets]
    corners = mesh.p[:, faces].transpose(1, 2, 0)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = ((corners.mean(1) - mesh.p[:, mesh.t[:, cells]].mean(1).T) * normal).sum(1) < 0
    faces = np.where(inward[:, None], faces[:, ::-1], faces)
    used, same = np.unique(faces, return_inverse=True)
    return mesh.p[:, used].T, same.reshape(-1, 3)


def carried_over(coarse, u, fine):
    """Nodal displacements (N, 3) of the space ``fine`` that are those of ``coarse`` with u, on a mesh it refines."""
    places = fine.basis.doflocs.T  # a hair towards the middle, so that each lies in some tetrahedron
    probes = coarse.basis.probes((places.mean(0) + (1 - 1e-9) * (places - places.mean(0))).T)
    return np.stack([probes @ column for column in u.T], axis=1)


def solve(space, loads, mu, lam, *, tolerance=1e-7, parts=4, start=None):
    """Nodal displacements (N, 3), m, of the equilibrium of Psi = mu/2 (tr C - 3 - 2 ln J) + lam/2 (J - 1)^2.

    The load comes on in ``parts``, or at once from displacements ``start`` (N, 3) that are near.
    """
    u = np.zeros((space.basis.N, 3)) if start is None else start
    for part in np.arange(1, parts + 1) / parts if start is None else (1.0,):
        for _ in range(25):
            matrix, force = _system(space, loads, mu, lam, u, part)
            way = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(-force)
            u = u + way.reshape(-1, 3)
            if np.abs(way).max() < (tolerance if part == 1 else 0.05) * np.abs(u).max():
                break
        else:
            raise ValueError("finite elements: Newton's method did not converge")
    return u


def _system(space, loads, mu, lam, u, part):
    """Tangent (3N, 3N) and residual (3N,) at nodal displacements u (N, 3) under ``part`` of the load."""
    slopes, weights, values = space.slopes, space.weights, space.values
    f = np.eye(3) + np.einsum("eqim,eia->eqam", slopes, u[space.nodes])
    j, pushed = np.linalg.det(f), slopes @ np.linalg.inv(f)  # g_i = F^-T grad N_i
    volume = lam * (j - 1) * j
    force = np.einsum("eq,eqim,eqam->eia", weights * mu, slopes, f, optimize=True)
    force += np.einsum("eq,eqia->eia", weights * (volume - mu), pushed)
    points = space.points
    spring = loads.held(points).reshape(weights.shape) * weights
    mass = np.einsum("eq,iq,jq->eij", spring, values, values, optimize=True)
    force += np.einsum("eij,eja->eia", mass, u[space.nodes])
    load = weights[:, :, None] * loads.force(points).reshape(*weights.shape, 3)
    force -= part * np.einsum("eqa,iq->eia", load, values)
    plain = np.einsum("eq,eqim,eqjm->eij", weights * mu, slopes, slopes, optimize=True) + mass
    local = np.einsum("eq,eqib,eqja->eiajb", weights * (mu - volume), pushed, pushed, optimize=True)
    local += np.einsum("eq,eqia,eqjb->eiajb", weights * lam * (2 * j - 1) * j, pushed, pushed, optimize=True)
    local += np.einsum("eij,ab->eiajb", plain, np.eye(3))
    rows = (3 * space.nodes[:, :, None] + np.arange(3)).reshape(len(u[space.nodes]), 30)
    i, k = np.broadcast_arrays(rows[:, :, None], rows[:, None, :])
    size = 3 * len(u)
    matrix = csc_array((local.reshape(-1), (i.ravel(), k.ravel())), shape=(size, size))
    return matrix, np.bincount(rows.ravel(), force.ravel(), size)
