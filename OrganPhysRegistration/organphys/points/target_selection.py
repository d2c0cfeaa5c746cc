"""Which Gaussians of a splat are the target surface: opaque, finite, inside the box, and optionally cleaned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError
from ..ground.notices import Notice
from ..ground.progress import Progress, no_progress
from .neighbours import nearest_neighbours
from .point_sets import Box, GaussianCloud
from .sampling import random_subset


@dataclass(frozen=True)
class CleaningOptions:
    """Outliers: mean distance to ``neighbours`` above ``spread`` x the median, twice. Clusters: points linked within
    ``link`` x the median distance; those below ``smallest`` of all points go (parts behind a tool strip stay).
    Of more than ``most`` points a random subset is judged, and the others go with it."""

    neighbours: int = 12
    spread: float = 2.5
    rounds: int = 2
    link: float = 1.8
    smallest: float = 0.01
    most: int = 40_000


@dataclass(frozen=True)
class Cleaning:
    """What a cleaning left: ``keep`` (N,) bool over the points given, how many each step removed, and ``spacing``, the
    median neighbour distance of what the outlier step left (unit of the points)."""

    keep: NDArray[np.bool_]
    outliers: int
    in_small_clusters: int
    spacing: float = 0.0

    @property
    def notice(self) -> Notice:
        text = f"Removed {self.outliers} outliers and {self.in_small_clusters} points in small clusters from the splat"
        return Notice("splat_cleaned", f"{text} ({int(self.keep.sum())} of {len(self.keep)} left).")


def select_target(cloud: GaussianCloud, *, opacity: float = 0.1, box: Box | None = None) -> NDArray[np.bool_]:
    """(N,) bool: finite Gaussians above the opacity threshold (the paper's 0.1) and inside the box.

    InputError: none above the threshold, or none of them in the box.
    """
    if not 0 <= opacity < 1:
        raise InputError(f"opacity threshold: expected 0 to 1, got {opacity}")
    selected: NDArray[np.bool_] = cloud.valid & (cloud.opacities > opacity)
    if not selected.any():
        highest = float(cloud.opacities[cloud.valid].max()) if cloud.valid.any() else 0.0
        raise InputError(
            f"splat: no Gaussian above the opacity threshold {opacity:g} (the highest is {highest:.3g}); lower it"
        )
    if box is not None:
        rows = np.flatnonzero(selected)
        inside = rows[box.contains(cloud.centres[rows].astype(np.float64))]
        if len(inside) == 0:
            raise InputError(
                "region of interest: holds no opaque Gaussian; check its centre, size and axes (scene units)"
            )
        selected = np.zeros(len(cloud), dtype=bool)
        selected[inside] = True
    return selected


def select_clean_target(
    cloud: GaussianCloud,
    *,
    opacity: float = 0.1,
    box: Box | None = None,
    options: CleaningOptions | None = None,
    progress: Progress = no_progress,
) -> tuple[NDArray[np.bool_], Cleaning]:
    """As select_target, without outliers and small clusters: (N,) bool and the report over the points selected."""
    selected = select_target(cloud, opacity=opacity, box=box)
    rows = np.flatnonzero(selected)
    report = clean_points(cloud.centres[rows].astype(np.float64), options=options, progress=progress)
    selected[rows[~report.keep]] = False
    return selected, report


def clean_points(
    points: Array, *, options: CleaningOptions | None = None, progress: Progress = no_progress
) -> Cleaning:
    """Marks statistical outliers and small clusters among points (N, 3); nothing is moved or reordered.

    Clusters are judged by their share of all points, so several true pieces survive. In a large set a point stays
    when one of the judged subset that stayed lies within the linking distance.
    """
    options = options or CleaningOptions()
    if len(points) > options.most:
        return _clean_by_subset(points, options, progress)
    keep = np.ones(len(points), dtype=bool)
    if len(points) <= options.neighbours + 1:
        return Cleaning(keep, 0, 0)
    for k in range(options.rounds):
        progress("clean splat", k / (options.rounds + 2))
        rows = np.flatnonzero(keep)
        spacing = mean_distance(points[rows], options.neighbours)
        keep[rows[spacing > options.spread * np.median(spacing)]] = False
    outliers = len(points) - int(keep.sum())
    progress("clean splat", options.rounds / (options.rounds + 2))
    rows = np.flatnonzero(keep)
    median = float(np.median(mean_distance(points[rows], options.neighbours)))
    cluster = _clusters(points[rows], options.link * median)
    small = np.bincount(cluster)[cluster] < options.smallest * len(rows)
    keep[rows[small]] = False
    progress("clean splat", 1.0)
    return Cleaning(keep, outliers, int(small.sum()), median)


def _clean_by_subset(points: Array, options: CleaningOptions, progress: Progress) -> Cleaning:
    rows = random_subset(len(points), options.most, 0)
    judged = clean_points(points[rows], options=options, progress=progress)
    share = len(points) / len(rows)
    if not judged.keep.any():
        return Cleaning(np.zeros(len(points), dtype=bool), len(points), 0, judged.spacing)
    near = nearest_neighbours(
        cKDTree(points[rows[judged.keep]]), points, distance_upper_bound=options.link * judged.spacing
    )[0]
    keep: NDArray[np.bool_] = np.isfinite(near)
    gone = len(points) - int(keep.sum())
    in_small_clusters = min(round(judged.in_small_clusters * share), gone)
    return Cleaning(keep, gone - in_small_clusters, in_small_clusters, judged.spacing / np.sqrt(share))


def mean_distance(points: Array, neighbours: int) -> Array:
    """Mean distance (N,) of each point to its nearest neighbours, itself left out."""
    count = min(neighbours, len(points) - 1)
    distance: Array = nearest_neighbours(cKDTree(points), points, k=count + 1)[0][:, 1:].mean(axis=1)
    return distance


def _clusters(points: Array, reach: float) -> NDArray[np.int64]:
    """Cluster number (N,) of points linked within ``reach``."""
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    links = coo_array((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    labels: NDArray[np.int64] = connected_components(links, directed=False)[1]
    return labels
