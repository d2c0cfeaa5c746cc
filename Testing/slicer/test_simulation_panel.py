"""The simulation panel with real preparations in the background and real steps by the timer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import qt
import slicer
import vtk

from OrganPhysRegistrationLib.inputs.splat_node import load_splat
from OrganPhysSimulationLib.choices import Colouring, GravityChoice, InstrumentChoice, TissueChoice

TIMEOUT = 120  # seconds
# Seconds that the event loop may stand still: a preparation on the main thread would take longer. The figure itself is
# measured by Testing/slicer/simulation_picture.py.
LONGEST_BLOCK = 1.0


@pytest.fixture
def chosen(host, simulation, simulation_files):
    """The example's organ and splat, chosen, with suggested pins."""
    organ = simulation.logic.loadOrgan(simulation_files.asset)
    splat = load_splat(simulation_files.splat, mm_per_unit=100)
    simulation.widget.panel.choose({"organ": organ, "splat": splat})
    host.process()
    simulation.ui.suggestPinsButton.click()
    host.process()
    return organ, splat


@pytest.fixture
def ready(host, simulation, chosen):
    """A simulation that is prepared and rests."""
    simulation.ui.stepButton.click()
    host.wait_until(lambda: not simulation.logic.busy, TIMEOUT)
    host.process()
    assert simulation.logic.session is not None, simulation.ui.messageLabel.text
    return simulation.logic.session


def test_empty_panel_says_what_to_do(host, simulation, screenshot):
    ui = simulation.ui
    assert not ui.startButton.enabled
    assert "sample data" in ui.startButton.toolTip
    screenshot(simulation.panel, "simulation_empty")
    assert simulation.panel.width <= 420


def test_start_runs_without_blocking_and_pause_rests(host, simulation, chosen, screenshot, view_png):
    ui, logic = simulation.ui, simulation.logic
    with host.latency_meter() as meter:
        ui.startButton.click()
        host.process()
        assert ui.startButton.text == "Cancel"
        assert ui.progressBar.visible
        host.wait_until(lambda: logic.running, TIMEOUT)
        host.wait(0.5)
    assert meter.longest < LONGEST_BLOCK
    assert ui.startButton.text == "Pause"
    assert not ui.progressBar.visible
    ui.insertionSlider.value = 1e3 * logic.session.live.joints_at_contact()[2]
    host.wait_until(lambda: logic.session.live.readings.last.contacts > 0, TIMEOUT)
    host.wait(0.3)
    assert ui.forceValue.text.endswith(" N")
    assert ui.stepValue.text.endswith(" ms")
    ui.jawButton.click()
    assert ui.jawSlider.value < 0
    host.wait_until(lambda: logic.session.live.readings.last.held > 0, TIMEOUT)
    screenshot(simulation.panel, "simulation_running")
    ui.startButton.click()
    stopped = logic.session.live.time_s
    host.wait(0.1)
    assert logic.session.live.time_s == stopped > 0
    ui.endoscopeViewButton.click()
    slicer.app.layoutManager().threeDWidget(0).view.window.SetSize(400, 300)
    view_png("simulation_grasp", fit=False)
    ui.undoButton.click()
    assert logic.session.live.time_s == 0


def test_edits_while_it_runs(host, simulation, ready):
    ui, logic, parameters = simulation.ui, simulation.logic, simulation.widget.panel.parameters
    ui.startButton.click()
    parameters.tissue, parameters.youngsKpa = TissueChoice.Kidney, 12.0
    host.process()
    assert "E 12.0 kPa" in ui.tissueNote.text
    assert logic.session.live.body.tissue.youngs_pa == pytest.approx(12e3)
    parameters.gravity = True
    host.process()
    assert np.linalg.norm(logic.session.live.options.gravity) == pytest.approx(9.80665)
    parameters.gravityChoice = GravityChoice.Arrow
    host.process()
    line = next(node for node in slicer.util.getNodesByClass("vtkMRMLMarkupsLineNode"))
    start = np.array(line.GetNthControlPointPositionWorld(0))
    line.SetNthControlPointPositionWorld(1, *(start - np.array([0, 0, 50])))
    host.process()
    world = logic.session.T_world_sim[:3, :3] @ logic.session.live.options.gravity
    assert world / np.linalg.norm(world) == pytest.approx([0, 0, -1], abs=1e-6)
    parameters.detail = True
    host.wait(0.2)
    parameters.pins.RemoveAllControlPoints()
    host.wait_until(lambda: logic.session.pins == () and not logic.busy, TIMEOUT)
    host.process()
    assert "no pins" in ui.messageLabel.text  # it falls: told
    assert logic.running


def test_colours_have_a_legend_with_unit(host, simulation, ready, view_png):
    parameters = simulation.widget.panel.parameters
    parameters.showSplat = False
    for colouring, unit in ((Colouring.Displacement, "(mm)"), (Colouring.Stretch, "(%)")):
        parameters.colouring = colouring
        host.process()
        node = simulation.logic.session.surface.node
        assert node.GetPolyData().GetPointData().GetScalars().GetName() == colouring.value
        legend = slicer.modules.colors.logic().GetColorLegendDisplayNode(node.GetDisplayNode())
        assert legend.GetVisibility() and unit in legend.GetTitleText()
    slicer.app.layoutManager().threeDWidget(0).view.window.SetSize(400, 300)
    simulation.ui.endoscopeViewButton.click()
    view_png("simulation_stretch", fit=False)


def test_record_and_play(host, simulation, ready):
    ui = simulation.ui
    ui.recordButton.checked = True
    ui.startButton.click()
    host.wait(0.5)
    ui.startButton.click()
    ui.recordButton.checked = False
    host.process()
    assert "frames" in ui.messageLabel.text
    ui.playButton.checked = True
    assert ui.playButton.text == "Stop"
    host.wait_until(lambda: not ui.playButton.checked, TIMEOUT)
    assert ui.frameSlider.value == ui.frameSlider.maximum


