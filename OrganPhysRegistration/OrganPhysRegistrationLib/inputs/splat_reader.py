"""File reader that claims Gaussian splats among the .ply files, so that Add Data and drag and drop load them here."""

from __future__ import annotations

from typing import Any

HEADER_BYTES = 16_384  # SH degree 3 and SuperSplat headers need about 2,000
CONFIDENCE = 0.9  # Slicer's own model reader answers 0.54 for every .ply
GAUSSIAN = ({"x", "y", "z", "opacity"}, {"packed_position", "packed_rotation", "packed_scale", "packed_color"})


class OrganPhysRegistrationFileReader:
    """Protocol of qSlicerScriptedFileReader; ``parent`` is the C++ reader, which takes the loaded nodes' ids."""

    def __init__(self, parent: Any) -> None:
        self.parent = parent

    def description(self) -> str:
        return "Gaussian splat"

    def fileType(self) -> str:
        return "OrganPhysSplatFile"

    def extensions(self) -> list[str]:
        return ["Gaussian splat (*.ply)"]

    def canLoadFile(self, filePath: str) -> bool:
        return is_splat_file(filePath)

    def canLoadFileConfidence(self, filePath: str) -> float:
        return CONFIDENCE if is_splat_file(filePath) else 0.0

    def load(self, properties: Any) -> bool:
        """Loads properties["fileName"]; optional "name" and "mmPerUnit". A failure is told, not raised."""
        from organphys.ground.checks import InputError

        from ..dependencies import DependencyError, ensure_packages
        from .splat_node import load_splat

        try:
            ensure_packages()
            node = load_splat(properties["fileName"], mm_per_unit=properties.get("mmPerUnit"))
        except (InputError, DependencyError) as error:
            self._tell(str(error))
            return False
        if properties.get("name"):
            node.SetName(properties["name"])
        self.parent.loadedNodes = [node.GetID()]
        return True

    def _tell(self, message: str) -> None:
        """Into the messages that Slicer shows after loading, and the log."""
        import logging

        import vtk

        logging.error(message)
        if hasattr(self.parent, "userMessages"):
            self.parent.userMessages().AddMessage(vtk.vtkCommand.ErrorEvent, message)


def is_splat_file(path: str) -> bool:
    """Whether a PLY header names the fields of Gaussians; False for anything else and for files not readable."""
    try:
        with open(path, "rb") as file:
            head = file.read(HEADER_BYTES)
    except OSError:
        return False
    if not head.startswith((b"ply\n", b"ply\r\n")):
        return False
    names, element = set(), ""
    for line in head.split(b"end_header")[0].decode("ascii", errors="replace").splitlines():
        words = line.split()
        if len(words) == 3 and words[0] == "element":
            element = words[1]
        elif len(words) == 3 and words[0] == "property" and element == "vertex":
            names.add(words[2])
        elif words[:2] == ["property", "list"] and element == "vertex":
            return False
    return any(fields <= names for fields in GAUSSIAN)
