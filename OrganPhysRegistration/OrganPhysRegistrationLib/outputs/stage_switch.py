"""Which stage's surface is shown over the splat."""

from __future__ import annotations

from organphys.ground.checks import InputError, one_of

from .case_record import STAGES, CaseNodes
from .surface_nodes import legend_of

SHOWN = "OrganPhys.ShownStage"


def show_stage(case: CaseNodes, stage: str) -> None:
    """Show the surface of one stage ("before", "coarse", "rigid", "elastic") with its legend and hide the others."""
    one_of(stage, "stage", STAGES)
    if stage not in case.stages:
        raise InputError(f"the {stage} stage has not been run for this case; shown can be: {', '.join(case.stages)}")
    for other in case.stages:
        surface = case.node(f"surface_{other}")
        surface.SetDisplayVisibility(other == stage)
        legend = legend_of(surface)
        if legend is not None:
            legend.SetVisibility(other == stage)
    case.node("case").SetAttribute(SHOWN, stage)


def shown_stage(case: CaseNodes) -> str:
    """The stage whose surface was shown last."""
    shown = case.node("case").GetAttribute(SHOWN)
    return shown if shown in case.stages else case.stage
