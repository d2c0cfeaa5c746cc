"""What colours the registered surface: distance, displacement, volume ratio or error radius, each with its legend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import slicer
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from organphys.ground.checks import InputError, one_of

from .case_record import CaseNodes

DISTANCE, DISPLACEMENT, DET_F, ERROR_68, ERROR_95 = (
    "distance_mm", "displacement_mm", "det_F", "error_68_mm", "error_95_mm",
)  # fmt: skip
COLOURED = "OrganPhys.SurfaceColours"
STEPS_MM = (1.0, 2.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 50.0)


@dataclass(frozen=True)
class Colouring:
    """Title of the legend, and its lower and upper end where they are fixed (else 0 to the largest value, mm)."""

    title: str
    ends: tuple[float, float] | None = None


COLOURINGS = {
    DISTANCE: Colouring("Distance to the splat (mm)\ngrey: farther or unseen"),
    DISPLACEMENT: Colouring("Displacement beyond the\nsimilarity (mm)"),
    DET_F: Colouring("Volume ratio det F (1)", (0.8, 1.2)),
    ERROR_68: Colouring("68 % error radius (mm)"),
    ERROR_95: Colouring("95 % error radius (mm)"),
}


def colour_surfaces(case: CaseNodes, array: str | None = None) -> None:
    """Colour the elastic surface by one of COLOURINGS and show that in its legend; None: as chosen before.

    InputError where the surface has no such figures (a case that was made before they were known).
    """
    if array is not None:
        one_of(array, "colours", tuple(COLOURINGS))
    asked, array = array, array or coloured_by(case)
    surface = case.get("surface_elastic")
    if surface is None or array not in possible_colours(case):
        if array != DISTANCE:
            raise InputError(f"colours: this case has no {array}; register it again with method organphys")
        return
    values = vtk_to_numpy(surface.GetPolyData().GetPointData().GetArray(array))
    display = surface.GetDisplayNode()
    if display.GetActiveScalarName() != array:
        display.SetActiveScalar(array, vtk.vtkAssignAttribute.POINT_DATA)
    if array != DISTANCE:  # its own range leaves out the unseen side: see surface_nodes.py
        display.SetScalarRange(*(COLOURINGS[array].ends or (0.0, upper_end(values))))
    elif case.record.get("distance_limit_mm"):
        display.SetScalarRange(0.0, case.record["distance_limit_mm"])
    legend = legend_of(surface)
    if legend is not None:
        legend.SetTitleText(COLOURINGS[array].title)
    if asked is not None:
        case.node("case").SetAttribute(COLOURED, asked)


def coloured_by(case: CaseNodes) -> str:
    """The array chosen last that the surface has."""
    chosen = case.node("case").GetAttribute(COLOURED)
    return chosen if chosen in possible_colours(case) else DISTANCE


def possible_colours(case: CaseNodes) -> list[str]:
    """Names of COLOURINGS that the elastic surface has; none before the elastic stage."""
    surface = case.get("surface_elastic")
    data = None if surface is None or surface.GetPolyData() is None else surface.GetPolyData().GetPointData()
    return [] if data is None else [name for name in COLOURINGS if data.HasArray(name)]


def upper_end(values_mm: Any) -> float:
    """Upper end of the colours for values (N,) in mm: the largest, rounded up to a plain number (beyond is grey)."""
    finite = np.asarray(values_mm, dtype=np.float64)
    finite = finite[np.isfinite(finite)]
    reached = float(finite.max()) if len(finite) else STEPS_MM[0]
    return next((step for step in STEPS_MM if step >= reached), float(np.ceil(reached)))


def legend_of(node: Any) -> Any:
    """Colour legend of a surface model, None if it has none."""
    return slicer.modules.colors.logic().GetColorLegendDisplayNode(node)
