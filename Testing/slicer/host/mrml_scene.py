"""The MRML scene with application logic and module logics, set up as Slicer does at start-up."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import slicer
import vtk

LOGICS = {  # name of the module -> class of its logic
    "Colors": "vtkSlicerColorLogic",
    "Units": "vtkSlicerUnitsLogic",
    "Cameras": "vtkSlicerCamerasModuleLogic",
    "ViewControllers": "vtkSlicerViewControllersLogic",
    "Volumes": "vtkSlicerVolumesLogic",
    "Models": "vtkSlicerModelsLogic",
    "Markups": "vtkSlicerMarkupsLogic",
    "Transforms": "vtkSlicerTransformLogic",
    "Tables": "vtkSlicerTablesLogic",
    "Texts": "vtkSlicerTextsLogic",
    "Plots": "vtkSlicerPlotsLogic",
    "SubjectHierarchy": "vtkSlicerSubjectHierarchyModuleLogic",
    "Segmentations": "vtkSlicerSegmentationsModuleLogic",
    "Sequences": "vtkSlicerSequencesLogic",
}


@dataclass(frozen=True)
class Core:
    """The scene, the application's logic, the modules' logics and what has to be kept alive with them."""

    scene: Any
    app_logic: Any
    logics: dict[str, Any]
    folder: str
    keep: tuple[Any, ...]


def build() -> Core:
    """Order matters: scene, application logic, colours, module logics (they register node classes), singletons, IO."""
    folder = tempfile.mkdtemp(prefix="organphys_host_")
    scene = slicer.vtkMRMLScene()
    _add_crosshair(scene)
    app_logic = slicer.vtkSlicerApplicationLogic()
    app_logic.SetMRMLScene(scene)
    app_logic.SetTemporaryPath(folder)
    app_logic.SetHomeDirectory(folder)  # no colour files there; the built-in colour tables remain
    app_logic.SetShareDirectory(".")
    (Path(folder) / "ColorFiles").mkdir()
    (Path(folder) / ".slicer-cache").touch()  # marks it as a folder that the cache may empty
    app_logic.GetColorLogic().SetMRMLScene(scene)
    app_logic.GetColorLogic().AddDefaultColorNodes()
    app_logic.SetSliceLogics(vtk.vtkCollection())
    app_logic.SetViewLogics(vtk.vtkCollection())
    for kind in ("ThreeD", "Slice"):
        factory = getattr(slicer, f"vtkMRML{kind}ViewDisplayableManagerFactory")
        factory.GetInstance().SetMRMLApplicationLogic(app_logic)
    logics = {name: _logic(name, cls, app_logic, scene) for name, cls in LOGICS.items()}
    scene.RegisterNodeClass(slicer.vtkMRMLCommandLineModuleNode())
    _add_singletons(scene)
    return Core(scene, app_logic, logics, folder, _file_io(scene, app_logic, folder))


def _add_crosshair(scene: Any) -> None:
    crosshair = slicer.vtkMRMLCrosshairNode()
    crosshair.SetCrosshairName("default")
    scene.AddNode(crosshair)


def _logic(name: str, class_name: str, app_logic: Any, scene: Any) -> Any:
    logic = app_logic.GetColorLogic() if class_name == "vtkMRMLColorLogic" else getattr(slicer, class_name)()
    logic.SetMRMLApplicationLogic(app_logic)
    logic.SetMRMLScene(scene)
    app_logic.SetModuleLogic(name, logic)
    return logic


def _add_singletons(scene: Any) -> None:
    """Nodes that the Qt application makes; they stay when the scene is closed."""
    for cls in ("vtkMRMLSelectionNode", "vtkMRMLInteractionNode"):
        if scene.GetNodeByID(f"{cls}Singleton") is None:
            node = getattr(slicer, cls)()
            node.SetSingletonTag("Singleton")
            scene.AddNode(node)
    slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(scene)  # this call makes it
    slicer.vtkMRMLSliceNode.AddDefaultSliceOrientationPresets(scene, True)


def _file_io(scene: Any, app_logic: Any, folder: str) -> tuple[Any, Any]:
    """Without these two managers, reading a .mrb fails."""
    remote, data = slicer.vtkMRMLRemoteIOLogic(), slicer.vtkDataIOManagerLogic()
    for logic in (remote, data):
        logic.SetMRMLScene(scene)
        logic.SetMRMLApplicationLogic(app_logic)
    remote.GetCacheManager().SetRemoteCacheDirectory(folder)
    data.SetAndObserveDataIOManager(remote.GetDataIOManager())
    remote.AddDataIOToScene()
    return remote, data
