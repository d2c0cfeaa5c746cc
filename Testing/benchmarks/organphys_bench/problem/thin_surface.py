"""The organ's surface with fewer vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from organphys.exports.mesh_thinning import thin_mesh
from organphys.ground.checks import Array
from organphys.points.point_sets import Organ


def thinned(organ: Organ, count: int) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (N, 3) mm and faces of the organ's surface with about ``count`` vertices."""
    across = 8
    while True:
        mesh = thin_mesh(organ.vertices, organ.faces, cells_across=across)
        used, faces = np.unique(mesh.faces, return_inverse=True)
        if len(used) >= count or across > 200:
            return mesh.averaged(organ.vertices)[used], faces.reshape(-1, 3)
        across = int(np.ceil(1.15 * across))
