"""Overlay pictures: the splat in its own colours, the organ surface as a blue glaze with an outline."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from ..ground.checks import Array
from .camera_view import View
from .rasteriser import Fragments, Reals, draw_dots, draw_triangles

SUPERSAMPLING = 2
BACKGROUND = np.array([0.075, 0.085, 0.10], dtype=np.float32)
ORGAN_BLUE = np.array([0.26, 0.55, 1.0], dtype=np.float32)
OUTLINE = np.array([0.62, 0.80, 1.0], dtype=np.float32)
GLAZE_FRONT, GLAZE_BEHIND, GLAZE_ALONE = 0.42, 0.16, 0.62  # opacity of the organ before, behind, beside the splat


@dataclass(frozen=True)
class SplatLayer:
    """Splat drawn once per view, for all organ layers over it; centres (N, 3), colours (N, 3) in 0..1."""

    view: View
    centres: Array
    colours: Array
    radius: float

    @cached_property
    def fragments(self) -> Fragments:
        return draw_dots(self.view.scaled(SUPERSAMPLING), self.centres, self.radius)

    @cached_property
    def image(self) -> Reals:
        """(h, w, 3) in 0..1 at the supersampled size."""
        image = np.broadcast_to(BACKGROUND, (*self.fragments.depth.shape, 3)).astype(np.float32)
        seen = self.fragments.covered
        image[seen] = self.colours.astype(np.float32)[self.fragments.index[seen]]
        return image


def splat_picture(layer: SplatLayer) -> NDArray[np.uint8]:
    """The splat alone, (h, w, 3)."""
    return finished(layer.image)


def overlay_picture(
    layer: SplatLayer,
    vertices: Array,
    faces: NDArray[np.int64],
    *,
    normals: Array,
    colours: Array | None = None,
) -> NDArray[np.uint8]:
    """The organ (vertices (Nv, 3) scene units, unit normals (Nv, 3)) over the splat: (h, w, 3).

    With vertex ``colours`` (Nv, 3) in 0..1 the organ is painted opaque in them.
    """
    view = layer.view.scaled(SUPERSAMPLING)
    organ = draw_triangles(view, vertices, faces)
    image, mask = layer.image.copy(), organ.covered
    pixels, flat = np.flatnonzero(mask), image.reshape(-1, 3)
    shade = shading(view, normals)[:, None]
    shaded = organ.interpolated(faces, shade if colours is None else shade * colours)
    if colours is None:
        opacity = _glaze(organ.depth.ravel()[pixels], layer.fragments.depth.ravel()[pixels])[:, None]
        shaded = opacity * shaded * ORGAN_BLUE + (1 - opacity) * flat[pixels]
    flat[pixels] = shaded
    flat[np.flatnonzero(mask & ~binary_erosion(mask, iterations=SUPERSAMPLING))] = OUTLINE
    return finished(image)


def solid_picture(
    view: View, vertices: Array, faces: NDArray[np.int64], *, normals: Array, colour: Array
) -> NDArray[np.uint8]:
    """The surface alone in one colour, opaque: (h, w, 3)."""
    nothing = SplatLayer(view, np.zeros((0, 3)), np.zeros((0, 3)), 1.0)
    return overlay_picture(nothing, vertices, faces, normals=normals, colours=np.broadcast_to(colour, vertices.shape))


def _glaze(organ_depth: Reals, splat_depth: Reals) -> Reals:
    """Opacity (N,) of the organ; from before to behind the splat it fades over 2 percent of the depth, not at once."""
    alone = ~np.isfinite(splat_depth)
    ahead = np.clip(0.5 + (np.where(alone, organ_depth, splat_depth) - organ_depth) / (0.02 * organ_depth), 0, 1)
    return np.where(alone, GLAZE_ALONE, GLAZE_BEHIND + (GLAZE_FRONT - GLAZE_BEHIND) * ahead)


def shading(view: View, normals: Array) -> Array:
    """Brightness (N,) from a light beside the camera."""
    light = np.array([-0.35, -0.45, -1.0]) @ view.axes
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-9) * np.linalg.norm(light)
    return 0.30 + 0.75 * np.clip(normals @ light / lengths, 0, 1)


def finished(image: Reals) -> NDArray[np.uint8]:
    """Average of each block of supersamples, as bytes."""
    s = SUPERSAMPLING
    small = image[::s, ::s].copy()
    for k in range(1, s * s):
        small += image[k // s :: s, k % s :: s]
    return (np.clip(small / s**2, 0, 1) * 255 + 0.5).astype(np.uint8)
