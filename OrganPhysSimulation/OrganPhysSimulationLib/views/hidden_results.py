"""The registration's own surfaces stand where the organ was: hidden while the simulation shows where it is."""

from __future__ import annotations

from typing import Any

from OrganPhysRegistrationLib.outputs.case_record import SURFACES, CaseNodes
from OrganPhysRegistrationLib.outputs.surface_nodes import legend_of


class HiddenResults:
    """Hides what is visible of a case's surfaces (None: of nothing), with their legends, until ``restore``."""

    def __init__(self, case: CaseNodes | None) -> None:
        self._hidden: list[Any] = []
        surfaces = [] if case is None else [case.get(role) for role in SURFACES]
        for node in surfaces:
            if node is not None and node.GetDisplayNode() is not None:
                self._hide(node.GetDisplayNode())
                self._hide(legend_of(node))

    def restore(self) -> None:
        """Show again what was visible and is still there."""
        for display in self._hidden:
            if display.GetScene() is not None:
                display.SetVisibility(True)
        self._hidden = []

    def _hide(self, display: Any) -> None:
        if display is not None and display.GetVisibility():
            display.SetVisibility(False)
            self._hidden.append(display)
