"""One case in the scene: its nodes, found by the attributes that they keep through saving and loading."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import slicer

from organphys.ground.checks import InputError

from ..inputs.matrices import ROLE

CASE = "OrganPhys.Case"
RECORD = "OrganPhys.Record"
STAGES = ("before", "coarse", "rigid", "elastic")
SURFACES = tuple(f"surface_{stage}" for stage in STAGES)


@dataclass(frozen=True)
class CaseNodes:
    """The nodes of one case. ``case_id`` is the attribute OrganPhys.Case of each, OrganPhys.Role says what it is.

    Roles: case (settings and figures; hidden), surface_before, surface_coarse, surface_rigid, surface_elastic, volume,
    ct_to_scene, scene_to_ct, splat_to_ct_mm, overlay_frame, metrics, and the tables, series and charts of the plots.
    """

    case_id: str
    scene: Any

    @classmethod
    def all(cls, scene: Any = None) -> list[CaseNodes]:
        """Every case of the scene (None: Slicer's), in the order they were made."""
        scene = slicer.mrmlScene if scene is None else scene
        records = _with_role(scene, "case")
        return [cls(node.GetAttribute(CASE), scene) for node in records]

    @classmethod
    def find(cls, scene: Any = None, case_id: str | None = None) -> CaseNodes | None:
        """The case with this id, or the newest one; None if there is none."""
        cases = [case for case in cls.all(scene) if case_id is None or case.case_id == case_id]
        return cases[-1] if cases else None

    def get(self, role: str) -> Any:
        """The node with this role, or None. Cases on one splat share the frame that holds it."""
        for node in self.nodes():
            if node.GetAttribute(ROLE) == role:
                return node
        record = self.get("case") if role == "overlay_frame" else None
        return record.GetNodeReference(role) if record is not None else None

    def node(self, role: str) -> Any:
        """The node with this role; InputError if the case has none (yet) or it was deleted."""
        found = self.get(role)
        if found is None:
            raise InputError(f"the case has no {role.replace('_', ' ')} node; run the registration (again)")
        return found

    def nodes(self) -> list[Any]:
        """All nodes of the case, in the order of the scene."""
        return [node for node in _scene_nodes(self.scene) if node.GetAttribute(CASE) == self.case_id]

    def roles(self) -> list[str]:
        """Roles that are filled now."""
        return [node.GetAttribute(ROLE) for node in self.nodes()]

    @property
    def name(self) -> str:
        return self.node("case").GetName()

    @property
    def segmentation(self) -> Any:
        """Segmentation node of the organ, None if it was deleted."""
        return self.node("case").GetNodeReference("segmentation")

    @property
    def segment_id(self) -> str:
        return self.node("case").GetAttribute("OrganPhys.SegmentID") or ""

    @property
    def splat(self) -> Any:
        """Splat model node, None if it was deleted."""
        return self.node("case").GetNodeReference("splat")

    @property
    def record(self) -> dict[str, Any]:
        """Figures of the run: stage, similarities (T_scene_ct, 4x4 lists), metrics, seconds (s), notices, facts, stops,
        mm_per_unit, unit_stated, camera_position (scene units), T_overlay_scene (4x4 list), transform; verdict (level,
        headline, reasons) of an elastic result; distance_limit_mm: upper end of the colours of the distance."""
        return dict(json.loads(self.node("case").GetAttribute(RECORD) or "{}"))

    def update_record(self, **entries: Any) -> None:
        """Change entries of ``record``; JSON values."""
        self.node("case").SetAttribute(RECORD, json.dumps(self.record | entries))

    @property
    def stage(self) -> str:
        """Last stage done: "coarse", "rigid" or "elastic"."""
        return str(self.record["stage"])

    @property
    def stages(self) -> list[str]:
        """Stages whose surface can be shown."""
        roles = self.roles()
        return [stage for stage in STAGES if f"surface_{stage}" in roles]


def _scene_nodes(scene: Any) -> list[Any]:
    return list(scene.GetNodes())  # by index every access would walk the list from its start


def _with_role(scene: Any, role: str) -> list[Any]:
    return [node for node in _scene_nodes(scene) if node.GetAttribute(ROLE) == role and node.GetAttribute(CASE)]
