"""The organ's true rim in the reference image: where the seen surface turns away against known-empty background."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..points.point_groups import PointGroups
from ..points.sampling import random_subset
from .camera_image import CameraImage
from .splat_surface import SplatSurface

ALIGNED = 0.7  # cosine between rim and surface; 0.8 and more along true outlines of seven dev cases


@dataclass(frozen=True)
class Rim:
    """Rim points (K, 2) on the image plane at z = 1 and their outward unit normals (K, 2), to sub-pixel accuracy."""

    points: Array
    normals: Array


def find_rim(surface: SplatSurface, image: CameraImage, *, shift_pixels: float = 0.25, most: int = 400) -> Rim:
    """Outermost splat points beside every true rim pixel, moved outward by ``shift_pixels``.

    Splat centres stop short of the rim (a Gaussian on it would stick out), hence the shift: the true outlines of seven
    dev cases lie 0.2 pixels beyond the outermost centres in the median (-0.1 to 0.3 by case); shifts of 0.2 to 0.35
    register equally well there, but 0.35 blows a rigid copy up by 1.6 %.
    """
    pixels = np.argwhere(image.rim_pixels)
    pixels = pixels[random_subset(len(pixels), most, 0)]
    if not len(pixels):
        return Rim(np.zeros((0, 2)), np.zeros((0, 2)))
    outward = _outward_normals(image, pixels)
    centres = image.centre(pixels)
    reach, kept = _outermost(surface, centres, outward, image.pixel)
    kept &= _turns_away(surface, centres, outward, image.pixel)
    shifted = centres + (reach + shift_pixels * image.pixel)[:, None] * outward
    return Rim(shifted[kept], outward[kept])


def _outward_normals(image: CameraImage, pixels: NDArray[np.int64], sigma: float = 3.0) -> Array:
    """Unit normals (K, 2) of the mask at its boundary ``pixels`` (K, 2), from what is known alone.

    A plane is fitted to the mask around each pixel with Gaussian weights (first-order normalised convolution; Knutsson
    and Westin, CVPR 1993), unknown pixels weigh nothing: a plain smoothing would turn the rim towards the cut it ends
    at. Where all is known, this is the smoothed mask's gradient.
    """
    reach = int(3 * sigma)
    offset = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, indexing="ij"), -1).reshape(-1, 2)
    i, j = (pixels[:, None] + offset + reach).transpose(2, 0, 1)
    weight = np.pad(~image.unknown, reach)[i, j] * np.exp(-(offset**2).sum(1) / (2 * sigma**2))
    plane = np.column_stack([np.ones(len(offset)), offset])
    products = (weight @ (plane[:, :, None] * plane[:, None]).reshape(-1, 9)).reshape(-1, 3, 3)
    fitted = np.linalg.solve(products, ((weight * np.pad(image.mask, reach)[i, j]) @ plane)[..., None])
    slope = fitted[:, 1:, 0]
    outward: Array = -slope / (np.linalg.norm(slope, axis=1, keepdims=True) + 1e-12)
    return outward


def _turns_away(surface: SplatSurface, centres: Array, outward: Array, pixel: float) -> NDArray[np.bool_]:
    """(K,) whether the surface beside each rim place turns away in the rim's own direction.

    At an organ's outline the normal lies across the ray, along the outline's (Koenderink, Perception 13, 1984); where
    the two differ the mask ends for another reason, such as the corner of a cut.
    """
    unit = surface.points / np.linalg.norm(surface.points, axis=1, keepdims=True)
    across = (surface.normals - np.einsum("ij,ij->i", surface.normals, unit)[:, None] * unit)[:, :2]
    mean = PointGroups.within(surface.plane_tree, centres - 2 * pixel * outward, 3 * pixel).mean(across)
    found: NDArray[np.bool_] = np.einsum("ij,ij->i", mean, outward) > ALIGNED * np.linalg.norm(mean, axis=1)
    return found


def _outermost(surface: SplatSurface, centres: Array, outward: Array, pixel: float) -> tuple[Array, NDArray[np.bool_]]:
    """Mean reach along ``outward`` of the two outermost points near each centre, and which centres have them."""
    near = PointGroups.within(surface.plane_tree, centres + 0.5 * pixel * outward, 2.2 * pixel)
    offset, normal = surface.plane[near.member] - centres[near.place], outward[near.place]
    aside = normal[:, 0] * offset[:, 1] - normal[:, 1] * offset[:, 0]
    close = np.abs(aside) < 1.3 * pixel
    beside = near.where(close)
    along, begin = beside.ranked(np.einsum("ij,ij->i", offset, normal)[close])
    reach, kept = np.zeros(len(centres)), (near.sizes >= 3) & (beside.sizes >= 2)
    last = begin[1:][kept]
    reach[kept] = (along[last - 2] + along[last - 1]) / 2
    return reach, kept
