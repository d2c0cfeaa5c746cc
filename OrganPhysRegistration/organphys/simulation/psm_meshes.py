"""Surfaces of a PSM instrument for display."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from .instruments import Instrument
from .state import ToolPose


class PlacedMesh(NamedTuple):
    """One closed surface: vertices (N, 3) m in the scene, triangles (M, 3) int, counter-clockwise from outside."""

    name: str
    vertices: Array
    triangles: NDArray[np.int64]


def psm_meshes(instrument: Instrument, pose: ToolPose, T_scene_rcm: Array) -> list[PlacedMesh]:
    """Shaft, wrist and jaws at a pose."""
    raise NotImplementedError
