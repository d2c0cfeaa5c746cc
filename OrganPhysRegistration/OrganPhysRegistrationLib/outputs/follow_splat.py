"""Results that go along when the splat is shown at another scale or was moved in its frame."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk

from ..inputs.matrices import matrix_of
from .case_nodes import batch
from .case_record import SURFACES, CaseNodes
from .overlay_frame import T_overlay_scene, overlay_in, set_overlay
from .transform_nodes import move_transforms


def follow_splat(case: CaseNodes) -> bool:
    """Put all results of a case where its splat is now, after ``set_scale`` or a change of its scene-to-world matrix.

    Whether anything had to move. InputError if the splat stands under a non-linear transform.
    """
    now = T_overlay_scene(case.splat, case.node("overlay_frame"))
    before = np.array(case.record["T_overlay_scene"])
    if np.allclose(now, before, rtol=1e-12, atol=1e-12):
        return False
    move = vtk.vtkTransform()
    move.SetMatrix(matrix_of(now @ np.linalg.inv(before)))
    with batch(case.scene):
        for role in (*SURFACES, "volume"):
            if case.get(role) is not None:
                _move_model(case.node(role), move)
        case.update_record(T_overlay_scene=now.tolist())
        move_transforms(case)
        set_overlay(case, overlay_in(case))
    return True


def results_follow(splat: Any) -> int:
    """``follow_splat`` for every case on this splat; how many of them moved."""
    return sum(follow_splat(case) for case in CaseNodes.all(splat.GetScene()) if case.splat is splat)


def _move_model(node: Any, move: Any) -> None:
    mover = vtk.vtkTransformPolyDataFilter()
    mover.SetTransform(move)
    mover.SetInputData(node.GetPolyData())
    mover.Update()
    node.SetAndObserveMesh(mover.GetOutput())
