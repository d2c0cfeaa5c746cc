"""Stand-in for ``slicer.app.layoutManager()`` with real offscreen views; slice views are made on first use."""

from __future__ import annotations

from typing import Any

import slicer

from .views import SliceView, ThreeDView

ORIENTATIONS = {"Red": "Axial", "Green": "Coronal", "Yellow": "Sagittal"}


class ViewController:
    """The bar above a view."""

    def __init__(self, view: Any) -> None:
        self._view = view

    def fitSliceToBackground(self) -> None:
        self._view.fit()

    def resetFocalPoint(self) -> None:
        self._view.fit()

    def setSliceVisible(self, shown: bool) -> None:
        self._view.node.SetSliceVisible(bool(shown))


class ViewWidget:
    """A view and, as in Slicer, what its widget, view and controller answer; one object for all three."""

    def __init__(self, view: Any) -> None:
        self.view = view

    def threeDView(self) -> ViewWidget:
        return self

    sliceView = threeDView

    def threeDController(self) -> ViewController:
        return ViewController(self.view)

    sliceController = threeDController

    def mrmlViewNode(self) -> Any:
        return self.view.node

    mrmlSliceNode = mrmlViewNode

    def sliceLogic(self) -> Any:
        return self.view.logic

    viewLogic = sliceLogic

    def cameraNode(self) -> Any:
        return self.view.camera_node()

    def renderWindow(self) -> Any:
        return self.view.window

    def interactor(self) -> Any:
        return self.view.interactor

    def interactorStyle(self) -> Any:
        return self.view.style

    def displayableManagerByClassName(self, name: str) -> Any:
        return self.view.group.GetDisplayableManagerByClassName(name)

    def forceRender(self) -> None:
        self.view.window.Render()

    def scheduleRender(self) -> None:
        """Views render only when asked to."""

    def resetFocalPoint(self) -> None:
        self.view.fit()

    fitSliceToBackground = resetFocalPoint

    def resetCamera(self, *_options: Any) -> None:
        self.view.renderer.ResetCamera()

    def rotateToViewAxis(self, axis: int) -> None:
        self.view.camera_node().RotateTo(axis)


class PlotWidget:
    def plotView(self) -> PlotWidget:
        return self

    def mrmlPlotViewNode(self) -> Any:
        return slicer.mrmlScene.GetFirstNodeByClass("vtkMRMLPlotViewNode")

    def fitToContent(self) -> None:
        """Nothing is drawn."""


class LayoutManager:
    threeDViewCount = plotViewCount = tableViewCount = 1

    def __init__(self, core: Any) -> None:
        self._core, self._threed, self._slices = core, None, {}
        self._logic = slicer.vtkMRMLLayoutLogic()
        self._logic.SetMRMLApplicationLogic(core.app_logic)
        self._logic.SetMRMLScene(core.scene)

    def layoutLogic(self) -> Any:
        return self._logic

    def setLayout(self, number: int) -> None:
        self._logic.GetLayoutNode().SetViewArrangement(number)

    layout = property(lambda self: self._logic.GetLayoutNode().GetViewArrangement(), setLayout)

    def threeDWidget(self, index: Any = 0) -> ViewWidget:
        if self._threed is None:
            self._threed = ViewWidget(ThreeDView(self._core))
        return self._threed

    def sliceViewNames(self) -> tuple[str, ...]:
        return tuple(ORIENTATIONS)

    def sliceWidget(self, name: str) -> ViewWidget:
        if name not in self._slices:
            self._slices[name] = ViewWidget(SliceView(self._core, name, ORIENTATIONS[name]))
        return self._slices[name]

    def mrmlSliceLogics(self) -> Any:
        return self._core.app_logic.GetSliceLogics()

    def plotWidget(self, index: Any = 0) -> PlotWidget:
        return PlotWidget()

    def resetSliceViews(self) -> None:
        for widget in self._slices.values():
            widget.view.fit()

    def resetThreeDViews(self) -> None:
        if self._threed is not None:
            self._threed.view.fit()

    def pauseRender(self) -> None:
        """Views render only when asked to."""

    resumeRender = pauseRender
