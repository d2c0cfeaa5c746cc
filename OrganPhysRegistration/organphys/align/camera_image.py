"""What the reference camera saw of the organ: where its surface is, where it surely is not, and where nobody knows.

A pinhole image about 110 pixels across, camera at the origin looking along +z. Silhouette and free space are
as strong a cue as the surface itself: no organ tissue may lie before the seen surface or in known-empty pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..ground.checks import Array
from .cut_edges import Edge, beyond_cuts
from .splat_surface import SplatSurface

Mask = NDArray[np.bool_]

UNSEEN = 0.8  # cost of organ tissue that faces the camera where nothing is known, or huge organs hide outside the view
BEYOND_CUT = 0.3  # the same beyond a cut edge, where tissue is expected: a little more than where an organ fits
OFF_CUT = 6  # pixels from what lies beyond a cut within which an outline may belong to the cut
OFF_DOUBT = 8  # pixels from where the surface may have been cut within which no outline counts as true rim
OFF_EDGE = 1e-6  # pixels between the outermost points and the edge of theirs: on it, rounding would choose the pixel


@dataclass(frozen=True)
class CameraImageOptions:
    """Pixels across the organ; margin and closing as fractions of it; depth margin in splat radii."""

    pixels: int = 110
    margin: float = 0.6
    closing: float = 0.12
    behind: float = 0.15
    smallest_part: float = 0.01
    fov_quantile: float = 0.999


@dataclass(frozen=True)
class CameraImage:
    """Images of shape (W, H), first axis x. ``pixel`` and ``low`` are in units of the image plane at z = 1.

    mask: organ seen; unknown: nothing can be said (tool, hole, outside the view, behind another organ, beyond a cut);
    neither: known empty; beyond: of the unknown, what lies beyond a cut; rim_pixels: boundary pixels of the mask that
    are the organ's true rim, clear of the unknown, and more so of what was or may have been cut. front (W, H): index of
    the nearest splat point; nearest (2, W, H): nearest mask pixel; gap (W, H): distance to it in image-plane units.
    """

    mask: Mask
    unknown: Mask
    beyond: Mask
    rim_pixels: Mask
    front: NDArray[np.int32]
    nearest: NDArray[np.int32]
    gap: NDArray[np.float32]
    pixel: float
    low: Array

    @cached_property
    def unseen_cost(self) -> NDArray[np.float32]:
        """Cost (W, H), 0 to 1, of tissue that faces the camera in an unknown pixel."""
        return np.where(self.beyond, BEYOND_CUT, UNSEEN).astype(np.float32)

    def index(self, plane: Array) -> NDArray[np.int64]:
        """Pixel indices (..., 2) of image-plane coordinates (..., 2); may lie outside the image."""
        return np.floor((plane - self.low) / self.pixel).astype(np.int64)

    def unseen_cost_at(self, points: Array) -> Array:
        """Cost (N,) of organ tissue at camera-frame points (N, 3) if it faces the camera where nothing is known."""
        index = self.index(points[:, :2] / np.maximum(points[:, 2:], 1e-9))
        i, j = np.clip(index, 0, np.array(self.mask.shape) - 1).T
        return self.unseen_cost[i, j].astype(np.float64)

    def centre(self, index: NDArray[np.integer]) -> Array:
        """Image-plane coordinates (..., 2) of pixel centres."""
        return self.low + (index + 0.5) * self.pixel


def camera_image(
    surface: SplatSurface, others: Array, *, fov_deg: float | None = None, options: CameraImageOptions | None = None
) -> CameraImage:
    """Image of the seen organ. ``others`` (K, 3): opaque points that are not the organ's (camera frame)."""
    options = options or CameraImageOptions()
    plane = surface.plane
    pixel = max(
        float(np.ptp(plane, axis=0).max()) / options.pixels,
        1.3 * surface.spacing / float(np.median(surface.points[:, 2])),
    )
    margin = int(options.margin * options.pixels)
    low = plane.min(0) - (margin + OFF_EDGE) * pixel
    width, height = (int(n) for n in np.ceil(np.ptp(plane, axis=0) / pixel).astype(int) + 2 * margin + 1)
    index = np.floor((plane - low) / pixel).astype(np.int64)
    distance = np.linalg.norm(surface.points, axis=1)
    front = _frontmost(index, distance, (width, height))
    mask = _without_small_parts(ndimage.binary_closing(front >= 0, iterations=2), options.smallest_part)
    unknown = _closed(mask, round(options.closing * options.pixels)) & ~mask
    centres = low + (np.stack(np.meshgrid(np.arange(width), np.arange(height), indexing="ij"), -1) + 0.5) * pixel
    seen = np.concatenate([surface.points, others[others[:, 2] > 0]])
    unknown |= np.arctan(np.linalg.norm(centres, axis=2)) > _half_angle(seen, fov_deg, options) - 1.5 * pixel
    gap, nearest = ndimage.distance_transform_edt(~mask, return_indices=True)
    filled = front[tuple(ndimage.distance_transform_edt(front < 0, return_distances=False, return_indices=True))]
    if len(others):
        organ_distance = np.where(front >= 0, distance[front], np.inf)[tuple(nearest)]
        occluder = _nearest_distance(others, low, pixel, (width, height))
        unknown |= ~mask & (occluder < organ_distance + options.behind * surface.radius)
    facing = -np.einsum("ij,ij->i", surface.normals, surface.points) / distance
    cut = doubtful = edges = outline(mask, unknown)
    if edges.any():
        edge = Edge.of(edges, surface.plane_tree, facing, low, pixel)
        cut = edge.cut()
        doubtful = edge.doubtful(cut)
    beyond = ~mask & beyond_cuts(edges, cut)
    return CameraImage(
        mask=mask,
        unknown=unknown | beyond,
        beyond=beyond,
        rim_pixels=_clear_of(_clear_of(outline(mask, unknown | beyond), beyond, OFF_CUT), doubtful, OFF_DOUBT),
        front=filled.astype(np.int32),
        nearest=nearest.astype(np.int32),
        gap=(gap * pixel).astype(np.float32),
        pixel=pixel,
        low=low,
    )


