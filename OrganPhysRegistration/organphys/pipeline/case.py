"""One case as the stages get it: inputs checked, the splat divided into the organ and the rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError
from ..ground.notices import Notice
from ..ground.progress import Progress, no_progress
from ..points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ, SceneUnit
from .landmark_checks import checked_landmarks, checked_partners
from .registration import RegisterOptions
from .scene import Scene, select_scene

FEWEST_VOXELS = 60  # the basis needs a few more nodes than its handles


@dataclass(frozen=True)
class Case:
    """landmarks (L, 3) RAS mm, L may be 0; partners (L, 3): their places in the scene, nan where not known; notices:
    about the inputs; provenance: facts of them for the asset."""

    organ: Organ
    splat: GaussianCloud
    scene: Scene
    landmarks: Array
    partners: Array
    camera: Camera
    unit: SceneUnit | None
    options: RegisterOptions
    notices: tuple[Notice, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        organ: Organ,
        splat: GaussianCloud,
        options: RegisterOptions | None = None,
        *,
        landmarks: Landmarks | None = None,
        camera: Camera | None = None,
        box: Box | None = None,
        unit: SceneUnit | None = None,
        provenance: Mapping[str, Any] | None = None,
        progress: Progress = no_progress,
    ) -> Case:
        """The arguments are those of ``register``; InputError tells which of them cannot be used."""
        options = options or RegisterOptions()
        if len(organ.volume_points) < FEWEST_VOXELS:
            raise InputError(
                f"organ: {organ.name} has only {len(organ.volume_points)} voxels ({organ.volume_ml:.3g} ml), at least "
                f"{FEWEST_VOXELS} are needed; use a finer label map or check the label"
            )
        positions, notices = checked_landmarks(landmarks, organ)
        scene = select_scene(splat, box, options, progress)
        partners = checked_partners(landmarks, scene.centres)
        notices = (*organ.notices, *splat.notices, *notices, *scene.notices)
        camera, provenance = camera or Camera(), dict(provenance or {})
        return cls(organ, splat, scene, positions, partners, camera, unit, options, notices, provenance)

    @cached_property
    def target_tree(self) -> cKDTree:
        """Over the splat's target points."""
        return cKDTree(self.scene.target)

    @property
    def _landmark_fact(self) -> str:
        paired = int(np.isfinite(self.partners).all(1).sum())
        return f"{len(self.landmarks)}, {paired} of them also on the splat" if paired else str(len(self.landmarks))

    @property
    def stated_mm(self) -> float | None:
        """Millimetres per scene unit where they are stated exactly."""
        return self.unit.mm_per_unit if self.unit is not None and self.unit.percent == 0 else None

    @property
    def facts(self) -> dict[str, str]:
        """Label and text of the inputs, for the report."""
        unit = self.unit
        return {
            "organ": f"{self.organ.name}, {self.organ.volume_ml:.1f} ml",
            "splat": f"{len(self.splat)} Gaussians, {len(self.scene.centres)} opaque ones used",
            "landmarks": self._landmark_fact,
            "unit": "not stated" if unit is None else f"{unit.mm_per_unit:g} mm per scene unit, +- {unit.percent:g} %",
        }
