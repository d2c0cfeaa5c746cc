"""The panel before a run: inputs, bindings, messages, scene close and load."""

from __future__ import annotations

import json

import numpy as np
import pytest
import qt
import slicer

import OrganPhysRegistrationLib.logic
from OrganPhysRegistrationLib.choices import CameraChoice, Stiffness, UnitChoice
from OrganPhysRegistrationLib.dependencies import DependencyError
from OrganPhysRegistrationLib.inputs.matrices import array_of
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.panel.segmentation_shortcuts import offer
from OrganPhysRegistrationLib.panel.view_layout import LAYOUT_ID


@pytest.fixture(autouse=True)
def no_child_process(monkeypatch):
    """The registration process is not started ahead of a run: nothing runs here."""
    monkeypatch.setattr(OrganPhysRegistrationLogic, "warmUp", lambda self: None)


@pytest.fixture
def parameters(module):
    return module.widget.panel.parameters


@pytest.fixture
def loaded(host, module, sample_case):
    """The small sample case in the panel; its nodes by the parameters' names."""
    nodes = module.logic.loadSampleCase(folder=sample_case.folder, size="small")
    module.widget.panel.choose(nodes)
    host.process()
    return nodes


def test_an_empty_panel_says_what_to_do_first(module, screenshot):
    assert not module.ui.applyButton.enabled
    assert "segmentation" in module.ui.reasonLabel.text.lower()
    assert "segmentation" in module.ui.applyButton.toolTip.lower()
    screenshot(module.panel, "panel_empty")


def test_no_text_is_cut_off_at_420_pixels(host, module, parameters, loaded, screenshot):
    parameters.unitChoice, parameters.cameraChoice = UnitChoice.Custom, CameraChoice.FromView
    parameters.mmPerUnit, parameters.unitPercent = 123.456, 100.0
    loaded["landmarks"].SetNthControlPointPositionWorld(0, 900, 0, 0)
    place_on_splat(parameters)
    host.process()
    for name in ("inputs", "display", "register", "result", "advanced"):
        getattr(module.ui, f"{name}Button").collapsed = False
    module.widget.panel.tell("A long sentence that has to be wrapped in a panel of 420 pixels, whatever happens.")
    screenshot(module.panel, "panel_all_sections")
    assert module.panel.width <= 420
    cut = [widget.name for widget in vars(module.ui).values() if text_is_cut(widget)]
    assert cut == []


def place_on_splat(parameters):
    """A point list with a long name and more points than there are landmarks on the organ."""
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "Landmarks on the splat of the first view")
    for point in ([0, 0, 0], [1, 0, 0], [0, 1, 0]):
        node.AddControlPoint(point)
    parameters.splatLandmarks = node


def text_is_cut(widget):
    """Whether a visible label, button or number field is narrower, or a wrapped label lower, than its text."""
    if isinstance(widget, qt.QAbstractSpinBox) and widget.visible:
        field = widget.findChild(qt.QLineEdit)
        return field.width < field.fontMetrics().horizontalAdvance(field.text) + 2
    if not isinstance(widget, (qt.QLabel, qt.QPushButton, qt.QToolButton, qt.QCheckBox)) or not widget.visible:
        return False
    if isinstance(widget, qt.QLabel) and widget.wordWrap:
        return widget.height < widget.heightForWidth(widget.width)
    needed = max(widget.fontMetrics().horizontalAdvance(line) for line in widget.text.split("\n"))
    return widget.width < needed + (0 if isinstance(widget, qt.QLabel) else 6)


def test_register_is_possible_once_organ_and_splat_are_chosen(module, loaded, screenshot):
    assert module.ui.applyButton.enabled
    assert not module.ui.reasonLabel.visible
    assert module.ui.segmentSelector.currentSegmentID() == loaded["segmentID"]
    screenshot(module.panel, "panel_inputs")


def test_the_segment_selector_sets_the_organ(host, module, parameters, loaded):
    other = next(i for i in loaded["segmentation"].GetSegmentation().GetSegmentIDs() if i != loaded["segmentID"])
    module.ui.segmentSelector.setCurrentSegmentID(other)
    assert parameters.segmentID == other
    module.ui.segmentSelector.setCurrentNode(None)
    assert (parameters.segmentation, parameters.segmentID) == (None, "")
    host.process()
    assert not module.ui.applyButton.enabled


