"""What the user chose: typed parameters kept in the scene, so that they are saved and come back with it."""

from __future__ import annotations

from typing import Annotated

from slicer import vtkMRMLMarkupsFiducialNode, vtkMRMLMarkupsROINode, vtkMRMLModelNode
from slicer.parameterNodeWrapper import WithinRange, parameterNodeWrapper

from .choices import Colouring, GravityChoice, InstrumentChoice, TissueChoice


@parameterNodeWrapper
class OrganPhysSimulationParameterNode:
    """organ: the model that carries the registered organ; splat: None simulates the surface alone; pins and pinBox hold
    tissue where it rests; youngsKpa: stiffness in kPa, 0 takes the tissue's own; speed: simulated seconds per second.
    """

    organ: vtkMRMLModelNode
    splat: vtkMRMLModelNode
    pins: vtkMRMLMarkupsFiducialNode
    pinBox: vtkMRMLMarkupsROINode
    pinRadiusMm: Annotated[float, WithinRange(1, 100)] = 20.0
    tissue: TissueChoice = TissueChoice.Automatic
    youngsKpa: Annotated[float, WithinRange(0, 200)] = 0.0
    gravity: bool = False
    gravityChoice: GravityChoice = GravityChoice.Supine
    detail: bool = False
    instrument: InstrumentChoice = InstrumentChoice.LargeNeedleDriver
    showHandle: bool = True
    speed: Annotated[float, WithinRange(0.05, 4)] = 1.0
    colouring: Colouring = Colouring.Plain
    showSurface: bool = True
    showSplat: bool = True
    showPins: bool = True
