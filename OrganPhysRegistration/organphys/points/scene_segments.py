"""A cluttered scene divided into pieces of one tissue: alike in colour, and connected without a step in depth.

Shading changes brightness more than hue, so colours are compared by chromaticity, rgb / (r + g + b).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..ground.checks import Array
from .neighbours import nearest_neighbours
from .sampling import random_subset

Members = NDArray[np.bool_]


@dataclass(frozen=True)
class SegmentOptions:
    """``most`` points are judged, the others follow; ``neighbours`` share their colour; chromaticities in groups whose
    means lie ``apart``; points within ``link`` x the median spacing are connected if the way between them does not
    lead ``steep`` of its length along the view; segments hold at least ``smallest`` of the points."""

    most: int = 15_000
    neighbours: int = 20
    apart: float = 0.05
    link: float = 2.5
    steep: float = 0.85
    smallest: float = 0.04


def scene_segments(
    points: Array, colours: NDArray[np.floating], viewpoint: Array, options: SegmentOptions | None = None
) -> list[Members]:
    """Segments of points (N, 3) with colours (N, 3) in 0..1, seen from ``viewpoint`` (3,): (N,) bool each, largest
    first. Connected pieces, then for every colour that has several the union of them; all points where one is left.
    """
    options = options or SegmentOptions()
    rows = random_subset(len(points), options.most, 0)
    judged = points[rows].astype(np.float64)
    if len(judged) <= options.neighbours:
        return [np.ones(len(points), dtype=bool)]
    tree = cKDTree(judged)
    distance, near = nearest_neighbours(tree, judged, k=options.neighbours)
    colour = _colour_groups(chromaticity(colours[rows])[near].mean(1), options.apart)
    colour = _majority(colour[near])
    piece = _pieces(judged, colour, options.link * float(np.median(distance[:, 6])), viewpoint, options.steep)
    least = options.smallest * len(rows)
    large = [k for k in np.argsort(-np.bincount(piece)) if (piece == k).sum() >= least]
    if len(large) == 1:  # the usual case: nobody has to ask to which piece each of a million points belongs
        return [np.ones(len(points), dtype=bool)]
    nearest = nearest_neighbours(tree, points.astype(np.float64))[1]
    segments = [(piece == k)[nearest] for k in large]
    hue = [int(colour[piece == k][0]) for k in large]
    for group in sorted(set(hue)):
        if hue.count(group) > 1:
            segments.append(np.any([s for s, h in zip(segments[: len(hue)], hue, strict=True) if h == group], axis=0))
    return segments


def chromaticity(colours: NDArray[np.floating]) -> Array:
    """Shares (N, 2) of red and green in the brightness of colours (N, 3)."""
    rgb = np.clip(np.asarray(colours, dtype=np.float64), 0.0, 1.0) + 0.02  # black has no hue
    found: Array = (rgb / rgb.sum(1, keepdims=True))[:, :2]
    return found


def _colour_groups(chroma: Array, apart: float) -> NDArray[np.int64]:
    """Group (N,) of each chromaticity (N, 2): average linkage of a sample, then the nearest group's mean."""
    sample = chroma[random_subset(len(chroma), 800, 0)]
    label = fcluster(linkage(sample, "average"), apart, criterion="distance")
    count = np.bincount(label)
    means = np.stack([sample[label == k].mean(0) for k in np.flatnonzero(count >= 0.02 * len(sample))])
    return cKDTree(means).query(chroma)[1].astype(np.int64)


def _majority(votes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Most frequent value (N,) of every row (N, K)."""
    count = np.stack([(votes == k).sum(1) for k in range(int(votes.max()) + 1)])
    return count.argmax(0).astype(np.int64)


def _pieces(
    points: Array, colour: NDArray[np.int64], reach: float, viewpoint: Array, steep: float
) -> NDArray[np.int64]:
    """Number (N,) of the connected piece of one colour that each point belongs to."""
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    first, second = points[pairs[:, 0]], points[pairs[:, 1]]
    way, ray = second - first, (first + second) / 2 - viewpoint
    lengths = np.linalg.norm(way, axis=1) * np.linalg.norm(ray, axis=1) + 1e-300
    along = np.abs(np.einsum("ij,ij->i", way, ray)) / lengths
    pairs = pairs[(along < steep) & (colour[pairs[:, 0]] == colour[pairs[:, 1]])]
    links = coo_array((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    labels: NDArray[np.int64] = connected_components(links, directed=False)[1]
    return labels
