"""Pictures of a simulation: the splat as it moves, the organ and the tool in it, by the report's software renderer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..asset.surface_distance import vertex_normals
from ..ground.checks import Array
from .camera_view import View
from .mesh_thinning import ThinMesh, thin_mesh
from .rasteriser import Reals, draw_triangles
from .renderer import SUPERSAMPLING, SplatLayer, finished, shading
from .report_pictures import point_spacing

WIDTH, HEIGHT = 400, 320
TISSUE = np.array([0.72, 0.42, 0.36])  # the organ where no splat covers it
STEEL = np.array([0.74, 0.77, 0.80])
NEAREST = 0.05  # of the distance to the organ: what is nearer to the camera is cut off
SEE_THROUGH = 0.25  # of the tool behind tissue

Solid = tuple[Array, NDArray[np.int64]]  # vertices (N, 3), triangles (M, 3)


@dataclass(frozen=True)
class Stage:
    """What stays the same in all pictures of one view; lengths in scene units.

    vertices (Nv, 3), faces (Nf, 3): organ at rest; colours (N, 3) in 0..1 of the splat, none without one.
    """

    view: View
    vertices: Array
    faces: NDArray[np.int64]
    colours: Array
    radius: float

    @cached_property
    def thin(self) -> ThinMesh:
        return thin_mesh(self.vertices, self.faces, cells_across=80)

    def picture(self, vertices: Array, centres: Array, tools: Sequence[Solid]) -> NDArray[np.uint8]:
        """Organ vertices (Nv, 3), splat centres (N, 3) and tools at one moment: image (h, w, 3)."""
        layer = SplatLayer(self.view, centres, self.colours, self.radius)
        view = self.view.scaled(SUPERSAMPLING)
        image, depth = layer.image.copy(), layer.fragments.depth.copy()
        organ = self.thin.averaged(vertices)
        _paint(image, depth, view, (organ, self.thin.faces), TISSUE, only_bare=True)
        for solid in tools:
            _paint(image, depth, view, solid, STEEL)
        return finished(image)


def stages(
    vertices: Array, faces: NDArray[np.int64], shown: Array, *, camera: Array, centres: Array, colours: Array
) -> list[Stage]:
    """From the camera, and from beside it; both hold the vertices (K, 3) ``shown``."""
    front = View(camera, shown.mean(0), np.array([0.0, 1.0, 0.0]), 1.0, WIDTH, HEIGHT)
    radius = 2.0 * point_spacing(centres) if len(centres) else 1.0
    views = (front.fitted(shown, fill=0.9), front.turned(1, 55).fitted(shown, fill=0.9))
    return [Stage(view, vertices, faces, colours, radius) for view in views]


def _paint(image: Reals, depth: Reals, view: View, solid: Solid, colour: Array, *, only_bare: bool = False) -> None:
    """Draw a solid into image (h, w, 3) and depth (h, w): before what is there, and faintly behind it.

    only_bare: just where nothing has been drawn yet, as tissue that the endoscope did not see.
    """
    vertices, faces = solid
    vertices, normals, faces = before_camera(view, vertices, vertex_normals(vertices, faces), faces)
    drawn = draw_triangles(view, vertices, faces)
    shade = drawn.interpolated(faces, shading(view, normals)[:, None])
    pixels = np.flatnonzero(drawn.covered)
    flat, behind = image.reshape(-1, 3), drawn.depth.ravel()[pixels] > depth.ravel()[pixels]
    opacity = np.where(behind, 0.0 if only_bare else SEE_THROUGH, 1.0)
    if only_bare:
        opacity = np.where(np.isfinite(depth.ravel()[pixels]), 0.0, 1.0)
    opacity = opacity.astype(np.float32)[:, None]
    flat[pixels] = opacity * shade * colour.astype(np.float32) + (1 - opacity) * flat[pixels]
    np.minimum(depth.reshape(-1), drawn.depth.ravel(), out=depth.reshape(-1), where=drawn.covered.ravel())


def before_camera(
    view: View, vertices: Array, normals: Array, faces: NDArray[np.int64]
) -> tuple[Array, Array, NDArray[np.int64]]:
    """The mesh cut off at a plane before the camera, which the shaft of a tool may pass: vertices, normals, faces."""
    depth = (vertices - view.position) @ view.axes[2] - NEAREST * view.distance
    behind = depth[faces] < 0
    cut = faces[behind.any(axis=1) & ~behind.all(axis=1)]
    points, turns, kept = [vertices], [normals], [faces[~behind.any(axis=1)]]
    count = len(vertices)
    for face in cut:
        corners = []
        for a, b in zip(face, np.roll(face, -1), strict=True):
            if depth[a] >= 0:
                corners.append((vertices[a], normals[a]))
            if (depth[a] >= 0) != (depth[b] >= 0):
                t = depth[a] / (depth[a] - depth[b])
                corners.append(
                    (vertices[a] + t * (vertices[b] - vertices[a]), normals[a] + t * (normals[b] - normals[a]))
                )
        points.append(np.array([point for point, _ in corners]))
        turns.append(np.array([turn for _, turn in corners]))
        kept.append(count + np.array([[0, k, k + 1] for k in range(1, len(corners) - 1)]))
        count += len(corners)
    return np.concatenate(points), np.concatenate(turns), np.concatenate(kept)
