"""Where the seen organ ends because it was cut off, not because it turns away from the camera.

At an organ's own outline its surface turns away: the cosine between normal and ray falls towards the edge. Where the
splat was cropped, or the view ends, the surface reaches the edge as it faced the camera before; beyond such an edge
nothing is known.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from ..ground.checks import Array

Mask = NDArray[np.bool_]

FACING = 0.45  # median cosine at the edge above which the surface may be cut there
STEADY = 0.75  # cosine at the edge as a fraction of that further in; about 0.55 at true outlines, 1 at cuts
NEAR, INWARD = (1.0, 2.5), (8.0, 3.0)  # pixels: distance of a disc's centre from the edge and its radius
ALONG = 8.0  # pixels of edge to either side that decide together
WIDENING = 2.0  # beyond a cut the organ may turn outward by 60 degrees from its outline there
SHORTEST = 10  # pixels of edge; shorter stretches are noise


def beyond_cuts(outline: Mask, plane: Array, facing: Array, low: Array, pixel: float) -> Mask:
    """(W, H) bool: pixels of which nothing is known because the seen surface was cut off on their side.

    outline (W, H): boundary pixels of the mask with known-empty pixels beside them; plane (N, 2): image-plane places of
    the surface points, facing (N,): cosines of their normals towards the camera. The organ may widen beyond a cut,
    so only true outline that is clearly nearer than the cut vouches for an empty pixel.
    """
    cut = cut_edges(outline, plane, facing, low, pixel)
    if not cut.any():
        return cut
    true_outline = outline & ~cut
    if not true_outline.any():
        return np.ones_like(cut)
    to_cut, to_outline = (ndimage.distance_transform_edt(~edge) for edge in (cut, true_outline))
    beyond: Mask = to_cut < WIDENING * to_outline
    return beyond


def cut_edges(outline: Mask, plane: Array, facing: Array, low: Array, pixel: float) -> Mask:
    """(W, H) bool: pixels of the ``outline`` at which the surface was cut off; arguments as of ``beyond_cuts``."""
    index = np.argwhere(outline)
    cut = np.zeros_like(outline)
    if not len(index):
        return cut
    centres, tree = low + (index + 0.5) * pixel, cKDTree(plane)
    inward = _inward(tree, plane, centres, pixel)
    at_edge = _disc_median(tree, facing, centres + NEAR[0] * pixel * inward, NEAR[1] * pixel)
    further_in = _disc_median(tree, facing, centres + INWARD[0] * pixel * inward, INWARD[1] * pixel)
    beside = cKDTree(index).query_ball_point(index, ALONG)
    edge, steady = _median_of(at_edge, beside), _median_of(at_edge / further_in, beside)
    found = index[(edge > FACING) & (steady > STEADY)]
    cut[found[:, 0], found[:, 1]] = True
    return _long_stretches(cut)


def _inward(tree: cKDTree, plane: Array, centres: Array, pixel: float) -> Array:
    """Unit directions (K, 2) from edge places towards the surface points around them."""
    near = tree.query_ball_point(centres, 6 * pixel)
    towards = np.array([plane[k].mean(0) if len(k) else c for k, c in zip(near, centres, strict=True)]) - centres
    found: Array = towards / (np.linalg.norm(towards, axis=1, keepdims=True) + 1e-12)
    return found


def _disc_median(tree: cKDTree, values: Array, centres: Array, radius: float) -> Array:
    """Median value (K,) of the points within ``radius`` of each centre; nan where there are fewer than three."""
    return _median_of(values, tree.query_ball_point(centres, radius), fewest=3)


def _median_of(values: Array, groups: NDArray[np.object_], fewest: int = 1) -> Array:
    out = np.full(len(groups), np.nan)
    for k, group in enumerate(groups):
        known = values[group][np.isfinite(values[group])]
        if len(known) >= fewest:
            out[k] = np.median(known)
    return out


def _long_stretches(cut: Mask) -> Mask:
    label, count = ndimage.label(ndimage.binary_dilation(cut, np.ones((3, 3))))
    if not count:
        return cut
    length = np.bincount(label[cut], minlength=count + 1)
    kept: Mask = cut & (length >= SHORTEST)[label]
    return kept
