"""Where the simulation stands in the world: its millimetres under the splat's own transform."""

from __future__ import annotations

from typing import Any

import numpy as np

from organphys.ground.checks import Array
from OrganPhysRegistrationLib.inputs.matrices import matrix_of, to_parent, world_from_node
from OrganPhysRegistrationLib.inputs.splat_scale import UPRIGHT, scene_to_world

from ..roles import ensure


def write_frame(splat: Any, unit: float) -> Any:
    """The node from simulation mm to the splat's scene units (``unit``: metres per unit), under the splat's transform;
    upright in the world where there is no splat."""
    node, matrix = ensure("frame"), np.eye(4)
    if splat is None:
        matrix[:3, :3] = UPRIGHT
        node.SetAndObserveTransformNodeID(None)
    else:
        matrix[:3, :3] /= 1e3 * unit
        node.SetAndObserveTransformNodeID(scene_to_world(splat).GetID())
    node.SetMatrixTransformToParent(matrix_of(matrix))
    return node


def T_world_sim(frame: Any) -> Array:
    """(4, 4) from simulation mm to world mm."""
    matrix: Array = world_from_node(frame) @ to_parent(frame)
    return matrix
