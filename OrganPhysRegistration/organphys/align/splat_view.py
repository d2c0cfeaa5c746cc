"""The splat as the endoscope saw it: clean surface, reference image and rim, all in the camera frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError
from ..ground.frames import Similarity, rotation_between
from ..ground.notices import Notice
from ..points.neighbours import nearest_neighbours
from ..points.point_sets import Camera
from .camera_image import CameraImage, CameraImageOptions, camera_image
from .rim import Rim, find_rim
from .splat_surface import SplatSurface, splat_surface

BESIDE = 12  # samples over whose median single outliers vanish


@dataclass(frozen=True)
class SplatView:
    """``T_camera_scene`` is a rigid motion; surface, image and rim are in the camera frame, raw scene units.
    ``thinned``: every how many-th surface sample stands for the others in ``neighbourhoods``."""

    T_camera_scene: Similarity
    surface: SplatSurface
    image: CameraImage
    rim: Rim
    notices: tuple[Notice, ...] = ()
    thinned: int = 1

    @cached_property
    def tree(self) -> cKDTree:
        """KD-tree over the surface samples."""
        return cKDTree(self.surface.samples)

    @cached_property
    def neighbourhoods(self) -> NDArray[np.int64]:
        """The tenth (M, M / 10) of all surface samples nearest to each, of few samples 20; of them those that stand
        for the others."""
        samples = self.surface.samples
        count = max(20, len(samples) // 10) // self.thinned
        members = np.arange(0, len(samples), self.thinned)
        tree = self.tree if self.thinned == 1 else cKDTree(samples[members])
        return members[nearest_neighbours(tree, samples, k=range(1, min(count, len(members)) + 1))[1]]

    @cached_property
    def beside(self) -> NDArray[np.int64]:
        """The ``BESIDE`` surface samples (M, 12) nearest to each; of fewer samples all."""
        count = min(BESIDE, len(self.surface.samples))
        if self.thinned == 1:
            return self.neighbourhoods[:, :count]
        return nearest_neighbours(self.tree, self.surface.samples, k=range(1, count + 1))[1]


def splat_view(
    centres: Array,
    others: Array,
    camera: Camera,
    *,
    surface_of: Callable[..., SplatSurface] = splat_surface,
    image_options: CameraImageOptions | None = None,
    thinned: int = 1,
    seed: int = 0,
) -> SplatView:
    """View of the organ's opaque ``centres`` (N, 3) and of the rest of the scene ``others`` (K, 3), scene frame."""
    centres, others = np.asarray(centres, dtype=np.float64), np.asarray(others, dtype=np.float64)
    T_camera_scene, notices = look(centres, camera)
    surface = surface_of(T_camera_scene.apply(centres), seed=seed)
    surface = _in_front(surface)
    image = camera_image(surface, T_camera_scene.apply(others), fov_deg=camera.fov_deg, options=image_options)
    return SplatView(T_camera_scene, surface, image, find_rim(surface, image), notices, thinned)


def look(centres: Array, camera: Camera) -> tuple[Similarity, tuple[Notice, ...]]:
    """Camera frame of the reference view: +z as the scene has it, or towards the organ where that cannot be."""
    offset = centres - camera.position
    direction = np.median(offset, axis=0)
    if np.linalg.norm(direction) == 0:
        raise InputError("camera: it lies in the middle of the splat; give the endoscope's position")
    rotation, notices = np.eye(3), tuple[Notice, ...]()
    if np.mean(offset[:, 2] > 0.1 * np.linalg.norm(direction)) < 0.98:
        rotation = rotation_between(direction, np.array([0.0, 0.0, 1.0]))
        notices = (
            Notice(
                "camera_turned",
                "The splat does not lie before a camera that looks along +z (OpenCV convention); "
                "the camera was turned towards the organ. Check the camera position.",
            ),
        )
    return Similarity(1.0, rotation, -rotation @ camera.position), notices


def _in_front(surface: SplatSurface) -> SplatSurface:
    """The surface without points at or behind the camera plane, which no image can show."""
    nearest = 0.02 * float(np.median(surface.points[:, 2]))
    if nearest <= 0:
        raise InputError("camera: the splat lies behind it; give the endoscope's position in scene units")
    kept, kept_samples = surface.points[:, 2] > nearest, surface.samples[:, 2] > nearest
    return SplatSurface(
        surface.points[kept], surface.normals[kept],
        surface.samples[kept_samples], surface.sample_normals[kept_samples],
        surface.spacing, surface.radius,
    )  # fmt: skip
