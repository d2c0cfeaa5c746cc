"""The Slicer module OrganPhysSimulation: a registered organ to grasp and lift, with the splat moving along."""

from __future__ import annotations

import tempfile
from typing import Any

import numpy as np
import slicer
from slicer.i18n import tr as _
from slicer.i18n import translate
from slicer.ScriptedLoadableModule import (
    ScriptedLoadableModule,
    ScriptedLoadableModuleTest,
    ScriptedLoadableModuleWidget,
)
from slicer.util import VTKObservationMixin

from OrganPhysSimulationLib.inputs.sample_organ import register_sample_organ
from OrganPhysSimulationLib.logic import OrganPhysSimulationLogic
from OrganPhysSimulationLib.panel.build import build_panel
from OrganPhysSimulationLib.parameters import OrganPhysSimulationParameterNode

__all__ = [
    "OrganPhysSimulation",
    "OrganPhysSimulationLogic",
    "OrganPhysSimulationTest",
    "OrganPhysSimulationWidget",
]


class OrganPhysSimulation(ScriptedLoadableModule):
    """What Slicer shows of the module before it is opened."""

    def __init__(self, parent: Any) -> None:
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = _("OrganPhys Simulation")
        parent.categories = [translate("qSlicerAbstractCoreModule", "Simulation")]
        parent.dependencies = ["OrganPhysRegistration"]
        parent.contributors = ["OrganPhys contributors"]
        parent.helpText = _(
            "Makes an organ that OrganPhys Registration laid onto an endoscopic Gaussian splat soft: grasp it with a "
            "da Vinci instrument and lift it, the splat moves along. Choose the organ, place pins where ligaments hold "
            "it, press Start, and drag the instrument's handle in the 3D view or use its sliders; J closes the jaws. "
            "Sample data makes everything ready. For research only: not a medical device."
        )
        parent.acknowledgementText = _("OrganPhys is free software under the Apache License 2.0.")


class OrganPhysSimulationWidget(ScriptedLoadableModuleWidget, VTKObservationMixin):
    """The panel. Its sections are in OrganPhysSimulationLib.panel; here only Slicer's events arrive."""

    def __init__(self, parent: Any = None) -> None:
        ScriptedLoadableModuleWidget.__init__(self, parent)
        VTKObservationMixin.__init__(self)

    def setup(self) -> None:
        ScriptedLoadableModuleWidget.setup(self)
        top = slicer.util.loadUI(self.resourcePath("UI/OrganPhysSimulation.ui"))
        self.layout.addWidget(top)
        self.ui = slicer.util.childWidgetVariables(top)
        top.setMRMLScene(slicer.mrmlScene)
        self.logic = OrganPhysSimulationLogic()
        self.panel = build_panel(self.ui, self.logic)
        scene = slicer.mrmlScene
        for event in (scene.StartCloseEvent, scene.StartImportEvent):
            self.addObserver(scene, event, self.onSceneLeft)
        for event in (scene.EndCloseEvent, scene.EndImportEvent):
            self.addObserver(scene, event, self.onSceneReady)
        self.initializeParameterNode()

    def cleanup(self) -> None:
        """Called when the application closes and before the module is reloaded."""
        self.removeObservers()
        self.panel.cleanup()
        self.logic.cleanup()

    def enter(self) -> None:
        """Called each time the user opens this module."""
        self.initializeParameterNode()

    def exit(self) -> None:
        """Called each time the user opens another module: the simulation rests, what it shows stays."""
        self.panel.leave()

    def onSceneLeft(self, caller: Any, event: str) -> None:
        """The parameters are about to go or to be replaced; a simulation ends."""
        self.logic.closeSimulation()
        self.panel.connect_parameters(None)

    def onSceneReady(self, caller: Any, event: str) -> None:
        """A scene was closed or loaded: its parameter node is another one."""
        self.initializeParameterNode()

    def initializeParameterNode(self) -> None:
        """Bind the panel to the scene's parameter node, made where there is none."""
        node = self.logic.getParameterNode()
        bound = self.panel.parameters
        if bound is None or bound.parameterNode is not node:
            self.panel.connect_parameters(OrganPhysSimulationParameterNode(node))
        else:
            self.panel.refresh()


class OrganPhysSimulationTest(ScriptedLoadableModuleTest):
    """Self test on the generated case, in Slicer and in the test host alike."""

    def setUp(self) -> None:
        slicer.mrmlScene.Clear()

    def runTest(self) -> None:
        self.setUp()
        self.test_grasp_and_lift()

    def test_grasp_and_lift(self) -> None:
        """Register the sample case, close the jaws on the organ, lift: it is held, stays sound and is let go again."""
        self.delayDisplay("Registering the sample case")
        with tempfile.TemporaryDirectory() as folder:
            nodes = register_sample_organ(folder=folder, size="small")
        logic = OrganPhysSimulationLogic()
        self.delayDisplay("Preparing the simulation")
        session = logic.startSimulation(nodes.organ, nodes.splat, pinsNode=nodes.pins, handles=8, quadrature=300)
        joints = session.live.arm.joints.copy()
        touched = session.live.joints_at_contact()
        self.delayDisplay("Grasping")
        logic.setJoints(touched, jawDeg=30)
        logic.step(40)
        logic.setJoints(touched, jawDeg=-10)
        self.assertGreater(logic.step(20).held, 0)
        logic.setJoints(joints, jawDeg=-10)
        lifted = logic.step(40)
        self.assertGreater(lifted.min_det, 0)
        self.assertGreater(np.linalg.norm(session.live.displacement(), axis=1).max(), 1e-3)  # m
        logic.setJoints(joints, jawDeg=60)
        self.assertEqual(0, logic.step(30).held)
        logic.closeSimulation()
        self.delayDisplay("Test passed")
