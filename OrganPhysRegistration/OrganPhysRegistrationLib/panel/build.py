"""Puts the sections of the panel together."""

from __future__ import annotations

from typing import Any

from .advanced_section import AdvancedSection
from .camera_section import CameraSection
from .display_section import DisplaySection
from .export_section import ExportSection
from .inputs_section import InputsSection
from .landmarks_section import LandmarksSection
from .live_section import LiveSection
from .panel import Panel
from .pose_section import PoseSection
from .register_section import RegisterSection
from .result_section import ResultSection
from .sequence_section import SequenceSection
from .splat_landmarks_section import SplatLandmarksSection
from .unit_section import UnitSection
from .weights_section import WeightsSection


def build_panel(ui: Any, logic: Any) -> Panel:
    """``ui``: widgets of OrganPhysRegistration.ui by name; the panel is not bound to parameters yet."""
    panel = Panel(ui, logic)
    register = RegisterSection(panel)
    panel.sections = [
        InputsSection(panel),
        UnitSection(panel),
        CameraSection(panel),
        LandmarksSection(panel),
        SplatLandmarksSection(panel),
        WeightsSection(panel),
        DisplaySection(panel),
        register,
        LiveSection(panel, register),
        PoseSection(panel, register),
        ResultSection(panel),
        ExportSection(panel),
        SequenceSection(panel),
        AdvancedSection(panel),
    ]
    return panel