def test_sample_data_button_fills_the_inputs(host, module, parameters, sample_case, monkeypatch):
    load = module.logic.loadSampleCase
    monkeypatch.setattr(module.logic, "loadSampleCase", lambda: load(folder=sample_case.folder, size="small"))
    module.ui.sampleDataButton.click()
    host.process()
    assert None not in (parameters.segmentation, parameters.splat, parameters.landmarks)
    assert parameters.segmentID


def test_widgets_and_parameters_follow_each_other(host, module, parameters):
    module.ui.opacitySlider.value = 0.25
    assert parameters.opacity == pytest.approx(0.25)
    parameters.stiffness = Stiffness.Aggressive
    assert module.ui.stiffnessCombo.currentText == "Aggressive"
    module.ui.unitCombo.setCurrentIndex(2)
    host.process()
    assert parameters.unitChoice is UnitChoice.Centimetre


def test_every_parameter_named_in_the_panel_exists(module, parameters):
    names = {widget.property("SlicerParameterName") for widget in vars(module.ui).values()} - {None, ""}
    assert len(names) > 12
    for name in names:
        parameters.getValue(name)


def test_only_splats_are_offered_as_splat(host, module, loaded):
    slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", "no splat")
    host.process()
    selector = module.ui.splatSelector
    assert selector.nodeCount() == 1
    assert selector.currentNode() is loaded["splat"]


def test_a_stated_unit_moves_the_splat_to_its_scale(host, module, parameters, loaded):
    parameters.unitChoice = UnitChoice.Metre
    host.process()
    matrix = array_of(loaded["splat"].GetParentTransformNode().GetMatrixTransformToParent())
    assert np.cbrt(np.linalg.det(matrix[:3, :3])) == pytest.approx(1000)
    assert not module.ui.mmPerUnitSpinBox.visible
    parameters.unitChoice = UnitChoice.Custom
    parameters.mmPerUnit = 2.5
    host.process()
    assert module.ui.mmPerUnitSpinBox.visible
    assert float(loaded["splat"].GetAttribute("OrganPhys.MmPerUnit")) == 2.5


def test_a_splat_loaded_with_its_unit_brings_it_along(host, module, parameters, sample_case):
    parameters.splat = module.logic.loadSplat(sample_case.splat, mmPerUnit=12.5, mmPerUnitPercent=5)
    host.process()
    assert parameters.unitChoice is UnitChoice.Custom
    assert (parameters.mmPerUnit, parameters.unitPercent) == (12.5, 5)


def test_landmarks_are_listed_by_name_and_can_be_renamed(host, module, loaded):
    table = module.ui.landmarksTable
    assert [table.item(row, 0).text() for row in range(2)] == ["left lobe", "right lobe"]
    table.item(0, 0).setText("segment II")
    assert loaded["landmarks"].GetNthControlPointLabel(0) == "segment II"


def test_a_landmark_far_from_the_organ_is_told(host, module, loaded):
    loaded["landmarks"].SetNthControlPointPositionWorld(0, 900, 0, 0)
    host.process()
    assert "left lobe" in module.ui.landmarksHintLabel.text
    assert module.ui.landmarksHintLabel.visible


def test_the_view_becomes_the_endoscope(host, module, parameters, loaded):
    module.ui.endoscopeViewButton.click()
    module.ui.useViewButton.click()
    host.process()
    assert parameters.cameraChoice is CameraChoice.FromView
    assert json.loads(parameters.cameraPosition) == pytest.approx([0, 0, 0], abs=1e-4)
    assert "scene units" in module.ui.cameraFactLabel.text


def test_a_view_not_taken_yet_is_told(host, module, parameters, loaded):
    parameters.cameraChoice = CameraChoice.FromView
    host.process()
    assert not module.ui.applyButton.enabled
    assert "Use" in module.ui.reasonLabel.text


def test_what_is_hidden_of_the_splat_is_counted(host, module, parameters, loaded):
    total = loaded["splat"].GetPolyData().GetNumberOfPoints()
    before = loaded["splat"].GetPolyData().GetNumberOfVerts()
    parameters.opacity = 0.6
    host.process()
    shown = loaded["splat"].GetPolyData().GetNumberOfVerts()
    assert shown < before
    assert module.ui.splatCountLabel.text.startswith(f"{shown:,} of {total:,}")
    module.ui.showAllButton.click()
    host.process()
    assert loaded["splat"].GetPolyData().GetNumberOfVerts() >= before


def test_floaters_are_previewed_and_removed(host, module, parameters, loaded):
    module.ui.previewFloatersButton.click()
    assert "floaters" in module.ui.splatCountLabel.text
    module.ui.removeFloatersButton.click()
    host.process()
    assert parameters.removeFloaters
    assert not module.ui.previewFloatersButton.checked
    assert "shown and used" in module.ui.splatCountLabel.text


