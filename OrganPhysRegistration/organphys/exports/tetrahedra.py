"""Tetrahedra of the organ for finite element programs, by fTetWild, with their quality.

Hu et al., "Fast Tetrahedral Meshing in the Wild", ACM TOG 2020, through pytetwild (MPL-2.0).
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..asset.surface_distance import SurfaceDistance
from ..ground.checks import Array, InputError, as_positive
from .mesh_thinning import thin_mesh

NEEDED = ("pytetwild", "pyvista", "meshio")
MISSING = "tetrahedra need pytetwild, pyvista and meshio: pip install 'organphys[tetrahedra]'"
CELLS_PER_EDGE = 1.5  # the surface is thinned to about this many vertices per edge of a tetrahedron before the meshing
ROUNDS, SIDES = 10, ([0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3])
ENVELOPE = 0.075  # edges: how far the surface may lie from the thinned one; half of it takes four times as long


class MeshQuality(NamedTuple):
    """What a finite element program wants to know: counts, quality (1: regular, 0: flat), volume."""

    nodes: int
    tetrahedra: int
    min_radius_ratio: float
    mean_radius_ratio: float
    min_scaled_jacobian: float
    volume: float


@dataclass(frozen=True)
class TetrahedralMesh:
    """nodes (N, 3) and cells (M, 4), all of positive volume."""

    nodes: Array
    cells: NDArray[np.int64]

    @cached_property
    def volumes(self) -> Array:
        """Signed volumes (M,)."""
        a, b, c, d = (self.nodes[self.cells[:, k]] for k in range(4))
        volumes: Array = np.einsum("nd,nd->n", b - a, np.cross(c - a, d - a)) / 6
        return volumes

    @property
    def radius_ratios(self) -> Array:
        """3 x radius of the inscribed over that of the circumscribed sphere (M,): 1 for regular tetrahedra."""
        a, b, c, d = (self.nodes[self.cells[:, k]] for k in range(4))
        u, v, w = b - a, c - a, d - a
        areas = sum(np.linalg.norm(np.cross(p, q), axis=1) for p, q in ((u, v), (v, w), (w, u), (v - u, w - u))) / 2
        inner = 3 * np.abs(self.volumes) / areas
        top = (u * u).sum(1)[:, None] * np.cross(v, w)
        top += (v * v).sum(1)[:, None] * np.cross(w, u) + (w * w).sum(1)[:, None] * np.cross(u, v)
        outer = np.linalg.norm(top, axis=1) / (12 * np.maximum(np.abs(self.volumes), 1e-300))
        ratios: Array = 3 * inner / outer
        return ratios

    @property
    def scaled_jacobians(self) -> Array:
        """sqrt(2) det over the largest product of three edges that meet (M,): 1 for regular tetrahedra.

        Knupp, "Algebraic mesh quality metrics for unstructured initial meshes", FEAD 2003.
        """
        corners = self.nodes[self.cells]
        lengths = {
            (i, j): np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i in range(4) for j in range(i + 1, 4)
        }
        products = [np.prod([lengths[min(i, j), max(i, j)] for j in range(4) if j != i], axis=0) for i in range(4)]
        scaled: Array = np.sqrt(2) * 6 * self.volumes / np.max(products, axis=0)
        return scaled

    def quality(self) -> MeshQuality:
        """Counts, quality and volume (in the unit of the nodes, cubed)."""
        ratios, scaled = self.radius_ratios, self.scaled_jacobians
        volume = float(self.volumes.sum())
        counts = (len(self.nodes), len(self.cells))
        return MeshQuality(*counts, float(ratios.min()), float(ratios.mean()), float(scaled.min()), volume)


def tetrahedra(vertices: Array, faces: NDArray[np.int64], *, edge: float) -> TetrahedralMesh:
    """Tetrahedra with edges of about ``edge`` inside a closed surface (Nv, 3), (Nf, 3), in the unit of the vertices.

    pytetwild's tetrahedra are negatively oriented: they are turned. InputError without the extra "tetrahedra".
    """
    check_tetrahedra()
    import pytetwild

    as_positive(edge, "edge length")
    size = float(np.ptp(vertices, axis=0).max())
    if not edge < size:
        raise InputError(f"edge length: expected less than the size of the organ, {size:.3g}, got {edge:g}")
    with _scratch_folder():  # fTetWild leaves a file in the working folder
        nodes, cells = pytetwild.tetrahedralize(
            *_thinned(vertices, faces, edge / CELLS_PER_EDGE),
            edge_length_abs=edge,
            epsilon=ENVELOPE * edge / float(np.linalg.norm(np.ptp(vertices, axis=0))),
            num_threads=1,
            quiet=True,
        )
    if not len(cells):
        raise InputError("tetrahedra: none could be made of this surface; is it closed? take another edge length")
    mesh = oriented(np.asarray(nodes, dtype=np.float64), np.asarray(cells, dtype=np.int64))
    return on_surface(mesh, SurfaceDistance(vertices, faces))


@contextmanager
def _scratch_folder() -> Iterator[None]:
    """A working folder for the length of the block, removed at its end."""
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def _thinned(vertices: Array, faces: NDArray[np.int64], cell: float) -> tuple[Array, NDArray[np.int32]]:
    """The surface with one vertex per cell, as it is if it has hardly more: fTetWild's time goes with its triangles."""
    edges = np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1)
    if float(np.median(edges)) > 0.5 * cell:
        return vertices, faces.astype(np.int32)
    thin = thin_mesh(vertices, faces, cells_across=max(8, int(np.ptp(vertices, axis=0).max() / cell)))
    return thin.averaged(vertices), thin.faces.astype(np.int32)


def on_surface(mesh: TetrahedralMesh, surface: SurfaceDistance) -> TetrahedralMesh:
    """The mesh with its outer nodes moved to the closest point of the surface, which thinning and envelope had left.

    Nodes stay where they are where that would halve the radius ratio of a tetrahedron.
    """
    sides = np.sort(np.concatenate([mesh.cells[:, side] for side in SIDES]), axis=1)
    unique, count = np.unique(sides, axis=0, return_counts=True)
    outer = np.unique(unique[count == 1])
    target, before = mesh.nodes.copy(), mesh.radius_ratios
    target[outer] = surface.signed_with_foot(mesh.nodes[outer])[1]
    for _ in range(ROUNDS):
        moved = TetrahedralMesh(target, mesh.cells)
        bad = (moved.volumes <= 0) | (moved.radius_ratios < 0.5 * before)
        if not bad.any():
            return moved
        back = np.unique(mesh.cells[bad])
        target[back] = mesh.nodes[back]
    return mesh


def check_tetrahedra() -> None:
    """InputError where the extra "tetrahedra" is not installed."""
    if any(find_spec(name) is None for name in NEEDED):
        raise InputError(MISSING)


def oriented(nodes: Array, cells: NDArray[np.int64]) -> TetrahedralMesh:
    """The mesh with every tetrahedron of positive volume; unused nodes are left out."""
    used, cells = np.unique(cells, return_inverse=True)
    mesh = TetrahedralMesh(nodes[used], cells.reshape(-1, 4).astype(np.int64))
    turned = np.where((mesh.volumes < 0)[:, None], mesh.cells[:, [0, 2, 1, 3]], mesh.cells)
    return TetrahedralMesh(mesh.nodes, turned)
