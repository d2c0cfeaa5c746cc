"""Puts the sections of the panel together."""

from __future__ import annotations

from typing import Any

from .display_section import DisplaySection
from .organ_section import OrganSection
from .panel import Panel
from .pins_section import PinsSection
from .readings_section import ReadingsSection
from .record_section import RecordSection
from .run_section import RunSection
from .sequence_section import SequenceSection
from .tissue_section import TissueSection
from .tool_section import ToolSection


def build_panel(ui: Any, logic: Any) -> Panel:
    """``ui``: widgets of OrganPhysSimulation.ui by name; the panel is not bound to parameters yet."""
    panel = Panel(ui, logic)
    run = RunSection(panel)
    panel.sections = [
        OrganSection(panel),
        TissueSection(panel),
        PinsSection(panel),
        run,
        ReadingsSection(panel),
        ToolSection(panel),
        DisplaySection(panel),
        RecordSection(panel),
        SequenceSection(panel),
    ]
    return panel