def test_a_file_that_is_no_splat_is_told_in_the_panel(host, module, tmp_path, monkeypatch):
    wrong = tmp_path / "mesh.ply"
    wrong.write_text("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n")
    monkeypatch.setattr(qt.QFileDialog, "getOpenFileName", staticmethod(lambda *arguments: str(wrong)))
    module.ui.loadSplatButton.click()
    assert "mesh.ply" in module.ui.messageLabel.text
    assert host.record.dialogs == []


def test_the_layout_is_registered_once(host, module):
    for _ in range(2):
        module.ui.layoutButton.click()
    assert slicer.app.layoutManager().layout == LAYOUT_ID
    assert not host.record.vtk_errors


def test_parameters_come_back_with_the_scene(host, module, parameters, loaded, tmp_path):
    parameters.opacity, parameters.seed = 0.3, 7
    parameters.landmarkRadiusMm = 42
    host.process()
    assert slicer.util.saveScene(str(tmp_path / "scene.mrb"))
    slicer.mrmlScene.Clear(0)
    host.process()
    assert module.widget.panel.parameters.seed == 0
    assert not module.ui.applyButton.enabled
    slicer.util.loadScene(str(tmp_path / "scene.mrb"))
    host.process()
    back = module.widget.panel.parameters
    assert (back.opacity, back.seed, back.landmarkRadiusMm) == (0.3, 7, 42)
    assert back.splat is not None
    assert module.ui.seedSpinBox.value == 7
    assert module.ui.applyButton.enabled


def test_nothing_is_observed_after_the_panel_is_closed(host, module, loaded):
    panel = module.widget.panel
    host.close(module)
    assert [section for section in [panel, *panel.sections] if section.Observations] == []
    loaded["landmarks"].SetNthControlPointPositionWorld(0, 0, 0, 0)
    loaded["splat"].SetName("still there")


def test_weights_of_the_landmarks_are_shown_and_follow_the_radius(host, module, parameters, loaded, scene_contents):
    def weights():
        model = slicer.util.getNode("Landmark weights")
        return slicer.util.arrayFromModelPointData(model, "Landmark weight").copy()

    before = scene_contents()
    module.ui.showWeightsButton.click()
    parameters.landmarkRadiusMm = 20
    host.process()
    near = weights()
    parameters.landmarkRadiusMm = 80
    host.process()
    assert near.max() > 0.9
    assert weights().mean() > 2 * near.mean()
    module.ui.showWeightsButton.click()
    host.process()
    assert scene_contents() == before


def test_a_splat_that_lost_its_opacity_is_told(host, module, loaded):
    loaded["splat"].GetPolyData().GetPointData().RemoveArray("opacity")
    module.widget.panel.refresh()
    host.process()
    assert not module.ui.applyButton.enabled
    assert "splat" in module.ui.reasonLabel.text.lower()


def test_place_makes_a_point_list(host, module, parameters):
    module.ui.addLandmarksButton.click()
    assert parameters.landmarks is not None
    assert module.ui.landmarksPlaceWidget.placeModeEnabled
    assert not module.ui.addLandmarksButton.visible
    module.panel.exit()
    assert not module.ui.landmarksPlaceWidget.placeModeEnabled


def test_segmentation_shortcuts_are_offered_where_the_extensions_are(module, monkeypatch):
    assert not module.ui.segmentWithButton.visible
    monkeypatch.setattr(slicer.modules, "totalsegmentator", object(), raising=False)
    opened = []
    monkeypatch.setattr(slicer.util, "selectModule", opened.append)
    offer(module.ui.segmentWithButton)
    assert module.ui.segmentWithButton.visible
    actions = module.ui.segmentWithButton.menu().actions()
    assert [action.text for action in actions] == ["Segment with TotalSegmentator"]
    actions[0].trigger()
    assert opened == ["TotalSegmentator"]


def test_packages_that_are_declined_are_told_in_the_panel(host, module, loaded, monkeypatch):
    def declined(**_options):
        raise DependencyError("OrganPhys cannot run without plyfile: press Register again and accept.")

    monkeypatch.setattr(OrganPhysRegistrationLib.logic, "ensure_packages", declined)
    module.ui.applyButton.click()
    host.process()
    assert "press Register again" in module.ui.messageLabel.text
    assert module.ui.applyButton.text == "Register"
    assert module.ui.applyButton.enabled
    assert host.record.dialogs == []