def outline(mask: Mask, unknown: Mask) -> Mask:
    """Boundary pixels of the mask more than three pixels from the unknown."""
    boundary = mask & ~ndimage.binary_erosion(mask)
    return boundary & ~ndimage.binary_dilation(unknown, iterations=3)


def _clear_of(pixels: Mask, others: Mask, away: float) -> Mask:
    """The ``pixels`` that lie more than ``away`` pixels from all ``others``."""
    return pixels & (ndimage.distance_transform_edt(~others) > away) if others.any() else pixels


def _frontmost(index: NDArray[np.int64], distance: Array, shape: tuple[int, int]) -> NDArray[np.int64]:
    """Index of the nearest point per pixel, -1 where there is none."""
    front = np.full(shape, -1, dtype=np.int64)
    far_to_near = np.argsort(-distance, kind="stable")
    front[index[far_to_near, 0], index[far_to_near, 1]] = far_to_near  # the last write, the nearest, stays
    return front


def _without_small_parts(mask: Mask, fraction: float) -> Mask:
    label, count = ndimage.label(mask)
    if count <= 1:
        return mask
    size = np.bincount(label.ravel())
    size[0] = 0
    return (size >= fraction * size.sum())[label]


def _closed(mask: Mask, radius: int) -> Mask:
    """Closing by a disc of ``radius`` pixels, holes filled."""
    dilated = ndimage.distance_transform_edt(~mask) <= radius
    return ndimage.binary_fill_holes((ndimage.distance_transform_edt(dilated) > radius) | mask)


def _half_angle(points: Array, fov_deg: float | None, options: CameraImageOptions) -> float:
    """Half of the field of view in radians; without a given one, the cone that holds nearly all points."""
    if fov_deg is not None:
        return float(np.radians(fov_deg / 2))
    angles = np.arctan2(np.linalg.norm(points[:, :2], axis=1), points[:, 2])
    return float(np.quantile(angles, options.fov_quantile))


def _nearest_distance(points: Array, low: Array, pixel: float, shape: tuple[int, int]) -> Array:
    """Distance of the nearest point per pixel and its eight neighbours, inf where there is none."""
    points = points[points[:, 2] > 0]
    index = np.floor((points[:, :2] / points[:, 2:] - low) / pixel).astype(np.int64)
    inside = ((index >= 0) & (index < shape)).all(1)
    image = np.full(shape, np.inf)
    np.minimum.at(image, tuple(index[inside].T), np.linalg.norm(points[inside], axis=1))
    return ndimage.minimum_filter(image, 3)
