"""Sequences with known truth: the sample organ and a case folder, bent by a share of their deformation per frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from case_inputs import read_case
from scipy.interpolate import RBFInterpolator

from organphys.ground.frames import Similarity, fit_similarity, rotation_about
from organphys.pipeline import sample_organ, sample_splat, sample_view
from organphys.pipeline.sample_case import SIZES, write_sample_case
from organphys.pipeline.sample_scene import SampleScene, stage_scene
from organphys.points.point_sets import Box, GaussianCloud, Landmarks, Organ

NOISE_MM, KEPT = 0.3, 0.7  # of a case folder's Gaussians in every frame: moved at random, and how many are there
SAMPLE_TURN_DEG, SAMPLE_DRIFT_MM = 3.0, 8.0  # of the sample organ as a whole, on top of its bending


@dataclass(frozen=True)
class SequenceCase:
    """shares (T,): of the deformation in every frame, 0 to 1."""

    name: str
    organ: Organ
    landmarks: Landmarks | None
    box: Box | None
    points_ct: np.ndarray
    mm_per_unit: float
    shares: np.ndarray
    maker: object

    def frames(self) -> Iterator[tuple[GaussianCloud, np.ndarray]]:
        """Splat and true scene positions of ``points_ct`` (N, 3) of every frame."""
        for k, share in enumerate(self.shares):
            yield self.maker.frame(k, float(share))


def breathing(count: int) -> np.ndarray:
    """One breath: 0 to 1 and back."""
    return 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(count) / count)


@dataclass(frozen=True)
class SampleFrames:
    """The sample case's generator with its flow run for a share of its time, fresh noise in every frame."""

    scene: SampleScene
    points: np.ndarray
    normals: np.ndarray
    points_ct: np.ndarray
    seed: int

    def frame(self, number: int, share: float) -> tuple[GaussianCloud, np.ndarray]:
        flow = replace(self.scene.flow, velocities=share * self.scene.flow.velocities)
        centre = self.scene.T_camera_ct.apply(self.points.mean(0)[None])[0]
        turn = rotation_about(np.array([0.3, 1.0, 0.2]), np.radians(SAMPLE_TURN_DEG * share))
        shift = SAMPLE_DRIFT_MM * share * np.array([0.6, 0.7, 0.4])
        T_camera_ct = Similarity(1.0, turn, centre - turn @ centre + shift) @ self.scene.T_camera_ct
        moved = T_camera_ct.apply(flow.apply(self.points))
        normals = T_camera_ct.turn(flow.normals(self.points, self.normals))
        sight = sample_view.look(moved, pixel_mm=SIZES["full"].pixel_mm, rng=np.random.default_rng(self.seed))
        seen, rng = sight.visible(moved, normals), np.random.default_rng([self.seed, number])
        colours = sample_splat.tissue_colours(
            self.points[seen], moved[seen], normals[seen], np.random.default_rng(self.seed)
        )
        gaussians = sample_splat.sample_gaussians(moved[seen], normals[seen], colours, rng)
        centres = (gaussians.centres / self.scene.mm_per_unit).astype(np.float32)
        cloud = GaussianCloud(centres, gaussians.opacities, gaussians.colours, np.ones(len(centres), dtype=bool))
        return cloud, T_camera_ct.apply(flow.apply(self.points_ct)) / self.scene.mm_per_unit


def sample_sequence(count: int, folder: Path, *, seed: int = 3) -> SequenceCase:
    """The sample case of ``seed``, written into ``folder`` for its label map."""
    from organphys.readers.landmarks_file import read_landmarks
    from organphys.readers.segmentation_file import read_organ

    case = write_sample_case(folder, seed=seed)
    rng = np.random.default_rng(seed)
    scene = stage_scene(SIZES["full"], rng)
    points = sample_organ.surface_points(SIZES["full"].surface_points, rng)
    truth = np.concatenate([sample_organ.surface_points(1000, rng), sample_organ.interior_points(500, rng)])
    maker = SampleFrames(scene, points, sample_organ.outward(points), truth, seed)
    organ = read_organ(case.labels, organ=str(case.organ))
    landmarks = read_landmarks(case.landmarks)
    return SequenceCase("sample", organ, landmarks, None, truth, scene.mm_per_unit, breathing(count), maker)


@dataclass(frozen=True)
class FolderFrames:
    """A case's splat carried between the oracle similarity (share 0) and its true state (share 1)."""

    splat: GaussianCloud
    to_rigid: np.ndarray  # (G, 3): what takes every Gaussian to the oracle similarity's place
    true_scene: np.ndarray
    rigid_scene: np.ndarray
    mm_per_unit: float

    def frame(self, number: int, share: float) -> tuple[GaussianCloud, np.ndarray]:
        rng = np.random.default_rng([7, number])
        kept = np.sort(rng.choice(len(self.splat), int(KEPT * len(self.splat)), replace=False))
        noise = NOISE_MM / self.mm_per_unit * rng.normal(size=(len(kept), 3))
        centres = self.splat.centres[kept] + (1 - share) * self.to_rigid[kept] + noise
        cloud = GaussianCloud(
            centres.astype(np.float32), self.splat.opacities[kept], self.splat.colours[kept], self.splat.valid[kept]
        )
        return cloud, (1 - share) * self.rigid_scene + share * self.true_scene


def folder_sequence(folder: Path, count: int) -> SequenceCase:
    """A case folder with its truth; the displacement between its points is interpolated (thin plate, 40 nearest)."""
    inputs = read_case(folder)
    truth = inputs.truth
    rigid = fit_similarity(truth.points_ct, truth.points_scene).apply(truth.points_ct)
    field = RBFInterpolator(truth.points_scene, rigid - truth.points_scene, neighbors=40, smoothing=1e-6)
    centres = inputs.splat.centres.astype(np.float64)
    span = truth.points_scene.min(0), truth.points_scene.max(0)
    to_rigid = field(np.clip(np.nan_to_num(centres), *span))  # beyond the organ the field of its border
    maker = FolderFrames(inputs.splat, to_rigid, truth.points_scene, rigid, truth.mm_per_unit)
    return SequenceCase(
        inputs.name, inputs.organ, inputs.landmarks, inputs.box, truth.points_ct, truth.mm_per_unit,
        breathing(count), maker,
    )  # fmt: skip
