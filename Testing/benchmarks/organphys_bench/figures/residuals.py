"""Distances between the mapped organ surface and the splat, as in Table 2 of the OrganPhys paper."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from organphys.align.metrics import trimmed_mean
from organphys.ground.checks import Array

SURFACE_POINTS = 10_000
"""Boundary voxel centres used: the paper's tables have about as many."""


def residual_figures(surface_ct: Array, mapped: Array, target: Array, *, mm_per_unit: float) -> dict[str, float]:
    """Mean and trim30 both ways, in mm and in the paper's unit (largest absolute coordinate of the centred CT surface).

    surface_ct (N, 3) mm, the same points ``mapped`` (N, 3) and splat points ``target`` (M, 3) in scene units;
    ``mm_per_unit``: the true unit, so that a wrong registered scale does not flatter.
    """
    box_mm = float(np.abs(surface_ct - surface_ct.mean(0)).max())
    found = {}
    for way, distances in (
        ("ct_to_splat", cKDTree(target).query(mapped)[0]),
        ("splat_to_ct", cKDTree(mapped).query(target)[0]),
    ):
        for name, value in (("mean", float(distances.mean())), ("trim30", trimmed_mean(distances))):
            found[f"{name}_{way}_mm"] = value * mm_per_unit
            found[f"{name}_{way}_normalised"] = value * mm_per_unit / box_mm
    return found
