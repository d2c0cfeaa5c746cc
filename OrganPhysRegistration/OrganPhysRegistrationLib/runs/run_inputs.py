"""What one registration works on: nodes and plain values, from the panel's parameters or from a script."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

from organphys.ground.checks import InputError

from ..stiffness_scale import stiffness_of


@dataclass(frozen=True)
class RunInputs:
    """Nodes of the scene and settings.

    segmentation, segment_id: the organ; splat: model node of ``inputs.splat_node``; landmarks: markups on the organ's
    surface; splat_landmarks: markups with the same points on the splat; roi: crop of the splat; camera_position (3,):
    endoscope in scene units, None for the scene's origin; camera_fov_deg: full angle, degrees; mm_per_unit: mm per
    scene unit if known, unit_percent its standard deviation in percent (0: exact); landmark_radius_mm: None lets the
    method choose; opacity: Gaussians below are left out.
    """

    segmentation: Any
    segment_id: str
    splat: Any
    landmarks: Any = None
    roi: Any = None
    splat_landmarks: Any = None
    camera_position: tuple[float, float, float] | None = None
    camera_fov_deg: float | None = None
    mm_per_unit: float | None = None
    unit_percent: float = 0.0
    landmark_radius_mm: float | None = None
    method: str = "organphys"
    stiffness: str | float = "moderate"
    weights: str = "rkpm"
    opacity: float = 0.1
    remove_floaters: bool = False
    close_holes: bool = False
    opening: bool = True
    seed: int = 0

    @property
    def nodes(self) -> dict[str, Any]:
        """What a user calls each node -> node or None."""
        return {
            "segmentation": self.segmentation,
            "splat": self.splat,
            "landmark list": self.landmarks,
            "region of interest": self.roi,
            "landmark list on the splat": self.splat_landmarks,
        }


def inputs_from_parameters(parameters: Any) -> RunInputs:
    """RunInputs of a parameter node (or any object with its names); InputError for a camera that cannot be read."""
    from ..parameters import stated_mm_per_unit

    from_view = _value(parameters.cameraChoice) == "view"
    return RunInputs(
        segmentation=parameters.segmentation,
        segment_id=parameters.segmentID,
        splat=parameters.splat,
        landmarks=parameters.landmarks,
        roi=parameters.roi,
        splat_landmarks=getattr(parameters, "splatLandmarks", None),
        camera_position=camera_position_of(parameters.cameraPosition) if from_view else None,
        camera_fov_deg=(parameters.cameraFovDeg or None) if from_view else None,
        mm_per_unit=stated_mm_per_unit(parameters),
        unit_percent=parameters.unitPercent,
        landmark_radius_mm=parameters.landmarkRadiusMm or None,
        method=_value(parameters.method),
        stiffness=stiffness_of(_value(parameters.stiffness), getattr(parameters, "stiffnessPercent", None)),
        weights=_value(parameters.weights),
        opacity=parameters.opacity,
        remove_floaters=parameters.removeFloaters,
        close_holes=parameters.closeHoles,
        opening=parameters.opening,
        seed=parameters.seed,
    )


def _value(choice: Any) -> str:
    """The core's name of a choice; a plain string stands for itself."""
    return str(getattr(choice, "value", choice))


def camera_position_of(text: str) -> tuple[float, float, float]:
    """The parameter cameraPosition, "[x, y, z]", as numbers in scene units; InputError where it is none."""
    if not text:
        raise InputError('camera: no view taken yet; press "Use 3D view" or choose the scene origin')
    try:
        x, y, z = (float(number) for number in json.loads(text))
    except (ValueError, TypeError) as error:
        raise InputError(
            f"camera: expected [x, y, z] in scene units, got {text[:60]!r}; take the view again"
        ) from error
    if not all(map(math.isfinite, (x, y, z))):
        raise InputError(f"camera: its position is not finite, {text[:60]}; take the view again")
    return x, y, z
