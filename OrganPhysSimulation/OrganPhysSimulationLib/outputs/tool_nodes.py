"""The instrument in the scene: its surfaces, the trocar, and the transform that the user drags."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk

from organphys.ground.checks import Array
from organphys.simulation.psm import Psm
from organphys.simulation.state import ToolPose
from OrganPhysRegistrationLib.inputs.matrices import matrix_of, to_parent
from OrganPhysRegistrationLib.outputs.geometry import cells, smooth_normals, triangle_mesh

from ..engine.arm import ArmState
from ..roles import ensure

STEEL, TROCAR = (0.75, 0.77, 0.80), (0.20, 0.55, 0.90)
TROCAR_RADIUS_MM, TROCAR_WALL_MM = 8.0, 1.5


class ToolNodes:
    """Draws the arm and reads where the user dragged the handle to; everything in mm of the simulation's frame."""

    def __init__(self, frame: Any, psm: Psm) -> None:
        self._psm = psm
        self.handle, self.model, self.trocar = ensure("tool"), ensure("instrument"), ensure("trocar")
        for node in (self.handle, self.model, self.trocar):
            node.SetAndObserveTransformNodeID(frame.GetID())
        _style(self.model, STEEL)
        _style(self.trocar, TROCAR)
        self.trocar.SetAndObserveMesh(_ring(psm))
        self._written = np.eye(4)
        self._triangles: dict[int, Any] = {}

    def write(self, arm: ArmState) -> None:
        """Show the instrument as it stands."""
        meshes = self._psm.meshes(arm.joints, arm.jaw_deg)
        points = np.concatenate([1e3 * mesh.vertices for mesh in meshes])
        starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
        if len(points) not in self._triangles:
            rows = np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)])
            self._triangles = {len(points): cells(rows)}
        triangles = self._triangles[len(points)]
        self.model.SetAndObserveMesh(triangle_mesh(points, triangles, smooth_normals(points, triangles)))

    def write_handle(self, pose: ToolPose) -> None:
        """Put the handle where the tool is wanted; this is no drag."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = pose.rotation, 1e3 * pose.position
        self._written = matrix
        if not np.allclose(to_parent(self.handle), matrix, atol=1e-9):
            self.handle.SetMatrixTransformToParent(matrix_of(matrix))

    def dragged(self, jaw_deg: float) -> ToolPose | None:
        """The pose that the handle was dragged to since it was written, None if it was not moved."""
        matrix = to_parent(self.handle)
        if np.allclose(matrix, self._written, atol=1e-6):
            return None
        self._written = matrix
        u, _, vt = np.linalg.svd(matrix[:3, :3])  # a drag under a scaled parent may stretch it a little
        turn: Array = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
        return ToolPose(1e-3 * matrix[:3, 3], turn, jaw_deg)

    def show_handle(self, shown: bool) -> None:
        """Arrows and rings with which the transform is dragged in the 3D views."""
        display = self.handle.GetDisplayNode()
        display.SetEditorVisibility(shown)
        display.SetEditorVisibility3D(shown)
        display.SetEditorTranslationEnabled(shown)
        display.SetEditorRotationEnabled(shown)
        display.SetEditorScalingEnabled(False)


def _style(node: Any, colour: tuple[float, float, float]) -> None:
    display = node.GetDisplayNode()
    display.SetColor(*colour)
    display.SetSpecular(0.4)
    display.SetPower(20)
    display.SetVisibility2D(False)


def _ring(psm: Psm) -> Any:
    """A torus round the remote centre of motion, across the arm's axis."""
    ring = vtk.vtkParametricTorus()
    ring.SetRingRadius(TROCAR_RADIUS_MM)
    ring.SetCrossSectionRadius(TROCAR_WALL_MM)
    source = vtk.vtkParametricFunctionSource()
    source.SetParametricFunction(ring)
    mover, matrix = vtk.vtkTransform(), np.array(psm.T_scene_rcm)
    matrix[:3, 3] *= 1e3
    mover.SetMatrix(matrix_of(matrix))
    moved = vtk.vtkTransformPolyDataFilter()
    moved.SetTransform(mover)
    moved.SetInputConnection(source.GetOutputPort())
    moved.Update()
    return moved.GetOutput()
