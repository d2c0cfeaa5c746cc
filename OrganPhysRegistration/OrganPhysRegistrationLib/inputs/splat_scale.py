"""Where a splat stands in the world: its "scene to world" transform and the millimetres per scene unit in it."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy

from organphys.ground.checks import Array, InputError, as_positive, one_of

from .matrices import ROLE, matrix_of, scale_of, to_parent, world_from_node

SCENE_TO_WORLD = "scene_to_world"
KINDS = ("stated", "registered", "guess")
UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # camera right to R, forward to A, up to S
GUESS_MM = 200.0  # what an endoscope's splat of an abdominal organ measures across


def scene_to_world(splat_node: Any) -> Any:
    """The vtkMRMLLinearTransformNode right above the splat; it is made, upright and without scale, if it is missing."""
    parent = splat_node.GetParentTransformNode()
    if parent is not None and parent.GetAttribute(ROLE) == SCENE_TO_WORLD:
        return parent
    node = splat_node.GetScene().AddNewNodeByClass(
        "vtkMRMLLinearTransformNode", f"{splat_node.GetName()} scene to world"
    )
    node.SetAttribute(ROLE, SCENE_TO_WORLD)
    upright = np.eye(4)
    upright[:3, :3] = UPRIGHT
    node.SetMatrixTransformToParent(matrix_of(upright))
    if parent is not None:
        node.SetAndObserveTransformNodeID(parent.GetID())
    splat_node.SetAndObserveTransformNodeID(node.GetID())
    return node


def set_scale(splat_node: Any, mm_per_unit: float, kind: str = "stated", *, percent: float = 0.0) -> None:
    """Show the splat with so many mm per scene unit; ``kind``: stated, registered or guess (a guess is only for show).

    ``percent``: standard deviation of a stated unit. The scene's origin, the camera, stays where it is.
    """
    mm_per_unit = as_positive(mm_per_unit, "mm per scene unit")
    one_of(kind, "kind of scale", KINDS)
    transform = scene_to_world(splat_node)
    before = to_parent(transform)
    current, now = before.copy(), scale_of(before)
    if not np.isfinite(now) or now <= 0:
        raise InputError(f"{transform.GetName()}: it mirrors or flattens the splat; reset its matrix")
    turned = current[:3, :3] / now
    current[:3, :3] = mm_per_unit * (UPRIGHT if np.allclose(turned, UPRIGHT, atol=1e-9) else turned)
    if not np.array_equal(current, before):
        transform.SetMatrixTransformToParent(matrix_of(current))
    splat_node.SetAttribute("OrganPhys.MmPerUnit", repr(float(mm_per_unit)))
    splat_node.SetAttribute("OrganPhys.MmPerUnitKind", kind)
    splat_node.SetAttribute("OrganPhys.MmPerUnitPercent", repr(float(percent)))


def mm_per_unit_of(splat_node: Any) -> tuple[float, str, float]:
    """Millimetres per scene unit as the splat is shown, their kind (stated, registered, guess), percent deviation."""
    read = splat_node.GetAttribute
    value, percent = read("OrganPhys.MmPerUnit"), read("OrganPhys.MmPerUnitPercent")
    if value is None:
        raise InputError(f"splat: {splat_node.GetName()} has no scale; load its .ply file again")
    return float(value), read("OrganPhys.MmPerUnitKind") or "guess", float(percent or 0)


def T_world_scene(splat_node: Any) -> Array:
    """(4, 4) from raw scene units to world mm, all parents included except the case's overlay frame itself.

    This is where the endoscope side stands whatever "Overlay in" shows; see T_shown_scene for what is on the screen.
    """
    return world_from_node(splat_node, without_overlay=True)


def T_shown_scene(splat_node: Any) -> Array:
    """(4, 4) from raw scene units to where the splat is shown now, world mm, the overlay frame included."""
    return world_from_node(splat_node)


def forget_unit(splat_node: Any) -> None:
    """The unit is not known (any more): show the splat at the size of an abdominal organ, as when it was loaded."""
    poly = splat_node.GetPolyData()
    opacities = vtk_to_numpy(poly.GetPointData().GetArray("opacity"))
    centres = vtk_to_numpy(poly.GetPoints().GetData())
    set_scale(splat_node, guessed_mm_per_unit(centres, opacities), "guess")


def guess_scale(splat_node: Any, surface: vtk.vtkPolyData) -> bool:
    """Show a splat whose unit is not known at the size of the organ's ``surface`` (mm); False if its unit is known."""
    if mm_per_unit_of(splat_node)[1] != "guess":
        return False
    organ_mm = robust_extent(vtk_to_numpy(surface.GetPoints().GetData()))
    poly = splat_node.GetPolyData()
    opacities = vtk_to_numpy(poly.GetPointData().GetArray("opacity"))
    centres = vtk_to_numpy(poly.GetPoints().GetData())
    set_scale(splat_node, guessed_mm_per_unit(centres, opacities, extent_mm=organ_mm), "guess")
    return True


def guessed_mm_per_unit(
    centres: NDArray[Any], opacities: NDArray[Any], *, extent_mm: float = GUESS_MM, opacity: float = 0.1
) -> float:
    """Millimetres per unit at which the opaque Gaussians' robust extent is ``extent_mm``; for the first look only."""
    opaque = centres[opacities > opacity]
    extent = robust_extent(opaque if len(opaque) else centres)
    return extent_mm / extent if np.isfinite(extent) and extent > 0 else 1.0


def robust_extent(points: NDArray[Any]) -> float:
    """Twice the 90th percentile of the distance of points (N, 3) from their median: a few strays do not count."""
    distance = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    return 2 * float(np.quantile(distance, 0.9))
