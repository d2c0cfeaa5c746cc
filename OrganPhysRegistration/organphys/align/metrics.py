"""How far two point sets are apart: mean and trimmed means of nearest-neighbour distances, and strains.

"trim30" discards the worst 30 percent of the distances and averages the rest (the paper, Table 2 and Figure 8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError
from ..points.neighbours import nearest_neighbours

TRIM = 0.3


@dataclass(frozen=True)
class SurfaceDistances:
    """Nearest-neighbour distances between mapped CT surface and splat, in both directions.

    ``*_mm``: millimetres; ``*_normalised``: the CT surface scaled to a unit box by its largest absolute coordinate
    about the centroid, as in the paper's Table 2.
    """

    mean_ct_to_splat_mm: float
    trim30_ct_to_splat_mm: float
    mean_splat_to_ct_mm: float
    trim30_splat_to_ct_mm: float
    mean_ct_to_splat_normalised: float
    trim30_ct_to_splat_normalised: float
    trim30_splat_to_ct_normalised: float

    def as_metrics(self) -> dict[str, dict[str, float | str]]:
        """{name: {"value", "unit"}} as it goes into registration.json; names without the unit's suffix for mm."""
        out: dict[str, dict[str, float | str]] = {}
        for name, value in vars(self).items():
            normalised = name.endswith("_normalised")
            out[name if normalised else name.removesuffix("_mm")] = {
                "value": float(value),
                "unit": "CT unit box" if normalised else "mm",
            }
        return out


def surface_distances(
    surface_scene: Array,
    target: Array,
    *,
    mm_per_unit: float,
    box_mm: float,
    target_tree: cKDTree | None = None,
    to_splat: Array | None = None,
) -> SurfaceDistances:
    """Distances of CT surface points mapped to the scene (N, 3) and the splat's target points (M, 3), both ways.

    ``mm_per_unit``: millimetres per scene unit; ``box_mm``: length of the CT's normalisation (its largest absolute
    coordinate, mm); ``target_tree``: a k-d tree of ``target``, ``to_splat`` (K,): distances of
    surface points, or of a sample of them, to it in scene units, if there are some already.
    """
    if not len(surface_scene) or not len(target):
        raise InputError("distances: both point sets must hold at least one point")
    tree = cKDTree(target) if target_tree is None else target_tree
    to_splat = (nearest_neighbours(tree, surface_scene)[0] if to_splat is None else to_splat) * mm_per_unit
    to_ct = cKDTree(surface_scene).query(target)[0] * mm_per_unit
    ct_mean, ct_trim, splat_trim = float(to_splat.mean()), trimmed_mean(to_splat), trimmed_mean(to_ct)
    return SurfaceDistances(
        mean_ct_to_splat_mm=ct_mean,
        trim30_ct_to_splat_mm=ct_trim,
        mean_splat_to_ct_mm=float(to_ct.mean()),
        trim30_splat_to_ct_mm=splat_trim,
        mean_ct_to_splat_normalised=ct_mean / box_mm,
        trim30_ct_to_splat_normalised=ct_trim / box_mm,
        trim30_splat_to_ct_normalised=splat_trim / box_mm,
    )


def trimmed_mean(distances: Array, discard: float = TRIM) -> float:
    """Mean of the distances (N,) without the largest fraction ``discard``; at least one is kept."""
    keep = max(1, round(len(distances) * (1 - discard)))
    return float(np.partition(distances, keep - 1)[:keep].mean())


def trimmed_means(distances: Array, discard: float = TRIM) -> Array:
    """``trimmed_mean`` of every row of distances (K, N): (K,)."""
    keep = max(1, round(distances.shape[1] * (1 - discard)))
    return np.asarray(np.partition(distances, keep - 1, axis=1)[:, :keep].mean(1), dtype=np.float64)


def volume_drift_percent(deformation_gradients: Array, weights: Array | None = None) -> float:
    """100 (mean det F - 1) over points with deformation gradients (Q, 3, 3); ``weights`` (Q,) volumes, else equal."""
    return 100.0 * float(np.average(np.linalg.det(deformation_gradients), weights=weights) - 1)


def strain_percentiles(deformation_gradients: Array, percentiles: tuple[float, ...] = (5, 50, 95)) -> dict[str, Array]:
    """Percentiles (P,) of the largest and the smallest principal stretch (singular values of F, 1 = unstrained)."""
    stretches = np.linalg.svd(deformation_gradients, compute_uv=False)
    return {
        "largest_stretch": np.percentile(stretches[:, 0], percentiles),
        "smallest_stretch": np.percentile(stretches[:, 2], percentiles),
    }
