"""The inverse of the elastic transform: solved on the forward grid at every point, or sampled on a grid of its own.

Solving (VTK's Newton steps) is exact to 0.01 mm as long as the deformation can be inverted everywhere near the organ; a
sampled grid misses up to some tenths of a millimetre there. Where the space beside the organ folds the steps may run
away, and the sampled grid is the better one. Both are tried on the organ itself.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from .case_record import CaseNodes
from .geometry import Array, points_of
from .grid_transforms import composite, displacement_image, grid_transform, like_grid, linear

SOLVED, SAMPLED = "solved", "sampled"
GOOD_MM = 0.05
FEW = 1500  # points of the surface and of the inside that are tried


class Inverse(NamedTuple):
    """Scene to CT, how it was made, and the largest distance that is left inside after there and back, mm."""

    transform: Any
    kind: str
    round_trip_mm: float


def best_inverse(case: CaseNodes, forward: Any, grid: Any, T_overlay_ct: Array, sampled: Any) -> Inverse:
    """Inverse of ``forward``, which is ``grid``, then T_overlay_ct (4, 4); ``sampled``: DisplacementGrid or None."""
    points, back = _organ_points(case), linear(np.linalg.inv(T_overlay_ct))
    solved = composite(back, like_grid(grid, grid.GetDisplacementGrid(), invert=True))
    found = Inverse(solved, SOLVED, round_trip_mm(solved, forward, points))
    if found.round_trip_mm > GOOD_MM and sampled is not None:
        other = composite(back, grid_transform(displacement_image(sampled)))
        found = min(found, Inverse(other, SAMPLED, round_trip_mm(other, forward, points)), key=lambda one: one[2])
    return found


def round_trip_mm(inverse: Any, forward: Any, points: Array) -> float:
    """Largest distance between points (N, 3) and where the inverse and then the forward transform put them."""
    start, middle, end = (vtk.vtkPoints() for _ in range(3))
    for places in (start, middle, end):
        places.SetDataTypeToDouble()
    start.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    inverse.TransformPoints(start, middle)
    forward.TransformPoints(middle, end)
    return float(np.linalg.norm(vtk_to_numpy(end.GetData()) - points, axis=1).max())


def _organ_points(case: CaseNodes) -> Array:
    """Points (N, 3) of the registered organ, mm in the overlay frame."""
    nodes = [case.node("surface_elastic"), case.get("volume")]
    parts = [points_of(node.GetPolyData()) for node in nodes if node is not None]
    return np.concatenate([part[:: max(1, len(part) // FEW)] for part in parts])
