"""How sure the registered organ is, in a few numbers: median error radii of its seen, unseen and inner tissue."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..asset.registered_organ import RegisteredOrgan
from ..basis.error_radius import error_radius
from ..ground.checks import Array
from ..points.sampling import random_subset
from .stage_metrics import Metrics

SAMPLE = 1500  # points a region
PERCENT = (68, 95)


def confidence_metrics(organ: RegisteredOrgan, seen: NDArray[np.bool_]) -> Metrics:
    """{"error_68_visible": ..., "error_95_interior": ...} in mm; empty where the organ carries no uncertainty.

    seen (Nv,) bool: vertices that the splat shows.
    """
    if organ.uncertainty is None:
        return {}
    regions: dict[str, Array] = {
        "visible": organ.vertices[seen],
        "hidden": organ.vertices[~seen],
        "interior": organ.volume_points,
    }
    metrics: Metrics = {}
    for name, points in regions.items():
        if not len(points):
            continue
        covariance = organ.point_covariance.inside(points[random_subset(len(points), SAMPLE, 0)])
        for percent in PERCENT:
            radius = error_radius(covariance, percent / 100, freedom=organ.uncertainty.freedom)
            metrics[f"error_{percent}_{name}"] = {"value": float(np.median(radius)), "unit": "mm"}
    return metrics