@pytest.fixture
def stepped(simulation, ready, tmp_path, monkeypatch):
    """A simulation of 30 steps; the folder that the dialog answers for its splat sequence."""
    simulation.logic.setJoints(ready.live.joints_at_contact(), jawDeg=30)
    simulation.logic.step(30)
    folder = tmp_path / "frames"
    monkeypatch.setattr(qt.QFileDialog, "getExistingDirectory", staticmethod(lambda *arguments: str(folder)))
    return folder


def test_the_splat_sequence_is_written_beside_the_window(host, simulation, stepped, screenshot):
    ui, logic = simulation.ui, simulation.logic
    ui.startButton.click()
    ui.filesButton.collapsed = False
    with host.latency_meter() as meter:
        ui.exportSequenceButton.click()
        frames, stopped = logic.sequence.frames, logic.session.live.time_s
        assert not logic.running and not ui.startButton.enabled
        host.wait_until(lambda: ui.progressBar.value > 0, TIMEOUT)
        assert ui.exportSequenceButton.text == "Cancel" and "Writing the splat" in ui.progressBar.format
        screenshot(simulation.panel, "simulation_writing")
        host.wait_until(lambda: not logic.busy, TIMEOUT)
    host.process()
    assert meter.longest < LONGEST_BLOCK
    assert logic.session.live.time_s == stopped
    assert len(list(stepped.glob("splat_*.ply"))) == frames > 30
    assert "Written" in ui.messageLabel.text
    assert ui.exportSequenceButton.text == "Splat sequence..." and not ui.progressBar.visible
    assert ui.startButton.enabled


@pytest.mark.parametrize("how", ["button", "scene"])
def test_a_splat_sequence_given_up_leaves_nothing(host, simulation, stepped, how):
    ui, logic = simulation.ui, simulation.logic
    ui.exportSequenceButton.click()
    host.wait_until(lambda: logic.sequence.fraction > 0, TIMEOUT)
    thread = logic._work._thread
    if how == "button":
        ui.exportSequenceButton.click()
    else:
        slicer.mrmlScene.Clear(0)
    host.wait_until(lambda: not logic.busy, TIMEOUT)
    thread.join(TIMEOUT)
    host.process()
    assert list(stepped.parent.iterdir()) == []
    assert logic.sequence is None and not ui.progressBar.visible
    if how == "button":
        assert "given up" in ui.messageLabel.text and ui.exportSequenceButton.enabled


def test_another_instrument_or_organ_ends_the_simulation(host, simulation, ready):
    parameters = simulation.widget.panel.parameters
    parameters.instrument = InstrumentChoice.ProGrasp
    host.process(5)
    assert simulation.logic.session is None
    assert "press Start" in simulation.ui.messageLabel.text
    assert simulation.ui.forceValue.text == "–"


@pytest.mark.parametrize("what", ["organ", "splat", "surface"])
def test_a_node_removed_while_it_runs_ends_it(host, simulation, ready, chosen, what):
    logic = simulation.logic
    simulation.ui.startButton.click()
    host.wait(0.1)
    own = {"organ": chosen[0], "splat": chosen[1], "surface": ready.surface.node}
    slicer.mrmlScene.RemoveNode(own[what])
    host.process(5)
    assert logic.session is None and not logic.running
    assert "was removed" in simulation.ui.messageLabel.text
    assert simulation.ui.startButton.text == "Start"


def test_a_scene_closed_while_it_runs_leaves_nothing(host, simulation, ready, scene_contents):
    renderer = slicer.app.layoutManager().threeDWidget(0).view.renderer
    simulation.ui.startButton.click()
    host.wait(0.1)
    slicer.mrmlScene.Clear(0)
    host.wait(0.2)
    assert simulation.logic.session is None and not simulation.logic.running
    left = [line for line in scene_contents() if "SubjectHierarchy" not in line and "OrganPhysSimulation" not in line]
    assert left == []
    actors = renderer.GetActors()
    mappers = [actors.GetItemAsObject(k).GetMapper() for k in range(actors.GetNumberOfItems())]
    assert not any(isinstance(mapper, vtk.vtkPointGaussianMapper) for mapper in mappers)
    simulation.panel.exit()
    simulation.panel.enter()


def test_a_scene_closed_or_a_cancel_while_it_is_prepared(host, simulation, chosen):
    ui, logic = simulation.ui, simulation.logic
    ui.startButton.click()
    host.process()
    ui.startButton.click()  # cancel
    assert not logic.busy and logic.session is None
    assert "given up" in ui.messageLabel.text
    ui.startButton.click()
    host.process()
    slicer.mrmlScene.Clear(0)
    host.wait(1.0)
    assert not logic.busy and logic.session is None


def test_leaving_the_module_rests_and_reload_ends_it(host, simulation, ready):
    simulation.ui.startButton.click()
    host.wait(0.1)
    simulation.panel.exit()
    assert not simulation.logic.running
    simulation.panel.enter()
    assert simulation.logic.session is not None
    simulation.ui.startButton.click()
    logic = simulation.logic
    host.close(simulation)  # as Reload does
    assert logic.session is None and not logic.running
    host.show(simulation)
    assert simulation.logic.session is None


def test_self_test_of_the_module_passes(simulation, monkeypatch):
    """Its registration searches less than in Slicer, to save time: the grasp is what is tested."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "core")
    from session_examples import small_problem

    test = simulation.python.OrganPhysSimulationTest()
    with small_problem():
        test.runTest()
