"""Gaussians in one render window: VTK's point Gaussian mapper, fed from far to near for that view's camera.

A VTK without that mapper draws plain points of one size.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk
from numpy.typing import NDArray
from vtk.util.numpy_support import numpy_to_vtk

from OrganPhysRegistrationLib.outputs.geometry import cells

from .splat_cloud import SplatCloud

REACH = 3.0  # standard deviations to which a Gaussian is drawn
MOVED = 0.02  # change of the viewing direction (sine) from which on the order is renewed


POINT_SIZE = 4.0  # pixels, where only points can be drawn


def drawn_as() -> str:
    """What this VTK can draw: "ellipsoids" (9.4 and later), "balls" or "points"."""
    mapper = getattr(vtk, "vtkPointGaussianMapper", None)
    if mapper is None:
        return "points"
    return "ellipsoids" if hasattr(mapper, "AnisotropicOn") else "balls"


class GaussianActor:
    """Draws a cloud in the renderer of one view until ``remove``."""

    def __init__(self, renderer: Any, cloud: SplatCloud) -> None:
        self.renderer, self._cloud = renderer, cloud
        self._poly, self._order = vtk.vtkPolyData(), np.arange(len(cloud.positions))
        self._direction = np.zeros(3)
        self._poly.SetVerts(cells(self._order[:, None]))
        self.actor = vtk.vtkActor()
        self._kind = drawn_as()
        self.actor.SetMapper(self._point_mapper() if self._kind == "points" else self._mapper())
        self.actor.GetProperty().SetPointSize(POINT_SIZE)
        self.actor.GetProperty().SetLighting(False)
        self.actor.ForceOpaqueOn()  # ordered by us: blended without the view's depth peeling
        self.actor.PickableOff()
        renderer.AddActor(self.actor)

    def update(self) -> None:
        """The cloud has moved: order it for the camera and draw it in the next rendering."""
        camera = self.renderer.GetActiveCamera()
        self._direction = np.array(camera.GetDirectionOfProjection())
        self._order = self._cloud.order(self._direction)
        self._fill(self._order)

    def camera_moved(self) -> bool:
        """Whether the camera looks from another side than the order is for."""
        now = np.array(self.renderer.GetActiveCamera().GetDirectionOfProjection())
        return bool(np.linalg.norm(np.cross(now, self._direction)) > MOVED) or float(now @ self._direction) < 0

    def remove(self) -> None:
        """Take it out of the view."""
        self.renderer.RemoveActor(self.actor)

    def _fill(self, order: NDArray[np.int64]) -> None:
        cloud, data = self._cloud, self._poly.GetPointData()
        points = vtk.vtkPoints()
        points.SetData(_array("points", cloud.positions[order]))
        self._poly.SetPoints(points)
        if self._kind == "ellipsoids":
            data.AddArray(_array("scale", cloud.deviations[order]))
            data.AddArray(_array("rotation", cloud.turns[order]))
        elif self._kind == "balls":  # of the same volume
            data.AddArray(_array("scale", np.cbrt(cloud.deviations[order].prod(axis=1))))
        if self._kind != "points":
            data.AddArray(_array("opacity", cloud.opacities[order]))
        data.AddArray(_array("colour", cloud.colours[order]))
        data.SetActiveScalars("colour")
        self._poly.Modified()

    def _mapper(self) -> Any:
        mapper = vtk.vtkPointGaussianMapper()
        mapper.SetInputData(self._poly)
        mapper.EmissiveOff()
        mapper.SetScaleArray("scale")
        mapper.SetScaleFactor(1.0)
        if self._kind == "ellipsoids":
            mapper.AnisotropicOn()
            mapper.SetRotationArray("rotation")
            mapper.SetBoundScale(REACH)
        mapper.SetOpacityArray("opacity")
        return self._coloured(mapper)

    def _point_mapper(self) -> Any:
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(self._poly)
        return self._coloured(mapper)

    @staticmethod
    def _coloured(mapper: Any) -> Any:
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("colour")
        mapper.SetColorModeToDirectScalars()
        return mapper


def _array(name: str, values: Any) -> Any:
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=False)  # the VTK array keeps the fresh numpy one alive
    array.SetName(name)
    return array
