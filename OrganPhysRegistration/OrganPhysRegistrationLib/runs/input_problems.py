"""Why a registration cannot start now, in plain words. Cheap enough to be asked at every change of the panel."""

from __future__ import annotations

from typing import Any

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

from organphys.ground.checks import InputError

from ..inputs.roi_input import scene_box
from ..inputs.segment_checks import checked_place, checked_segment, is_empty
from ..inputs.splat_display import visible_gaussians
from ..inputs.splat_landmarks import case_landmarks
from ..inputs.splat_node import checked_splat, is_splat
from .run_inputs import RunInputs, inputs_from_parameters

FEWEST_GAUSSIANS = 100


def problems_of_parameters(parameters: Any) -> list[str]:
    """As ``problems_of``, for a parameter node; [] means that Apply is possible."""
    try:
        inputs = inputs_from_parameters(parameters)
    except InputError as error:
        return [sentence(str(error))]
    return problems_of(inputs)


def problems_of(inputs: RunInputs) -> list[str]:
    """One sentence per problem that says what to do, the most important first."""
    found = [
        *_organ_problems(inputs.segmentation, inputs.segment_id),
        *_splat_problems(inputs.splat, inputs.opacity),
        *_roi_problems(inputs),
        *_landmark_problems(inputs),
        *_number_problems(inputs),
    ]
    return [sentence(text) for text in found]


def sentence(text: str) -> str:
    """The text with a capital letter and a full stop."""
    text = " ".join(text.split())
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def _organ_problems(segmentation: Any, segment_id: str) -> list[str]:
    try:
        segment = checked_segment(segmentation, segment_id)
    except InputError as error:
        return [str(error)]
    parent = segmentation.GetParentTransformNode()
    if parent is not None and parent.IsTransformToWorldLinear():
        try:
            checked_place(segmentation)
        except InputError as error:
            return [str(error)]
    if is_empty(segmentation, segment_id):
        return [f"segment {segment.GetName()}: it is empty; paint the organ or choose another segment"]
    return []


def _splat_problems(splat: Any, opacity: float) -> list[str]:
    try:
        data = checked_splat(splat).GetPolyData().GetPointData()
    except InputError as error:
        return [str(error)]
    opacities = vtk_to_numpy(data.GetArray("opacity"))
    if len(opacities) < FEWEST_GAUSSIANS:
        return [f"splat: it has only {len(opacities)} Gaussians; load the splat that shows the organ"]
    if np.count_nonzero(opacities > opacity) < FEWEST_GAUSSIANS:
        return [
            f"splat: fewer than {FEWEST_GAUSSIANS} Gaussians are above the opacity threshold {opacity:.2g} "
            f"(the highest is {opacities.max():.2g}); lower the threshold"
        ]
    return []


def _roi_problems(inputs: RunInputs) -> list[str]:
    roi, splat = inputs.roi, inputs.splat
    if roi is None or not is_splat(splat):
        return []
    try:
        box = scene_box(roi, splat)
    except InputError as error:
        return [str(error)]
    left = np.count_nonzero(visible_gaussians(splat, opacity=inputs.opacity, box=box))
    if left < FEWEST_GAUSSIANS:
        return [
            f"region of interest: {roi.GetName()} leaves {left} Gaussians of the splat; move it onto the organ in the "
            "splat, enlarge it, or choose none"
        ]
    return []


def _landmark_problems(inputs: RunInputs) -> list[str]:
    count = 0 if inputs.landmarks is None else inputs.landmarks.GetNumberOfDefinedControlPoints()
    if inputs.method == "paper" and count == 0:
        return ["the paper's method needs a landmark: place 1 or 2 on the organ, or choose the OrganPhys method"]
    if inputs.splat_landmarks is None or not is_splat(inputs.splat):
        return []
    try:
        case_landmarks(inputs.landmarks, inputs.splat_landmarks, inputs.splat)
    except InputError as error:
        return [str(error)]
    return []


def _number_problems(inputs: RunInputs) -> list[str]:
    found = []
    if inputs.mm_per_unit is not None and not 1e-6 <= inputs.mm_per_unit <= 1e6:
        found.append("the splat's unit must lie between 0.000001 and 1000000 mm per unit: enter it or choose unknown")
    if inputs.camera_fov_deg is not None and not 1 <= inputs.camera_fov_deg < 180:
        found.append(f"the field of view must lie between 1 and 180 degrees, not {inputs.camera_fov_deg:g}")
    return found
