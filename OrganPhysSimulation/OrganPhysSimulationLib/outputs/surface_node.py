"""The organ's surface as a model node that is refilled with every frame."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.checks import Array
from OrganPhysRegistrationLib.outputs.geometry import cells, set_point_array, triangle_mesh
from OrganPhysRegistrationLib.outputs.surface_nodes import COLOURS

from ..choices import Colouring
from ..engine.surface_motion import SurfaceMotion
from ..roles import ensure, find

STATE = "organphys_z"  # field array: coordinates of the shape, so that the splat can follow a played frame
LIMITS = {Colouring.Displacement: 10.0, Colouring.Stretch: 25.0}  # mm, %: least upper end of the colours
STEPS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)
TISSUE_COLOUR = (0.78, 0.36, 0.32)


class SurfaceNode:
    """Fills the model "Simulated organ", in mm of the simulation's frame."""

    def __init__(self, frame: Any, motion: SurfaceMotion) -> None:
        self.node, self._triangles = ensure("surface"), cells(motion.faces)
        self.node.SetAndObserveTransformNodeID(frame.GetID())
        self._colouring, self._limit = Colouring.Plain, 0.0
        self.write(motion, np.zeros_like(motion.rest), np.zeros((0, 3)))
        display = self.node.GetDisplayNode()
        display.SetColor(*TISSUE_COLOUR)
        display.SetVisibility2D(True)

    def write(self, motion: SurfaceMotion, displacement: Array, z: Array) -> None:
        """Show the surface moved by ``displacement`` (N, 3) m; z (n, 3): the shape's coordinates, kept with it."""
        vertices = motion.rest + displacement
        mesh = triangle_mesh(1e3 * vertices, self._triangles, motion.normals(vertices))
        if self._colouring is Colouring.Displacement:
            self._colour(mesh, 1e3 * np.sqrt((displacement**2).sum(1)))
        elif self._colouring is Colouring.Stretch:
            self._colour(mesh, 100 * motion.stretch(vertices))
        if len(z):
            state = numpy_to_vtk(np.ascontiguousarray(z), deep=True)
            state.SetName(STATE)
            mesh.GetFieldData().AddArray(state)
        self.node.SetAndObserveMesh(mesh)

    def colour_by(self, colouring: Colouring) -> None:
        """What the colours say from the next frame on; with a legend."""
        self._colouring, self._limit = colouring, LIMITS.get(colouring, 0.0)
        display, coloured = self.node.GetDisplayNode(), colouring is not Colouring.Plain
        display.SetScalarVisibility(coloured)
        if coloured:
            display.SetActiveScalarName(colouring.value)
            display.SetAndObserveColorNodeID(colour_table().GetID())
            display.SetScalarRangeFlag(slicer.vtkMRMLDisplayNode.UseManualScalarRange)
            display.SetScalarRange(0.0, self._limit)
        self._show_legend(coloured)

    def _colour(self, mesh: Any, values: Any) -> None:
        set_point_array(mesh, self._colouring.value, values)
        mesh.GetPointData().SetActiveScalars(self._colouring.value)
        highest = float(values.max(initial=0.0))
        if highest > self._limit:
            power = 10.0 ** np.floor(np.log10(highest))
            self._limit = next(step * power for step in STEPS if step * power >= highest)
            self.node.GetDisplayNode().SetScalarRange(0.0, self._limit)

    def _show_legend(self, shown: bool) -> None:
        logic, display = slicer.modules.colors.logic(), self.node.GetDisplayNode()
        legend = logic.GetColorLegendDisplayNode(display)
        if legend is None and shown:
            legend = logic.AddDefaultColorLegendDisplayNode(display)
            legend.SetSize(0.04, 0.25)
            legend.SetPosition(0.97, 0.06)
            legend.SetLabelFormat("%.3g")
        if legend is not None:
            legend.SetTitleText(self._colouring.label())
            legend.SetVisibility(shown)


def state_of(node: Any) -> Array | None:
    """Coordinates (n, 3) of the shape that the surface node shows, None if it shows none."""
    mesh = node.GetPolyData()
    data = None if mesh is None else mesh.GetFieldData().GetArray(STATE)
    return None if data is None else vtk_to_numpy(data).copy()


def colour_table() -> Any:
    """The simulation's colours; Slicer's own lie in files that not every installation has."""
    found = find("colours")
    if found is not None:
        return found
    node = ensure("colours")
    node.SetTypeToUser()
    node.SetNumberOfColors(256)
    place = np.linspace(0, len(COLOURS) - 1, 256)
    ramp = np.stack([np.interp(place, np.arange(len(COLOURS)), COLOURS[:, k] / 255) for k in range(3)], axis=1)
    for index, colour in enumerate(ramp):
        node.SetColor(index, f"{index}", *map(float, colour), 1.0)
    return node
