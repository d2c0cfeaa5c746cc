"""Section 2, first part: tissue, gravity, local detail; all of it may change while the simulation runs."""

from __future__ import annotations

from typing import Any

import slicer
from slicer.i18n import tr as _

from organphys.ground.checks import Array
from OrganPhysRegistrationLib.panel.section import Section, guarded

from ..choices import GravityChoice
from ..inputs.organ_input import organ_of
from ..inputs.tissue_input import gravity_by_patient, tissue_of
from ..outputs.gravity_line import drawn_direction, write_gravity_line
from ..roles import find


class TissueSection(Section):
    """Tells which numbers are used and where they come from."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self._applied: dict[str, Any] = {}
        self._session: Any = None
        self._line: Any = None
        self._named: tuple[Any, str] = (None, "")

    def bind(self) -> None:
        self._observe(None)
        self._named = (None, "")

    def refresh(self) -> None:
        parameters, session = self.panel.parameters, self.panel.logic.session
        tissue = tissue_of(parameters.tissue.value, parameters.youngsKpa, self._organ_name(parameters.organ))
        facts = _("E {e:.1f} kPa, ν {nu:.2f}, {density:.0f} kg/m³ ({name})").format(
            e=tissue.youngs_pa / 1e3, nu=tissue.nu, density=tissue.density, name=tissue.name
        )
        self.ui.tissueNote.text, self.ui.tissueNote.toolTip = facts, tissue.source
        self.ui.gravityBox.enabled = parameters.gravity
        if session is not self._session:
            self._session = session
            self._applied = {} if session is None else self._choice()
            self._show_line()
        elif session is not None and not self.panel.logic.busy:
            self._apply()

    @guarded
    def _apply(self) -> None:
        """Hand what has changed to the running simulation."""
        logic, now, before = self.panel.logic, self._choice(), self._applied
        self._applied = now
        if now["tissue"] != before["tissue"]:
            logic.setTissue(*now["tissue"])
        if now["detail"] != before["detail"]:
            logic.session.live.set_detail(now["detail"])
        if now["gravity"] != before["gravity"]:
            self._show_line()
            self.set_gravity()

    def gravity(self) -> Array | None:
        """Direction (3,) of gravity in the scene as it is chosen, None: none."""
        parameters = self.panel.parameters
        if not parameters.gravity:
            return None
        choice, session = parameters.gravityChoice, self.panel.logic.session
        drawn = None if session is None or choice is not GravityChoice.Arrow else drawn_direction(session.T_world_sim)
        return drawn if drawn is not None else by_patient(organ_of(parameters.organ), choice)

    @guarded
    def set_gravity(self) -> None:
        """Gravity as it is chosen, in the running simulation."""
        logic = self.panel.logic
        logic.setGravity(self.gravity())
        self.panel.tell(logic.warnings(), "warning")

    def _choice(self) -> dict[str, Any]:
        parameters = self.panel.parameters
        return {
            "tissue": (parameters.tissue.value, parameters.youngsKpa),
            "detail": parameters.detail,
            "gravity": (parameters.gravity, parameters.gravityChoice),
        }

    def _show_line(self) -> None:
        """The arrow is there while gravity is on."""
        session, line = self.panel.logic.session, find("gravity")
        direction = None if session is None else self.gravity()
        if direction is not None:
            line = write_gravity_line(session.T_world_sim, session.live.prepared.centre, direction)
        if line is not None:
            line.SetDisplayVisibility(direction is not None)
            line.SetLocked(self.panel.parameters.gravityChoice is not GravityChoice.Arrow)
        self._observe(line if direction is not None else None)

    def _observe(self, line: Any) -> None:
        if line is self._line:
            return
        event = slicer.vtkMRMLMarkupsNode.PointModifiedEvent
        if self._line is not None:
            self.removeObserver(self._line, event, self._dragged)
        if line is not None:
            self.addObserver(line, event, self._dragged)
        self._line = line

    def _dragged(self, *_event: Any) -> None:
        parameters = self.panel.parameters
        arrow = parameters is not None and parameters.gravityChoice is GravityChoice.Arrow
        if arrow and self.panel.logic.session is not None:
            self.set_gravity()

    def _organ_name(self, node: Any) -> str:
        """Name of the organ a node carries, "" where it carries none (which is told at Start)."""
        if node is not self._named[0]:
            self._named = (node, "" if node is None else name_of(node))
        return self._named[1]


def name_of(node: Any) -> str:
    """Name of the organ that a node carries, of the node itself where it carries none."""
    case = node.GetAttribute("OrganPhys.Case")
    return str(node.GetName()) if case is None else str(node.GetName()).split(" displaced")[0]


def by_patient(organ: Any, choice: GravityChoice) -> Array:
    """Direction of gravity in the scene for a lying patient; on the back where the arrow is not drawn yet."""
    return gravity_by_patient(organ, choice.value or GravityChoice.Supine.value)
