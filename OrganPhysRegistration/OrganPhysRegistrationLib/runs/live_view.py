"""The organ in the 3D view while a run goes on: after each stage, and several times a second in the elastic stage."""

from __future__ import annotations

from typing import Any

from organphys.ground.checks import Array

from ..outputs.case_nodes import case_of
from ..outputs.live_overlay import LiveOverlay
from .run_inputs import RunInputs


class LiveView:
    """Shows nothing before it knows the organ's triangles; ``remove`` leaves no trace in the scene."""

    def __init__(self, inputs: RunInputs) -> None:
        self._inputs = inputs
        self._overlay: LiveOverlay | None = None

    def start(self, faces: Any) -> None:
        """Triangles (Nf, 3) of the organ, None if they are not known yet; the first ones count."""
        if self._overlay is None and faces is not None:
            inputs = self._inputs
            case = case_of(inputs.segmentation, inputs.segment_id, inputs.splat)
            self._overlay = LiveOverlay(inputs.splat, faces, case)

    def show(self, points: Array) -> None:
        """Vertices (Nv, 3) in scene units."""
        if self._overlay is not None:
            self._overlay.update(points)

    def remove(self) -> None:
        """Take the organ out of the view."""
        overlay, self._overlay = self._overlay, None
        if overlay is not None:
            overlay.remove()
