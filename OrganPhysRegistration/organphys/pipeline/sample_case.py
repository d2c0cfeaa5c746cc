"""A sample case with known truth: label map, splat, landmarks and what a perfect registration would give.

The organ is a formula (sample_organ), deformed by a flow that keeps volume (sample_flow), seen by a camera
(sample_view) and turned into a noisy, partial splat (sample_splat), in a scene with a random unit.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..exports import sample_files
from ..ground.checks import Array, one_of
from ..ground.frames import Similarity, rotation_about
from . import sample_flow, sample_organ, sample_splat, sample_view
from .sample_scene import SampleScene, SampleSize, stage_scene, truth_arrays

SIZES = {"full": SampleSize(2.0, 130_000, 1.8), "small": SampleSize(4.0, 24_000, 3.2)}


@dataclass(frozen=True)
class SampleCase:
    """The files of a written case; organ: number of its label; mm_per_unit: true scale of the splat."""

    folder: Path
    organ: int
    mm_per_unit: float

    @property
    def labels(self) -> Path:
        return self.folder / "ct_labels.nii.gz"

    @property
    def splat(self) -> Path:
        return self.folder / "splat.ply"

    @property
    def landmarks(self) -> Path:
        return self.folder / "landmarks.mrk.json"

    @property
    def truth(self) -> Path:
        return self.folder / "truth.npz"


def write_sample_case(folder: str | Path, *, seed: int = 0, size: str = "full") -> SampleCase:
    """Write ct_labels.nii.gz, splat.ply, landmarks.mrk.json, case.json and truth.npz into ``folder``.

    ``size``: "full" (2 mm voxels, about 40,000 Gaussians) or "small" (for tests). The same seed gives the same case.
    """
    rng, grain = np.random.default_rng(seed), SIZES[one_of(size, "size", tuple(SIZES))]
    scene = stage_scene(grain, rng)
    truth = truth_arrays(scene, rng)
    landmarks_ct, ideal_ct = _landmarks(scene, rng)
    truth["landmarks_ct"] = landmarks_ct
    truth["landmarks_scene"] = scene.camera_mm(landmarks_ct) / scene.mm_per_unit
    truth["landmarks_scene_ideal"] = scene.camera_mm(ideal_ct) / scene.mm_per_unit
    gaussians = _gaussians(scene, rng)
    labels, affine = _label_map(grain.voxel_mm)

    case = SampleCase(Path(folder), sample_organ.LABELS["liver"], scene.mm_per_unit)
    sample_files.write_label_map(case.labels, labels, affine)
    sample_files.write_splat(case.splat, *(getattr(gaussians, name) for name in gaussians.__dataclass_fields__))
    sample_files.write_landmarks(case.landmarks, landmarks_ct, ("left lobe", "right lobe"))
    sample_files.write_arrays(case.truth, truth)
    sample_files.write_json(case.folder / "case.json", _facts(scene, truth, len(gaussians), seed, grain))
    return case


def _landmarks(scene: SampleScene, rng: np.random.Generator) -> tuple[Array, Array]:
    """Two points (2, 3) RAS mm of the seen surface, one a lobe, slipped by 2-3 mm; and where they were meant to be."""
    seen = scene.seen_ct
    quarters = np.quantile(seen[:, 0], [0.15, 0.75])
    middle = np.median(seen[:, 1:], axis=0)
    ideal = np.array([seen[np.linalg.norm(seen - np.append(x, middle), axis=1).argmin()] for x in quarters])
    sideways = np.cross(sample_organ.outward(ideal), rng.normal(size=(2, 3)))
    sideways *= rng.uniform(2, 3, (2, 1)) / np.linalg.norm(sideways, axis=1, keepdims=True)
    return sample_organ.onto_surface(ideal + sideways), ideal


def _gaussians(scene: SampleScene, rng: np.random.Generator) -> sample_splat.Gaussians:
    points, normals = scene.seen_camera, scene.seen_normals
    colours = sample_splat.tissue_colours(scene.seen_ct, points, normals, rng)
    T_scene_camera = Similarity(1 / scene.mm_per_unit, np.eye(3), np.zeros(3))
    return sample_splat.sample_gaussians(points, normals, colours, rng).moved(T_scene_camera)


def _label_map(voxel_mm: float) -> tuple[NDArray[np.uint8], Array]:
    """Labels (I, J, K) on an oblique grid with its first two axes flipped, and the affine (4, 4) voxel -> RAS mm."""
    turn = rotation_about(np.array([1.0, 0.6, 0.3]), np.radians(14)) @ np.diag([-1.0, -1.0, 1.0])
    reach = sample_organ.REACH
    corners = np.stack(np.meshgrid(*reach.T, indexing="ij"), -1).reshape(-1, 3) @ turn
    low, high = corners.min(0), corners.max(0)
    shape = np.ceil((high - low) / voxel_mm).astype(int)
    affine = np.eye(4)
    affine[:3, :3] = turn * voxel_mm
    affine[:3, 3] = sample_organ.CENTRE + turn @ low
    voxels = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3)
    return sample_organ.labels_at(voxels @ affine[:3, :3].T + affine[:3, 3]).reshape(shape), affine


def _facts(
    scene: SampleScene, truth: dict[str, NDArray], count: int, seed: int, grain: SampleSize
) -> dict[str, object]:
    left = np.linalg.norm(sample_flow.nonrigid(truth["points_ct"], truth["points_scene"] * scene.mm_per_unit), axis=1)
    return {
        "name": "sample",
        "organ": "liver",
        "label_id": sample_organ.LABELS["liver"],
        "label_names": {str(number): name for name, number in sample_organ.LABELS.items()},
        "units": {"ct": "mm, RAS+", "scene": "arbitrary; see truth.npz mm_per_unit"},
        "spacing_mm": [grain.voxel_mm] * 3,
        "camera": {
            "convention": "OpenCV: x right, y down, z forward; scene frame = camera frame",
            "position": [0, 0, 0],
            "fov_deg": sample_view.FOV_DEG,
        },
        "deformation": {
            "description": "flow of a divergence-free velocity field: det F = 1",
            "rms_nonrigid_mm": float(np.sqrt((left**2).mean())),
            "max_nonrigid_mm": float(left.max()),
        },
        "visible_fraction": scene.visible_fraction,
        "gaussians": {"count": count, "sh_degree": 0},
        "roi": None,
        "source": "built from a formula by organphys demo; no patient",
        "licence": "CC0",
        "seed": seed,
    }
