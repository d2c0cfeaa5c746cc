"""Where the seen organ ends because it was cut off, not because it turns away from the camera.

At an organ's own outline its surface turns away: the cosine between normal and ray falls towards the edge. Where the
splat was cropped, or the view ends, the surface reaches the edge as it faced the camera before; beyond such an edge
nothing is known.
"""

from __future__ import annotations

from dataclasses import dataclass

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
# Squared cosine at the edge, from a line fitted further in: 0.1 in the median at true outlines, 0.5 at cuts
LIKELY, POSSIBLE = 0.3, 0.15
STRIP = (4.0, 6.0)  # pixels: as INWARD, of the disc to which the line is fitted
THINNED = 2  # of so many pixels, one gets a line: those beside it decide with it anyway


def beyond_cuts(outline: Mask, cut: Mask) -> Mask:
    """(W, H) bool: pixels of which nothing is known because the seen surface was cut off on their side.

    The organ may widen beyond a cut, so only true outline that is clearly nearer than the ``cut`` vouches for an empty
    pixel.
    """
    if not cut.any():
        return cut
    true_outline = outline & ~cut
    if not true_outline.any():
        return np.ones_like(cut)
    to_cut, to_outline = (ndimage.distance_transform_edt(~edge) for edge in (cut, true_outline))
    beyond: Mask = to_cut < WIDENING * to_outline
    return beyond


@dataclass(frozen=True)
class Edge:
    """Edge of the seen surface: boundary pixels (K, 2) of a mask of ``shape`` (W, H) with known-empty pixels beside
    them, their ``centres`` and unit directions ``inward`` (K, 2) on the image plane; ``places``: tree of the surface
    points (N, 2) there; ``facing`` (N,): cosines of their normals towards the camera; ``pixel``: size of one."""

    pixels: NDArray[np.int64]
    shape: tuple[int, ...]
    centres: Array
    inward: Array
    places: cKDTree
    facing: Array
    pixel: float

    @classmethod
    def of(cls, outline: Mask, places: cKDTree, facing: Array, low: Array, pixel: float) -> Edge:
        """Edge along the pixels of the ``outline`` (W, H), of which there must be some; ``low``: where the image
        begins on its plane."""
        pixels = np.argwhere(outline)
        centres = low + (pixels + 0.5) * pixel
        near = PointGroups.within(places, centres, 6 * pixel)
        towards = np.where(near.sizes[:, None] > 0, near.mean(places.data) - centres, 0.0)
        inward = towards / (np.linalg.norm(towards, axis=1, keepdims=True) + 1e-12)
        return cls(pixels, outline.shape, centres, inward, places, facing, pixel)

    def cut(self) -> Mask:
        """(W, H) bool: pixels of the edge at which the surface surely was cut off."""
        at_edge, further_in = (
            PointGroups.within(self.places, self._inside(away), radius * self.pixel).median(self.facing, fewest=3)
            for away, radius in (NEAR, INWARD)
        )
        beside = self._beside()
        edge, steady = beside.median(at_edge), beside.median(at_edge / further_in)
        return _long_stretches(self._mask((edge > FACING) & (steady > STEADY)))

    def doubtful(self, cut: Mask) -> Mask:
        """(W, H) bool: pixels of the edge at which the surface may have been cut off; ``cut``: where it surely was.

        The squared cosine of a smooth surface falls to 0 in proportion to the distance from its outline (the depth is
        a square root there). Edges at which it clearly does not, and the edge on from them for as long as that is not
        sure (hysteresis; Canny, PAMI 1986): the ends of a cut look like outlines, and a few of them taken for true rim
        make the organ too small.
        """
        some = np.arange(0, len(self.pixels), THINNED)
        near = PointGroups.within(self.places, self._inside(STRIP[0])[some], STRIP[1] * self.pixel)
        offset, inward = self.places.data[near.member] - self.centres[some][near.place], self.inward[some][near.place]
        depth = np.einsum("ij,ij->i", offset, inward) / self.pixel
        squared = self._beside(some).median(near.line_at_zero(depth, self.facing * np.abs(self.facing)))
        likely, possible = (cut | self._mask(squared > limit) for limit in (LIKELY, POSSIBLE))
        found: Mask = ndimage.binary_propagation(likely, np.ones((3, 3)), mask=possible)
        return found

    def _inside(self, away: float) -> Array:
        """Places (K, 2) so many pixels inward of the edge."""
        return self.centres + away * self.pixel * self.inward

    def _beside(self, some: slice | NDArray[np.int64] = slice(None)) -> PointGroups:
        """The pixels, or ``some`` of them, that decide together with each."""
        return PointGroups.within(cKDTree(self.pixels[some]), self.pixels.astype(np.float64), ALONG)

    def _mask(self, found: NDArray[np.bool_]) -> Mask:
        mask = np.zeros(self.shape, dtype=np.bool_)
        mask[tuple(self.pixels[found].T)] = True
        return mask


def _long_stretches(cut: Mask) -> Mask:
    label, count = ndimage.label(ndimage.binary_dilation(cut, np.ones((3, 3))))
    if not count:
        return cut
    length = np.bincount(label[cut], minlength=count + 1)
    kept: Mask = cut & (length >= SHORTEST)[label]
    return kept
