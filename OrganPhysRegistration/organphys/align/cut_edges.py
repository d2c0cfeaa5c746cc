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
from ..points.point_groups import PointGroups

Mask = NDArray[np.bool_]

FACING = 0.45  # median cosine at the edge above which the surface may be cut there
STEADY = 0.75  # cosine at the edge as a fraction of that further in; about 0.55 at true outlines, 1 at cuts
NEAR, INWARD = (1.0, 2.5), (8.0, 3.0)  # pixels: distance of a disc's centre from the edge and its radius
ALONG = 8.0  # pixels of edge to either side that decide together
WIDENING = 2.0  # beyond a cut the organ may turn outward by 60 degrees from its outline there
SHORTEST = 10  # pixels of edge; shorter stretches are noise


def beyond_cuts(outline: Mask, places: cKDTree, facing: Array, low: Array, pixel: float) -> Mask:
    """(W, H) bool: pixels of which nothing is known because the seen surface was cut off on their side.

    outline (W, H): boundary pixels of the mask with known-empty pixels beside them; places: tree of the surface points
    (N, 2) on the image plane, facing (N,): cosines of their normals towards the camera. The organ may widen beyond a
    cut, so only true outline that is clearly nearer than the cut vouches for an empty pixel.
    """
    cut = cut_edges(outline, places, facing, low, pixel)
    if not cut.any():
        return cut
    true_outline = outline & ~cut
    if not true_outline.any():
        return np.ones_like(cut)
    to_cut, to_outline = (ndimage.distance_transform_edt(~edge) for edge in (cut, true_outline))
    beyond: Mask = to_cut < WIDENING * to_outline
    return beyond


def cut_edges(outline: Mask, places: cKDTree, facing: Array, low: Array, pixel: float) -> Mask:
    """(W, H) bool: pixels of the ``outline`` at which the surface was cut off; arguments as of ``beyond_cuts``."""
    index = np.argwhere(outline)
    cut = np.zeros_like(outline)
    if not len(index):
        return cut
    centres = low + (index + 0.5) * pixel
    inward = _inward(places, centres, pixel)
    at_edge, further_in = (
        PointGroups.within(places, centres + away * pixel * inward, radius * pixel).median(facing, fewest=3)
        for away, radius in (NEAR, INWARD)
    )
    beside = PointGroups.within(cKDTree(index), index.astype(np.float64), ALONG)
    edge, steady = beside.median(at_edge), beside.median(at_edge / further_in)
    found = index[(edge > FACING) & (steady > STEADY)]
    cut[found[:, 0], found[:, 1]] = True
    return _long_stretches(cut)


def _inward(places: cKDTree, centres: Array, pixel: float) -> Array:
    """Unit directions (K, 2) from edge places towards the surface points around them."""
    near = PointGroups.within(places, centres, 6 * pixel)
    towards = np.where(near.sizes[:, None] > 0, near.mean(places.data) - centres, 0.0)
    found: Array = towards / (np.linalg.norm(towards, axis=1, keepdims=True) + 1e-12)
    return found


def _long_stretches(cut: Mask) -> Mask:
    label, count = ndimage.label(ndimage.binary_dilation(cut, np.ones((3, 3))))
    if not count:
        return cut
    length = np.bincount(label[cut], minlength=count + 1)
    kept: Mask = cut & (length >= SHORTEST)[label]
    return kept
