"""One case folder read into memory, with its truth for the evaluation."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from organphys.pipeline.case import Case
from organphys.pipeline.evaluation import Truth, mean_by_region, oracle_by_region, read_truth
from organphys.pipeline.registration import RegisterOptions
from organphys.points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ, SceneUnit
from organphys.readers.gaussian_ply import read_splat
from organphys.readers.landmarks_file import read_landmarks
from organphys.readers.roi_file import read_box
from organphys.readers.segmentation_file import read_organ


@dataclass(frozen=True)
class CaseInputs:
    """What a registration is given, and ``truth``, which it is not."""

    name: str
    organ: Organ
    splat: GaussianCloud
    landmarks: Landmarks | None
    box: Box | None
    camera: Camera
    truth: Truth

    def case(self, *, seed: int, unit: bool) -> Case:
        """As the stages get it; ``unit``: the true one is given."""
        stated = SceneUnit(self.truth.mm_per_unit) if unit else None
        options = RegisterOptions(seed=seed)
        return Case.of(
            self.organ, self.splat, options, landmarks=self.landmarks, camera=self.camera, box=self.box, unit=stated
        )

    def ratio(self, mapped: np.ndarray) -> float:
        """Mean TRE of the truth's points mapped to the scene (N, 3), as a fraction of the oracle similarity's."""
        return mean_by_region(self.truth, mapped)["all"] / oracle_by_region(self.truth)["all"]


def read_case(folder: Path) -> CaseInputs:
    """A folder with case.json, ct_labels.nii.gz, splat.ply, landmarks.mrk.json and truth.npz."""
    facts = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    return CaseInputs(
        name=folder.name,
        organ=read_organ(folder / "ct_labels.nii.gz", organ=str(facts["label_id"])),
        splat=read_splat(folder / "splat.ply"),
        landmarks=read_landmarks(folder / "landmarks.mrk.json"),
        box=None if facts.get("roi") is None else read_box(folder / "case.json"),
        camera=Camera(),
        truth=read_truth(folder / "truth.npz"),
    )
