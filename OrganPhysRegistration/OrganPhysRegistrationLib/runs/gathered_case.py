"""From the scene to what the core takes: arrays and records, nothing of MRML any more."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np

from organphys.points.point_sets import Box, Camera, GaussianCloud, Landmarks, SceneUnit

from ..inputs.roi_input import scene_box
from ..inputs.segment_input import SegmentMask, segment_mask
from ..inputs.splat_landmarks import case_landmarks
from ..inputs.splat_node import splat_arrays
from .run_inputs import RunInputs


@dataclass(frozen=True)
class GatheredCase:
    """One case: the organ's voxels, the splat, and what the user stated. ``settings``: keywords of RegisterOptions."""

    segment: SegmentMask
    splat: GaussianCloud
    landmarks: Landmarks | None
    camera: Camera
    box: Box | None
    unit: SceneUnit | None
    settings: dict[str, Any]
    opening: bool
    close_holes: bool
    provenance: dict[str, Any]


def gather(inputs: RunInputs) -> Generator[None, None, GatheredCase]:
    """Read the nodes, a step at a time; InputError says what is wrong with one of them."""
    segment = segment_mask(inputs.segmentation, inputs.segment_id)
    yield
    splat = splat_arrays(inputs.splat)
    yield
    return GatheredCase(
        segment=segment,
        splat=splat,
        landmarks=case_landmarks(inputs.landmarks, inputs.splat_landmarks, inputs.splat),
        camera=_camera(inputs),
        box=scene_box(inputs.roi, inputs.splat),
        unit=None if inputs.mm_per_unit is None else SceneUnit(inputs.mm_per_unit, inputs.unit_percent),
        settings={
            "method": inputs.method,
            "stiffness": inputs.stiffness,
            "seed": inputs.seed,
            "opacity": inputs.opacity,
            "weights": inputs.weights,
            "clean": inputs.remove_floaters,
            "landmark_radius_mm": inputs.landmark_radius_mm,
        },
        opening=inputs.opening,
        close_holes=inputs.close_holes,
        provenance=_provenance(inputs),
    )


def _camera(inputs: RunInputs) -> Camera:
    if inputs.camera_position is None:
        return Camera(fov_deg=inputs.camera_fov_deg)
    return Camera(np.array(inputs.camera_position), inputs.camera_fov_deg)


def _provenance(inputs: RunInputs) -> dict[str, Any]:
    """What the asset tells about its making."""
    from organphys import __version__

    names = {role: node.GetName() for role, node in inputs.nodes.items() if node is not None}
    options = {
        name: getattr(inputs, name)
        for name in ("method", "stiffness", "weights", "opacity", "remove_floaters", "close_holes", "opening", "seed")
    }
    stated = {"mm_per_unit": inputs.mm_per_unit, "percent": inputs.unit_percent} if inputs.mm_per_unit else None
    return {
        "organphys": __version__,
        "inputs": {**names, "segment": inputs.segment_id, "file": inputs.splat.GetAttribute("OrganPhys.SplatFile")},
        "options": {**options, "unit": stated, "landmark_radius_mm": inputs.landmark_radius_mm},
    }
