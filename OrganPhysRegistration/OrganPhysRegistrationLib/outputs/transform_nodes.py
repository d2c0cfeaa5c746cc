"""Transforms of a case: CT to scene (elastic grid, then similarity), its inverse, and the splat in CT millimetres.

All in RAS mm and in Slicer's direction: a node placed under one of them is moved to the second frame of its name.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..inputs.matrices import matrix_of, scale_of
from .case_record import CaseNodes
from .grid_transforms import composite, displacement_image, grid_in, grid_transform, like_grid, linear
from .inverse_transform import SAMPLED, best_inverse
from .node_content import set_attribute
from .node_factory import ensure

ELASTIC, SIMILARITY, PENDING = "elastic", "similarity", "similarity only: the elastic part is not sampled yet"
MB = 1e6
ROWS = (
    ("sampling error inside, largest", "SamplingErrorMaxMm", "mm"),
    ("sampling error inside, 95 %", "SamplingErrorP95Mm", "mm"),
    ("sampling error within 30 mm outside, largest", "SamplingErrorOutsideMaxMm", "mm"),
    ("sampling error inside in programs that interpolate linearly, largest", "LinearErrorMaxMm", "mm"),
    ("there and back inside, largest", "RoundTripMaxMm", "mm"),
    ("grid spacing", "GridSpacingMm", "mm"),
    ("grid memory", "GridMB", "MB"),
)
NO_GRID = dict.fromkeys(("Inverse", *(fact for _, fact, _ in ROWS)))


def write_transforms(case: CaseNodes, grids: Any) -> None:
    """Fill the three transform nodes for the last stage that is done; linear ones unless there are elastic grids."""
    record = case.record
    T_scene_ct = np.array(record["similarities"][record["stage"]])
    T_overlay_ct = np.array(record["T_overlay_scene"]) @ T_scene_ct
    forward, inverse, splat_to_ct = (ensure(case, role) for role in ("ct_to_scene", "scene_to_ct", "splat_to_ct_mm"))
    forward.SetAndObserveTransformNodeID(case.node("overlay_frame").GetID())
    splat_to_ct.SetMatrixTransformToParent(matrix_of(np.linalg.inv(T_scene_ct)))
    facts: dict[str, str | None] = dict(NO_GRID)
    if grids is None:  # SetMatrixTransformToParent would refuse a node that holds a composite
        there, back = linear(T_overlay_ct), linear(np.linalg.inv(T_overlay_ct))
        kind = PENDING if record["stage"] == "elastic" else SIMILARITY
    else:
        grid = grid_transform(displacement_image(grids.forward))
        there, kind = composite(grid, linear(T_overlay_ct)), ELASTIC
        found = best_inverse(case, there, grid, T_overlay_ct, grids.inverse)
        back = found.transform
        facts |= _grid_facts(grids.forward) | {"Inverse": found.kind, "RoundTripMaxMm": f"{found.round_trip_mm:.4g}"}
    facts |= {"Transform": kind, "ScaleRatio": f"{scale_of(T_overlay_ct):.6g}"}
    for node, transform in ((forward, there), (inverse, back)):
        node.SetAndObserveTransformToParent(transform)
        for name, value in facts.items():
            set_attribute(node, f"OrganPhys.{name}", value)


def move_transforms(case: CaseNodes) -> None:
    """Give both transforms the similarity of the case's record, which has changed, and keep their grids."""
    T_overlay_ct = np.array(case.record["T_overlay_scene"]) @ np.array(case.record["similarities"][case.stage])
    forward, inverse = case.node("ct_to_scene"), case.node("scene_to_ct")
    there, back, grid = linear(T_overlay_ct), linear(np.linalg.inv(T_overlay_ct)), grid_in(forward)
    if grid is not None:
        sampled = inverse.GetAttribute("OrganPhys.Inverse") == SAMPLED
        source = grid_in(inverse) if sampled else grid
        there = composite(like_grid(grid, grid.GetDisplacementGrid()), there)
        back = composite(back, like_grid(source, source.GetDisplacementGrid(), invert=not sampled))
    forward.SetAndObserveTransformToParent(there)
    inverse.SetAndObserveTransformToParent(back)


def transform_rows(case: CaseNodes) -> list[tuple[str, str, str]]:
    """Metric, value and unit of how well the elastic transforms stand for the mapping, for the metrics table."""
    read = case.node("scene_to_ct").GetAttribute
    values = [(name, read(f"OrganPhys.{fact}"), unit) for name, fact, unit in ROWS]
    return [(name, value, unit) for name, value, unit in values if value is not None]


def _grid_facts(grid: Any) -> dict[str, str | None]:
    """How exact and how large the grid is, as attributes that are saved with the nodes."""
    return {
        "SamplingErrorMaxMm": f"{grid.error_mm['max']:.4g}",
        "SamplingErrorP95Mm": f"{grid.error_mm['p95']:.4g}",
        "SamplingErrorOutsideMaxMm": f"{grid.error_outside_mm['max']:.4g}",
        "LinearErrorMaxMm": f"{grid.linear_error_mm['max']:.4g}",
        "GridSpacingMm": f"{float(np.max(grid.spacing)):.4g}",
        "GridMB": f"{np.asarray(grid.vectors).nbytes / MB:.3g}",
    }
