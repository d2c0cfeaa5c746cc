"""The host's parameterNodeWrapper: what a module relies on in Slicer's own."""

from __future__ import annotations

import enum
from typing import Annotated

import ctk
import pytest
import qt
import slicer
from slicer.parameterNodeWrapper import WithinRange, parameterNodeWrapper


class Unit(enum.Enum):
    UNKNOWN = "unknown"
    METRE = "metre"


@parameterNodeWrapper
class Parameters:
    model: slicer.vtkMRMLModelNode
    opacity: Annotated[float, WithinRange(0, 1)] = 0.1
    seed: int = 3
    name: str
    shown: bool = True
    unit: Unit


@pytest.fixture
def node(scene):
    return scene.AddNewNodeByClass("vtkMRMLScriptedModuleNode", "parameters")


def bound_panel(scene) -> tuple[qt.QWidget, dict[str, qt.QWidget]]:
    """A panel with one widget for each parameter."""
    panel, layout = qt.QWidget(), qt.QVBoxLayout()
    panel.setLayout(layout)
    widgets = {
        "model": slicer.qMRMLNodeComboBox(),
        "opacity": ctk.ctkSliderWidget(),
        "seed": qt.QSpinBox(),
        "name": qt.QLineEdit(),
        "shown": qt.QCheckBox(),
        "unit": qt.QComboBox(),
    }
    widgets["model"].noneEnabled = True
    widgets["model"].setMRMLScene(scene)
    for name, widget in widgets.items():
        widget.setProperty("SlicerParameterName", name)
        layout.addWidget(widget)
    return panel, widgets


def test_defaults_and_ranges(node):
    parameters = Parameters(node)
    assert (parameters.model, parameters.opacity, parameters.seed, parameters.unit) == (None, 0.1, 3, Unit.UNKNOWN)
    with pytest.raises(ValueError, match="within"):
        parameters.opacity = 2.0
    with pytest.raises(ValueError, match="seed"):
        parameters.seed = "three"


def test_values_go_both_ways_between_node_and_widgets(scene, node):
    panel, widgets = bound_panel(scene)
    parameters = Parameters(node)
    tag = parameters.connectGui(panel)
    assert widgets["opacity"].maximum == 1 and widgets["seed"].value == 3

    widgets["opacity"].value = 0.5
    widgets["unit"].currentIndex = 1
    widgets["shown"].checked = False
    widgets["name"].text = "liver"
    assert (parameters.opacity, parameters.unit, parameters.shown, parameters.name) == (0.5, Unit.METRE, False, "liver")

    parameters.seed, parameters.unit = 9, Unit.UNKNOWN
    parameters.model = scene.AddNewNodeByClass("vtkMRMLModelNode", "organ")
    assert widgets["seed"].value == 9 and widgets["unit"].currentIndex == 0
    assert widgets["model"].currentNode().GetName() == "organ"

    parameters.disconnectGui(tag)
    widgets["seed"].value = 4
    assert parameters.seed == 9


def test_parameters_survive_saving_the_scene(host, scene, node, tmp_path):
    parameters = Parameters(node)
    parameters.unit, parameters.opacity = Unit.METRE, 0.75
    parameters.model = scene.AddNewNodeByClass("vtkMRMLModelNode", "organ")
    assert slicer.util.saveScene(str(tmp_path / "scene.mrb"))
    host.clear_scene()
    slicer.util.loadScene(str(tmp_path / "scene.mrb"))
    again = Parameters(slicer.util.getNode("parameters"))
    assert (again.unit, again.opacity, again.model.GetName()) == (Unit.METRE, 0.75, "organ")
