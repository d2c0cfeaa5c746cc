"""Writes the outcome of a registration into the scene: one case, made by the first run and refilled by later ones."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import slicer

from organphys.ground.checks import InputError

from ..inputs.splat_scale import mm_per_unit_of, set_scale
from .case_record import CaseNodes
from .charts import write_charts
from .node_factory import ensure
from .overlay_frame import T_overlay_scene, overlay_in, put_under_overlay_frame, set_overlay
from .snapshot import SceneSnapshot
from .stage_switch import show_stage
from .surface_colours import colour_surfaces
from .surface_nodes import SurfaceNormals, write_surfaces
from .tables import write_metrics
from .transform_nodes import write_transforms
from .volume_node import write_volume

__all__ = ["CaseNodes", "batch", "case_of", "new_case_id", "write_grids", "write_outcome"]


def write_outcome(
    outcome: Any,
    *,
    segmentation: Any,
    segment_id: str,
    splat: Any,
    case_id: str | None = None,
    normals: SurfaceNormals | None = None,
) -> CaseNodes:
    """Make or refill the nodes of a case from a ``CaseOutcome``; the last stage that is done is shown.

    The case of the same segment and splat is taken if there is one, or ``case_id``; ``normals``: those of its surfaces,
    where they are known already. Anything that fails leaves the
    scene as it was. Without a stated unit the splat is shown at the registered scale from now on.
    """
    scene = splat.GetScene()
    known = CaseNodes.find(scene, case_id) if case_id else case_of(segmentation, segment_id, splat)
    case = known or CaseNodes(case_id or new_case_id(), scene)
    before = SceneSnapshot(case, splat)
    with batch(scene):
        try:
            _write(case, outcome, segmentation, segment_id, splat, normals or SurfaceNormals.of(outcome))
        except BaseException:
            before.restore(drop_new_nodes=True)
            raise
    return case


def write_grids(case: CaseNodes, grids: Any) -> None:
    """Make the transforms of an elastic case elastic, once its ``DisplacementGrids`` are sampled; the rest stays."""
    if case.stage != "elastic":
        raise InputError(f"grids: they belong to an elastic result, and the {case.stage} stage is the last one done")
    with batch(case.scene):
        write_transforms(case, grids)
        write_metrics(case)


def case_of(segmentation: Any, segment_id: str, splat: Any) -> CaseNodes | None:
    """The case of this segment and this splat, None if they have not been registered yet."""
    for case in CaseNodes.all(splat.GetScene()):
        if case.splat is splat and case.segmentation is segmentation and case.segment_id == segment_id:
            return case
    return None


def new_case_id() -> str:
    """An id that no other case has, also not one of a scene that is loaded later."""
    return uuid.uuid4().hex[:12]


@contextmanager
def batch(scene: Any) -> Iterator[None]:
    """Views are drawn once, after all nodes are written."""
    scene.StartState(slicer.vtkMRMLScene.BatchProcessState)
    try:
        yield
    finally:
        scene.EndState(slicer.vtkMRMLScene.BatchProcessState)


def _write(
    case: CaseNodes, outcome: Any, segmentation: Any, segment_id: str, splat: Any, normals: SurfaceNormals
) -> None:
    _write_case(case, segmentation, segment_id, splat)
    frame = put_under_overlay_frame(case, splat)
    case.node("case").SetNodeReferenceID("overlay_frame", frame.GetID())
    _show_registered_scale(case, outcome, splat)
    matrix = T_overlay_scene(splat, frame)
    case.update_record(
        stage=outcome.stage,
        similarities={stage: np.asarray(T).tolist() for stage, T in outcome.similarities.items()},
        metrics={stage: {name: dict(entry) for name, entry in of.items()} for stage, of in outcome.metrics.items()},
        seconds=dict(outcome.seconds),
        notices=[list(notice) for notice in outcome.notices],
        facts=dict(outcome.facts),
        stops=dict(outcome.stops),
        mm_per_unit=float(outcome.mm_per_unit),
        unit_stated=bool(outcome.unit_stated),
        camera_position=np.asarray(outcome.camera_position, dtype=float).tolist(),
        T_overlay_scene=matrix.tolist(),
        verdict=outcome.verdict,
    )
    write_surfaces(case, outcome, matrix, frame, normals)
    colour_surfaces(case)
    write_volume(case, outcome, matrix, frame)
    write_transforms(case, outcome.grids)
    write_metrics(case)
    write_charts(case, outcome)
    show_stage(case, outcome.stage)
    set_overlay(case, overlay_in(case))


def _write_case(case: CaseNodes, segmentation: Any, segment_id: str, splat: Any) -> None:
    node = ensure(case, "case")
    segment = segmentation.GetSegmentation().GetSegment(segment_id) if segmentation is not None else None
    node.SetName(segment.GetName() if segment is not None else "Organ")
    node.SetNodeReferenceID("segmentation", None if segmentation is None else segmentation.GetID())
    node.SetNodeReferenceID("splat", splat.GetID())
    node.SetAttribute("OrganPhys.SegmentID", segment_id)


def _show_registered_scale(case: CaseNodes, outcome: Any, splat: Any) -> None:
    """Show the splat at 1/s unless it is shown at a stated unit. Several organs on one splat keep the first's scale."""
    others = [one for one in CaseNodes.all(case.scene) if one.case_id != case.case_id and one.splat is splat]
    registered, (shown, kind, _) = float(outcome.mm_per_unit), mm_per_unit_of(splat)
    if kind != "stated" and not others and (shown, kind) != (registered, "registered"):
        set_scale(splat, registered, "registered")
