"""The sample organ as the camera has it: CT mm -> flow -> camera mm -> scene units, and the truth about it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.frames import Similarity, fit_similarity
from . import sample_flow, sample_organ, sample_view

TRUTH_POINTS = {"surface": 1000, "interior": 500}


@dataclass(frozen=True)
class SampleSize:
    """How fine a sample case is: label map voxel in mm, points on the whole surface, pixel of the view in mm."""

    voxel_mm: float
    surface_points: int
    pixel_mm: float


@dataclass(frozen=True)
class SampleScene:
    """The organ as the camera has it: CT mm -> flow -> camera mm -> scene units."""

    flow: sample_flow.Flow
    T_camera_ct: Similarity
    mm_per_unit: float
    sight: sample_view.Sight
    seen_ct: Array  # densely sampled visible surface, RAS mm,
    seen_camera: Array  # the same points in the camera frame, mm,
    seen_normals: Array  # and their normals there
    visible_fraction: float

    def camera_mm(self, points_ct: Array) -> Array:
        return self.T_camera_ct.apply(self.flow.apply(points_ct))

    def camera_normals(self, points_ct: Array, normals: Array) -> Array:
        return self.T_camera_ct.turn(self.flow.normals(points_ct, normals))


def stage_scene(grain: SampleSize, rng: np.random.Generator) -> SampleScene:
    points = sample_organ.surface_points(grain.surface_points, rng)
    normals = sample_organ.outward(points)
    flow = sample_flow.random_flow(points[:2000], sample_view.FRONT_CT, rms_mm=rng.uniform(4.5, 5.5), rng=rng)
    moved = flow.apply(points)
    T_camera_ct = sample_view.camera_pose(moved.mean(0), 190.0, rng)
    camera_points = T_camera_ct.apply(moved)
    sight = sample_view.look(camera_points, pixel_mm=grain.pixel_mm, rng=rng)
    camera_normals = T_camera_ct.turn(flow.normals(points, normals))
    seen = sight.visible(camera_points, camera_normals)
    mm_per_unit = float(np.exp(rng.uniform(np.log(15), np.log(60))))
    views = (points[seen], camera_points[seen], camera_normals[seen])
    return SampleScene(flow, T_camera_ct, mm_per_unit, sight, *views, float(seen.mean()))


def truth_arrays(scene: SampleScene, rng: np.random.Generator) -> dict[str, NDArray]:
    surface = sample_organ.surface_points(TRUTH_POINTS["surface"], rng)
    normals = scene.camera_normals(surface, sample_organ.outward(surface))
    points_ct = np.concatenate([surface, sample_organ.interior_points(TRUTH_POINTS["interior"], rng)])
    points_camera = scene.camera_mm(points_ct)
    region = np.full(len(points_ct), 2, dtype=np.int32)
    region[: len(surface)] = np.where(scene.sight.visible(points_camera[: len(surface)], normals), 0, 1)
    points_scene = points_camera / scene.mm_per_unit
    return {
        "points_ct": points_ct,
        "points_scene": points_scene,
        "region": region,
        "mm_per_unit": np.array(scene.mm_per_unit),
        "similarity": fit_similarity(points_ct, points_scene).matrix,
    }
