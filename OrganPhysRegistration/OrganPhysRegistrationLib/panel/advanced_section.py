"""Section 6: settings that are seldom touched, and which core package is in use."""

from __future__ import annotations

from typing import Any

from ..choices import Method
from ..runs.core_in_use import core_in_use
from .section import Section


class AdvancedSection(Section):
    """The skinning weights matter for the paper's method only."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        core = core_in_use()
        self.ui.coreLabel.text = f"organphys {core.version}"
        self.ui.coreLabel.toolTip = core.file

    def refresh(self) -> None:
        self.ui.weightsCombo.enabled = self.panel.parameters.method is Method.Paper
