"""VTK's XML files by way of memory: its writers report success on a full disk."""

from __future__ import annotations

from typing import Any


def polydata_bytes(data: Any) -> bytes:
    """The .vtp file of a ``vtkPolyData``."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter()
    writer.WriteToOutputStringOn()
    writer.SetInputData(data)
    writer.Write()
    text: str = writer.GetOutputString()
    return text.encode("ascii")
