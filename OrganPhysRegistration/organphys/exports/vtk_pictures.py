"""Pictures of a simulation by VTK, off the screen: quicker and smoother than by software, where there is OpenGL."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, InputError
from .renderer import BACKGROUND
from .simulation_pictures import STEEL, TISSUE, Solid, Stage

HIDDEN_TOOL = 0.25  # opacity of the tool where tissue hides it


class VtkStage:
    """Draws what ``Stage`` draws, in the same view. InputError: this system has no OpenGL to draw with."""

    def __init__(self, stage: Stage) -> None:
        from vtkmodules import vtkRenderingOpenGL2  # noqa: F401  registers the drawing
        from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

        self._stage, view = stage, stage.view
        self._window, self._layers = vtkRenderWindow(), (vtkRenderer(), vtkRenderer())
        if not self._window.SupportsOpenGL():
            raise InputError("--renderer vtk: this system has no OpenGL; use the software renderer")
        self._window.SetOffScreenRendering(True)
        self._window.SetSize(view.width, view.height)
        self._window.SetMultiSamples(8)
        self._window.SetNumberOfLayers(2)
        for layer, renderer in enumerate(self._layers):
            renderer.SetLayer(layer)
            self._window.AddRenderer(renderer)
        self._layers[0].SetBackground(*BACKGROUND.tolist())
        self._layers[1].SetActiveCamera(self._layers[0].GetActiveCamera())
        _aim(self._layers[0].GetActiveCamera(), stage)

    def picture(self, vertices: Array, centres: Array, tools: Sequence[Solid]) -> NDArray[np.uint8]:
        """Organ vertices (Nv, 3), splat centres (N, 3) and tools at one moment: image (h, w, 3)."""
        stage, (front, faint) = self._stage, self._layers
        for renderer in self._layers:
            renderer.RemoveAllViewProps()
        front.AddActor(_solid((vertices, stage.faces), TISSUE))
        if len(centres):
            pixels = stage.view.focal * stage.radius / stage.view.distance
            front.AddActor(_dots(centres, stage.colours, 2 * pixels))
        for tool in tools:
            front.AddActor(_solid(tool, STEEL))
            faint.AddActor(_solid(tool, STEEL, opacity=HIDDEN_TOOL))
        front.ResetCameraClippingRange()
        self._window.Render()
        return self._image()

    def _image(self) -> NDArray[np.uint8]:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        view, data = self._stage.view, vtkUnsignedCharArray()
        self._window.GetPixelData(0, 0, view.width - 1, view.height - 1, 1, data, 0)
        image: NDArray[np.uint8] = vtk_to_numpy(data).reshape(view.height, view.width, -1)[::-1, :, :3].copy()
        return image


def _aim(camera: Any, stage: Stage) -> None:
    view = stage.view
    camera.SetPosition(*view.position)
    camera.SetFocalPoint(*view.target)
    camera.SetViewUp(*-view.axes[1])
    camera.SetViewAngle(float(np.degrees(2 * np.arctan(0.5 * view.height / view.focal))))


def _solid(solid: Solid, colour: Array, *, opacity: float = 1.0) -> Any:
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    from ..asset.surface_distance import vertex_normals

    vertices, faces = solid
    poly = _points(vertices)
    poly.SetPolys(_cells(faces))
    poly.GetPointData().SetNormals(_array(vertex_normals(vertices, faces)))
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(poly)
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*colour)
    actor.GetProperty().SetOpacity(opacity)
    actor.GetProperty().SetAmbient(0.15)
    return actor


def _dots(centres: Array, colours: Array, pixels: float) -> Any:
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    poly = _points(centres)
    poly.SetVerts(_cells(np.arange(len(centres))[:, None]))
    poly.GetPointData().SetScalars(_array(np.round(255 * np.clip(colours, 0, 1)).astype(np.uint8)))
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(poly)
    actor.SetMapper(mapper)
    actor.GetProperty().SetPointSize(max(pixels, 1.0))
    actor.GetProperty().SetLighting(False)
    actor.GetProperty().SetRenderPointsAsSpheres(True)
    return actor


def _points(points: Array) -> Any:
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    places, poly = vtkPoints(), vtkPolyData()
    places.SetData(_array(points))
    poly.SetPoints(places)
    return poly


def _cells(rows: NDArray[np.int64]) -> Any:
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    cells = vtkCellArray()
    offsets = np.arange(0, rows.size + 1, rows.shape[1], dtype=np.int64)
    cells.SetData(_array(offsets), _array(rows.astype(np.int64).ravel()))
    return cells


def _array(values: NDArray[Any]) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk

    return numpy_to_vtk(np.ascontiguousarray(values), deep=True)
