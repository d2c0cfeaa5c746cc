"""The endoscope's reference view from a 3D view of the scene, and a 3D view from the endoscope's place.

Angles: VTK's view angle is the full angle of the picture's height; the core's field of view is the full angle of the
cone about the view's axis. The cone taken from a view is the largest that the picture shows whole: that of its
shorter side.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy

from organphys.ground.checks import Array, InputError, as_vector
from organphys.points.point_sets import Camera

from .matrices import apply_matrix
from .splat_display import shown_gaussians
from .splat_node import T_shown_scene, checked_splat

HELD = 0.98  # share of the splat that a view must show to be taken for the endoscope's picture
WIDEST_DEG = 150.0


def camera_from_view(splat_node: Any, view: Any, *, aspect: float | None = None) -> tuple[Array, float]:
    """Position (3,) in raw scene units and full field of view in degrees of a 3D view (its camera or view node).

    The field of view is 0.0, unknown, where the picture shows less than 98 % of the splat: then it cannot be the
    endoscope's. ``aspect``: width / height, default that of the view on the screen. InputError: no view, parallel
    projection, or a camera in the middle of the splat.
    """
    checked_splat(splat_node)
    node = camera_node(view)
    if node.GetParallelProjection():
        raise InputError("camera: the 3D view shows no perspective; switch it from orthographic to perspective")
    T_scene_world = np.linalg.inv(T_shown_scene(splat_node))
    position = apply_matrix(T_scene_world, np.array(node.GetPosition()))
    aspect = aspect or _aspect(node)
    slope = np.tan(np.radians(node.GetViewAngle() / 2))
    if node.GetCamera().GetUseHorizontalViewAngle():
        slope /= aspect
    fov_deg = 2 * float(np.degrees(np.arctan(slope * min(1.0, aspect))))
    inside = _angles_deg(splat_node, position) <= fov_deg / 2
    return position, fov_deg if inside.mean() >= HELD else 0.0


def look_from_endoscope(
    splat_node: Any,
    view: Any,
    *,
    position: Any = None,
    fov_deg: float | None = None,
    aspect: float | None = None,
) -> None:
    """Put the camera of a 3D view where the endoscope was: upright, not mirrored, its field of view filling the view.

    ``position`` (3,) in scene units, default the scene's origin; it looks along +z of the scene or, where the splat
    does not lie there, towards the splat, as registration takes it. ``fov_deg``: None or 0 shows the whole splat.
    """
    checked_splat(splat_node)
    node = camera_node(view)
    position = np.zeros(3) if position is None else as_vector(position, "camera position")
    axes = _axes(splat_node, position)
    angles = _angles_deg(splat_node, position)
    fov_deg = fov_deg or min(WIDEST_DEG, 2.1 * float(np.quantile(angles, 0.999)))
    aspect = aspect or _aspect(node)
    depth = float(np.median((_shown_points(splat_node) - position) @ axes[2]))
    T_world_scene = T_shown_scene(splat_node)
    node.SetParallelProjection(False)
    node.GetCamera().SetUseHorizontalViewAngle(False)
    node.SetViewAngle(2 * float(np.degrees(np.arctan(np.tan(np.radians(fov_deg / 2)) / min(1.0, aspect)))))
    node.SetPosition(*apply_matrix(T_world_scene, position))
    node.SetFocalPoint(*apply_matrix(T_world_scene, position + depth * axes[2]))
    up = -T_world_scene[:3, :3] @ axes[1]
    node.SetViewUp(*(up / np.linalg.norm(up)))
    node.ResetClippingRange()


def camera_node(view: Any) -> Any:
    """The vtkMRMLCameraNode of a view node; a camera node stands for itself."""
    if view is not None and view.IsA("vtkMRMLViewNode"):
        view = slicer.modules.cameras.logic().GetViewActiveCameraNode(view)
    if view is None or not view.IsA("vtkMRMLCameraNode"):
        raise InputError("camera: there is no 3D view; choose a layout that shows one")
    return view


def _aspect(node: Any) -> float:
    """Width / height on the screen of the view that shows this camera; 1 where none does."""
    layout = slicer.app.layoutManager()
    for index in range(layout.threeDViewCount if layout is not None else 0):
        view = layout.threeDWidget(index).threeDView()
        if view.mrmlViewNode().GetLayoutName() == node.GetLayoutName():
            width, height = view.renderWindow().GetSize()
            return width / height if width and height else 1.0
    return 1.0


def _axes(splat_node: Any, position: Array) -> Array:
    """Rows right, down, forward (3, 3) of the reference camera in the scene, as registration takes it."""
    from organphys.align.splat_view import look

    axes: Array = look(_shown_points(splat_node), Camera(position))[0].rotation
    return axes


def _angles_deg(splat_node: Any, position: Array) -> Array:
    """Angle (N,) between the reference camera's axis and each shown Gaussian."""
    seen = (_shown_points(splat_node) - position) @ _axes(splat_node, position).T
    angles: Array = np.degrees(np.arctan2(np.linalg.norm(seen[:, :2], axis=1), seen[:, 2]))
    return angles


def _shown_points(splat_node: Any) -> NDArray[np.float64]:
    """Centres (N, 3), scene units, of what is shown."""
    points = vtk_to_numpy(splat_node.GetPolyData().GetPoints().GetData())
    shown = shown_gaussians(splat_node)
    if not shown.any():
        raise InputError("splat: nothing of it is shown; lower the opacity threshold or enlarge the region of interest")
    return points[shown].astype(np.float64)
