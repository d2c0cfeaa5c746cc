"""Floaters of a splat, the outliers and small clusters that registration can leave out: previewed, hidden, restored."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.progress import Progress, no_progress
from organphys.points.point_sets import Box

from .splat_display import COLOUR, show_colours, show_gaussians, visible_gaussians

PREVIEW = "colour with floaters"
PREVIEW_COLOUR = (255, 0, 220)  # nothing in a body has it

_last: dict[str, Any] = {}  # the last search, so that preview, apply and slider moves do not repeat it


def floaters(
    node: Any, *, opacity: float = 0.1, box: Box | None = None, progress: Progress = no_progress
) -> NDArray[np.bool_]:
    """(N,) bool: which of the visible Gaussians are floaters; the same as registration's ``clean`` leaves out.

    Takes about a second, also for large splats; the last answer is kept.
    """
    from organphys.points.target_selection import clean_points

    visible = visible_gaussians(node, opacity=opacity, box=box)
    points = node.GetPolyData().GetPoints()
    key = (node.GetID(), points.GetMTime(), int(visible.sum()), visible.tobytes())
    if _last.get("key") != key:
        rows = np.flatnonzero(visible)
        keep = clean_points(vtk_to_numpy(points.GetData())[rows].astype(np.float64), progress=progress).keep
        found = np.zeros(len(visible), dtype=bool)
        found[rows[~keep]] = True
        _last.update(key=key, found=found)
    found = _last["found"].copy()
    return found


def update_splat(
    node: Any,
    *,
    opacity: float = 0.1,
    box: Box | None = None,
    remove_floaters: bool = False,
    progress: Progress = no_progress,
) -> int:
    """Show what registration would use: above the threshold, in the box, on demand without floaters.

    Ends a preview. Returns how many Gaussians are shown; the file's points and arrays stay.
    """
    end_preview(node)
    shown = visible_gaussians(node, opacity=opacity, box=box)
    if remove_floaters:
        shown &= ~floaters(node, opacity=opacity, box=box, progress=progress)
    return show_gaussians(node, shown)


def preview_floaters(
    node: Any, *, opacity: float = 0.1, box: Box | None = None, progress: Progress = no_progress
) -> int:
    """Show the visible Gaussians with the floaters in a signal colour; returns how many they are."""
    found = floaters(node, opacity=opacity, box=box, progress=progress)
    data = node.GetPolyData().GetPointData()
    colours = vtk_to_numpy(data.GetArray(COLOUR)).copy()
    colours[found] = PREVIEW_COLOUR
    array = numpy_to_vtk(colours, deep=True)
    array.SetName(PREVIEW)
    data.AddArray(array)
    show_gaussians(node, visible_gaussians(node, opacity=opacity, box=box))
    show_colours(node, PREVIEW)
    return int(found.sum())


def end_preview(node: Any) -> None:
    """Back to the splat's own colours; nothing of a preview is left on the node."""
    data = node.GetPolyData().GetPointData()
    if data.HasArray(PREVIEW):
        show_colours(node, COLOUR)
        data.RemoveArray(PREVIEW)
        data.SetActiveScalars(COLOUR)
        node.GetPolyData().Modified()
