"""Coarser triangle meshes for pictures: vertices of one cubic cell become one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..points.sampling import cell_keys


@dataclass(frozen=True)
class ThinMesh:
    """faces (Nf', 3) over the cells, and the cell (Nv,) of every vertex of the full mesh."""

    faces: NDArray[np.int64]
    cell_of_vertex: NDArray[np.int64]

    def averaged(self, values: Array) -> Array:
        """Mean over every cell of vertex values (Nv, C): (cells, C)."""
        counts = np.maximum(np.bincount(self.cell_of_vertex), 1)
        columns = [np.bincount(self.cell_of_vertex, column) / counts for column in values.T]
        return np.stack(columns, axis=1)


def thin_mesh(vertices: Array, faces: NDArray[np.int64], *, cells_across: int = 64) -> ThinMesh:
    """Mesh with about ``cells_across`` vertices along its longest side; a coarser mesh stays nearly as it is."""
    edge = float(np.ptp(vertices, axis=0).max()) / cells_across
    cell = np.unique(cell_keys(vertices, max(edge, 1e-12)), return_inverse=True)[1].reshape(-1)
    thin = cell[faces]
    whole = (thin[:, 0] != thin[:, 1]) & (thin[:, 1] != thin[:, 2]) & (thin[:, 2] != thin[:, 0])
    return ThinMesh(thin[whole], cell)
