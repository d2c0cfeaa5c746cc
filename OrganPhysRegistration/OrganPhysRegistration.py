"""The Slicer module OrganPhysRegistration: a CT organ onto an endoscopic Gaussian splat, rigidly, then elastically."""

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

from OrganPhysRegistrationLib.inputs.sample_case import register_sample_case
from OrganPhysRegistrationLib.inputs.splat_reader import OrganPhysRegistrationFileReader
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.panel.build import build_panel
from OrganPhysRegistrationLib.parameters import OrganPhysRegistrationParameterNode
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs
from OrganPhysRegistrationLib.transform_check import mapped_and_expected

__all__ = [
    "OrganPhysRegistration",
    "OrganPhysRegistrationFileReader",
    "OrganPhysRegistrationLogic",
    "OrganPhysRegistrationTest",
    "OrganPhysRegistrationWidget",
]


class OrganPhysRegistration(ScriptedLoadableModule):
    """What Slicer shows of the module before it is opened."""

    def __init__(self, parent: Any) -> None:
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = _("OrganPhys Registration")
        parent.categories = [translate("qSlicerAbstractCoreModule", "Registration")]
        parent.dependencies = []
        parent.contributors = ["OrganPhys contributors"]
        parent.helpText = _(
            "Registers an organ segmented from CT or MR onto the partial, noisy surface of the same organ in an "
            "endoscopic 3D Gaussian splat, rigidly and then elastically. Choose the organ and the splat, click one or "
            "two landmarks on the part of the organ that the endoscope sees, press Register. For research only: not a "
            "medical device."
        )
        parent.acknowledgementText = _("OrganPhys is free software under the Apache License 2.0.")
        slicer.app.connect("startupCompleted()", self.registerSampleData)

    def registerSampleData(self) -> None:
        """Offer the sample case in the Sample Data module."""
        register_sample_case()


class OrganPhysRegistrationWidget(ScriptedLoadableModuleWidget, VTKObservationMixin):
    """The panel. Its sections are in OrganPhysRegistrationLib.panel; here only Slicer's events arrive."""

    def __init__(self, parent: Any = None) -> None:
        ScriptedLoadableModuleWidget.__init__(self, parent)
        VTKObservationMixin.__init__(self)

    def setup(self) -> None:
        ScriptedLoadableModuleWidget.setup(self)
        top = slicer.util.loadUI(self.resourcePath("UI/OrganPhysRegistration.ui"))
        self.layout.addWidget(top)
        self.ui = slicer.util.childWidgetVariables(top)
        top.setMRMLScene(slicer.mrmlScene)
        self.logic = OrganPhysRegistrationLogic()
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
        """Called each time the user opens another module; a run goes on, its results arrive all the same."""
        self.panel.leave()

    def onSceneLeft(self, caller: Any, event: str) -> None:
        """The parameters are about to go or to be replaced."""
        self.panel.connect_parameters(None)

    def onSceneReady(self, caller: Any, event: str) -> None:
        """A scene was closed or loaded: its parameter node is another one."""
        self.initializeParameterNode()

    def initializeParameterNode(self) -> None:
        """Bind the panel to the scene's parameter node, made where there is none."""
        node = self.logic.getParameterNode()
        bound = self.panel.parameters
        if bound is None or bound.parameterNode is not node:
            self.panel.connect_parameters(OrganPhysRegistrationParameterNode(node))
        else:
            self.panel.refresh()


class OrganPhysRegistrationTest(ScriptedLoadableModuleTest):
    """Self test on the generated case, in Slicer and in the test host alike."""

    def setUp(self) -> None:
        slicer.mrmlScene.Clear()

    def runTest(self) -> None:
        self.setUp()
        self.test_both_ways_of_registering()

    def test_both_ways_of_registering(self) -> None:
        """Register the sample case here and in the background; compare the transform node with the core's own map."""
        self.delayDisplay("Loading the sample case")
        logic = OrganPhysRegistrationLogic()
        with tempfile.TemporaryDirectory() as folder:
            nodes = logic.loadSampleCase(folder=folder, size="small")
        self.assertEqual(2, nodes["landmarks"].GetNumberOfDefinedControlPoints())
        organ = (nodes["segmentation"], nodes["segmentID"], nodes["splat"])
        self.delayDisplay("Registering")
        case = logic.register(*organ, landmarksNode=nodes["landmarks"])
        here = self._check(case, nodes["splat"])
        logic.undo()
        self.delayDisplay("Registering in the background")
        failures: list[str] = []
        inputs = RunInputs(*organ, landmarks=nodes["landmarks"])
        run = logic.startRun(inputs, onFailed=lambda code, message: failures.append(message))
        if run is not None:
            logic.waitForRun(run)
        self.assertEqual([], failures)
        there = self._check(run.case, nodes["splat"])
        self.assertLess(np.linalg.norm(here - there, axis=1).max(), 0.1)  # mm
        logic.cleanup()
        self.delayDisplay("Test passed")

    def _check(self, case: Any, splat: Any) -> Any:
        """The transform node puts the organ's points (N, 3) where the core does; those places, mm."""
        self.assertEqual("elastic", case.stage)
        points_ct, mapped, expected = mapped_and_expected(case, splat)
        self.assertGreater(np.linalg.norm(points_ct - expected, axis=1).max(), 1.0)  # mm: there is something to map
        self.assertLess(np.linalg.norm(mapped - expected, axis=1).max(), 0.1)  # mm
        return expected
