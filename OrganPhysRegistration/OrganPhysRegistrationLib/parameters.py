"""What the user chose: typed parameters kept in the scene, so that they are saved and come back with it."""

from __future__ import annotations

from typing import Annotated

from slicer import vtkMRMLMarkupsFiducialNode, vtkMRMLMarkupsROINode, vtkMRMLModelNode, vtkMRMLSegmentationNode
from slicer.parameterNodeWrapper import WithinRange, parameterNodeWrapper

from .choices import CameraChoice, Method, OverlayIn, SkinningWeights, Stage, Stiffness, SurfaceColour, UnitChoice
from .stiffness_scale import percent_of

LEAST_UNIT_MM, LARGEST_UNIT_MM = 1e-4, 1e6  # what can be entered; the field shows four decimals
MM_PER_UNIT = {UnitChoice.Millimetre: 1.0, UnitChoice.Centimetre: 10.0, UnitChoice.Metre: 1000.0}


@parameterNodeWrapper
class OrganPhysRegistrationParameterNode:
    """Lengths in mm unless the name says otherwise.

    landmarks: on the organ, splatLandmarks: the same points on the splat, by label or in the same order;
    landmarkRadiusMm: 0 lets the method choose; cameraPosition: "[x, y, z]" in scene units and cameraFovDeg (0 unknown),
    used with cameraChoice FromView; mmPerUnit: used with unitChoice Custom; unitPercent: standard deviation of the
    stated unit, 0 means exact; opacity: Gaussians below it are hidden and left out; pointSize: pixels; caseID: the case
    whose results are shown, "" before the first run; stiffnessPercent: of stiffness Custom, see stiffness_scale.
    """

    segmentation: vtkMRMLSegmentationNode
    segmentID: str = ""
    splat: vtkMRMLModelNode
    landmarks: vtkMRMLMarkupsFiducialNode
    splatLandmarks: vtkMRMLMarkupsFiducialNode
    roi: vtkMRMLMarkupsROINode
    landmarkRadiusMm: Annotated[float, WithinRange(0, 200)] = 0.0
    cameraChoice: CameraChoice = CameraChoice.SceneOrigin
    cameraPosition: str = ""
    cameraFovDeg: Annotated[float, WithinRange(0, 179)] = 0.0
    unitChoice: UnitChoice = UnitChoice.Unknown
    mmPerUnit: Annotated[float, WithinRange(LEAST_UNIT_MM, LARGEST_UNIT_MM)] = 1.0
    unitPercent: Annotated[float, WithinRange(0, 100)] = 0.0
    method: Method = Method.OrganPhys
    stiffness: Stiffness = Stiffness.Moderate
    stiffnessPercent: Annotated[float, WithinRange(0, 100)] = percent_of("moderate")
    weights: SkinningWeights = SkinningWeights.Rkpm
    opacity: Annotated[float, WithinRange(0, 1)] = 0.1
    pointSize: Annotated[float, WithinRange(1, 20)] = 4.0
    removeFloaters: bool = False
    closeHoles: bool = False
    opening: bool = True
    seed: Annotated[int, WithinRange(0, 2**31 - 1)] = 0
    shownStage: Stage = Stage.Elastic
    surfaceColour: SurfaceColour = SurfaceColour.Distance
    overlayIn: OverlayIn = OverlayIn.Endoscope
    caseID: str = ""


def stated_mm_per_unit(parameters: OrganPhysRegistrationParameterNode) -> float | None:
    """Millimetres per scene unit as the user states it, None if unknown."""
    if parameters.unitChoice is UnitChoice.Custom:
        return parameters.mmPerUnit
    return MM_PER_UNIT.get(parameters.unitChoice)
