"""Stand-in for ``slicer.app.coreIOManager()``: the most confident reader loads; storage nodes write."""

from __future__ import annotations

import os
from typing import Any

import vtk

from .scripted_reader import ReaderParent, extension_confidence

EXTENSIONS = {
    "SegmentationFile": (".seg.nrrd", ".seg.nhdr", ".seg.vtm"),
    "MarkupsFile": (".mrk.json", ".json", ".fcsv"),
    "SceneFile": (".mrml", ".mrb"),
    "TransformFile": (".tfm", ".h5", ".mat"),
    "TableFile": (".csv", ".tsv"),
    "ModelFile": (".vtk", ".vtp", ".stl", ".ply", ".obj", ".vtu"),
    "TextFile": (".txt",),
    "VolumeFile": (".nii.gz", ".nii", ".nrrd", ".nhdr", ".mha", ".mhd", ".png", ".jpg", ".tif"),
}
STORED = {  # file types that are read by a storage node: node class and storage class
    "SegmentationFile": ("vtkMRMLSegmentationNode", "vtkMRMLSegmentationStorageNode"),
    "TableFile": ("vtkMRMLTableNode", "vtkMRMLTableStorageNode"),
    "TextFile": ("vtkMRMLTextNode", "vtkMRMLTextStorageNode"),
}


class IOManager:
    def __init__(self, core: Any) -> None:
        self._core = core
        self._scripted: list[ReaderParent] = []

    def add_scripted_reader(self, reader_class: type) -> None:
        self._scripted.append(ReaderParent(reader_class))

    def confidences(self, path: str) -> dict[str, float]:
        """File type -> confidence of its reader for this file, without the readers that cannot read it."""
        found = {kind: extension_confidence(str(path), ends) for kind, ends in EXTENSIONS.items()}
        for scripted in self._scripted:
            found[scripted.reader.fileType()] = scripted.confidence(str(path))
        return {kind: confidence for kind, confidence in found.items() if confidence > 0}

    def fileType(self, path: str) -> str:
        found = self.confidences(path)
        return max(found, key=found.__getitem__) if found else "NoFile"

    def loadFile(self, path: str) -> bool:
        """What drag and drop of a file ends in."""
        return self.loadNodes(self.fileType(path), {"fileName": str(path)})

    def loadNodes(self, fileType: str, properties: dict[str, Any], loaded: Any = None, messages: Any = None) -> bool:
        properties = dict(properties)
        path = os.path.abspath(str(properties["fileName"]))
        for scripted in self._scripted:
            if scripted.reader.fileType() == fileType:
                return scripted.load(properties, loaded, messages)
        if not os.path.isfile(path):
            if messages is not None:
                messages.AddMessage(vtk.vtkCommand.ErrorEvent, f"file not found: {path}")
            return False
        if fileType == "SceneFile":
            return self._load_scene(path, bool(properties.get("clear", False)))
        name = properties.get("name") or os.path.basename(path).split(".")[0]
        node = self._load(fileType, path, name, properties)
        if node is not None and loaded is not None:
            loaded.AddItem(node)
        return node is not None

    def _load(self, kind: str, path: str, name: str, properties: dict[str, Any]) -> Any:
        logics = self._core.logics
        if kind == "VolumeFile":
            return logics["Volumes"].AddArchetypeVolume(path, name, 1 if properties.get("labelmap") else 0)
        if kind == "ModelFile":
            node = logics["Models"].AddModel(path)
            if node is not None:
                node.SetName(name)
            return node
        if kind == "MarkupsFile":
            return self._core.scene.GetNodeByID(logics["Markups"].LoadMarkups(path, name) or "")
        if kind == "TransformFile":
            return logics["Transforms"].AddTransform(path, self._core.scene)
        return self._load_stored(*STORED[kind], path, name) if kind in STORED else None

    def _load_stored(self, node_class: str, storage_class: str, path: str, name: str) -> Any:
        scene = self._core.scene
        node = scene.AddNewNodeByClass(node_class, scene.GenerateUniqueName(name))
        storage = scene.AddNewNodeByClass(storage_class)
        storage.SetFileName(path)
        if not storage.ReadData(node):
            scene.RemoveNode(storage)
            scene.RemoveNode(node)
            return None
        node.SetAndObserveStorageNodeID(storage.GetID())
        if hasattr(node, "CreateDefaultDisplayNodes"):
            node.CreateDefaultDisplayNodes()
        return node

    def _load_scene(self, path: str, clear: bool) -> bool:
        scene = self._core.scene
        if path.endswith(".mrb"):
            return bool(scene.ReadFromMRB(path, clear))
        scene.SetURL(path)
        return bool(scene.Connect() if clear else scene.Import())

    def loadScene(self, path: str, clear: bool = True) -> bool:
        return self._load_scene(os.path.abspath(str(path)), clear)

    def saveNodes(self, fileType: str, properties: dict[str, Any], messages: Any = None) -> bool:
        scene, path = self._core.scene, os.path.abspath(str(properties["fileName"]))
        if fileType == "SceneFile":
            scene.SetURL(path)
            scene.SetRootDirectory(os.path.dirname(path))
            return bool(scene.WriteToMRB(path) if path.endswith(".mrb") else scene.Commit(path))
        node = scene.GetNodeByID(properties["nodeID"])
        if node.GetStorageNode() is None:
            node.AddDefaultStorageNode(path)
        storage = node.GetStorageNode()
        storage.SetFileName(path)
        if "useCompression" in properties:
            storage.SetUseCompression(int(properties["useCompression"]))
        return bool(storage.WriteData(node))

    def fileWriterFileType(self, node: Any) -> str:
        return node.GetClassName()

    def fileWriterExtensions(self, node: Any) -> list[str]:
        types = _storage(node).GetSupportedWriteFileTypes()
        return [types.GetValue(i) for i in range(types.GetNumberOfValues())]

    def extractKnownExtension(self, path: str, node: Any) -> str:
        return _storage(node).GetSupportedFileExtension(str(path), True, True)


def _storage(node: Any) -> Any:
    storage = node.GetStorageNode()
    if storage is None:
        storage = node.CreateDefaultStorageNode()
        storage.UnRegister(None)
    return storage
