"""Messages of the modules that no other test raises: nodes that were removed, moved or are of the wrong kind."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import slicer
import vtk
from outcome_example import organ, outcome, segmentation_node, splat_node

from organphys.exports.gaussian_ply import write_gaussians
from organphys.ground.checks import InputError
from organphys.points.gaussians import Gaussians
from organphys.points.point_sets import Landmarks
from OrganPhysRegistrationLib.inputs import camera_input
from OrganPhysRegistrationLib.inputs.matrices import matrix_of
from OrganPhysRegistrationLib.inputs.splat_landmarks import _first_used
from OrganPhysRegistrationLib.inputs.splat_scale import mm_per_unit_of, set_scale
from OrganPhysRegistrationLib.outputs.apply_transform import take_out
from OrganPhysRegistrationLib.outputs.case_nodes import write_grids, write_outcome
from OrganPhysRegistrationLib.outputs.live_case import write_live
from OrganPhysRegistrationLib.outputs.live_overlay import LiveOverlay
from OrganPhysRegistrationLib.outputs.overlay_frame import T_overlay_scene, world_from
from OrganPhysRegistrationLib.outputs.stage_switch import show_stage
from OrganPhysRegistrationLib.outputs.undo import begin_run
from OrganPhysRegistrationLib.panel import camera_section
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs
from OrganPhysRegistrationLib.runs.run_manager import RunManager
from OrganPhysSimulationLib import runs
from OrganPhysSimulationLib.inputs.splat_input import gaussians_of_file
from OrganPhysSimulationLib.logic import OrganPhysSimulationLogic
from OrganPhysSimulationLib.outputs import export
from OrganPhysSimulationLib.outputs.export import export_splat, export_surface
from OrganPhysSimulationLib.panel import organ_section
from OrganPhysSimulationLib.panel.run_section import RunSection


@pytest.fixture
def splat(scene):
    return splat_node(scene)


@pytest.fixture
def segmentation(scene):
    return segmentation_node(scene)


@pytest.fixture
def rigid_case(splat, segmentation):
    segment_id = segmentation.GetSegmentation().GetNthSegmentID(0)
    return write_outcome(outcome("rigid"), segmentation=segmentation, segment_id=segment_id, splat=splat)


def deforming(scene):
    """A transform node that is not linear."""
    node = scene.AddNewNodeByClass("vtkMRMLTransformNode", "bent")
    spline = vtk.vtkThinPlateSplineTransform()
    spline.SetBasisToR()
    for landmarks, shift in ((spline.SetSourceLandmarks, 0.0), (spline.SetTargetLandmarks, 0.3)):
        points = vtk.vtkPoints()
        for place in np.vstack([np.eye(3), np.zeros(3)]) * (1 + shift * np.arange(4)[:, None]):
            points.InsertNextPoint(place)
        landmarks(points)
    node.SetAndObserveTransformToParent(spline)
    return node


def test_results_that_a_rigid_case_lacks(rigid_case):
    with pytest.raises(InputError, match="the elastic stage has not been run for this case; shown can be: before"):
        show_stage(rigid_case, "elastic")
    with pytest.raises(InputError, match="grids: they belong to an elastic result, and the rigid stage"):
        write_grids(rigid_case, None)
    with pytest.raises(InputError, match="the registered surface was removed from the scene"):
        write_live(rigid_case, outcome())


def test_splats_without_their_scale(splat):
    parent = splat.GetParentTransformNode()
    parent.SetMatrixTransformToParent(matrix_of(np.diag([1.0, 1, -1, 1])))
    with pytest.raises(InputError, match="it mirrors or flattens the splat; reset its matrix"):
        set_scale(splat, 50.0, "stated")
    splat.RemoveAttribute("OrganPhys.MmPerUnit")
    with pytest.raises(InputError, match="has no scale; load"):
        mm_per_unit_of(splat)


def test_splats_under_deformations(host, scene, splat):
    bent = deforming(scene)
    with pytest.raises(InputError, match="bent: is not linear; the splat can only stand under linear"):
        world_from(bent)
    splat.SetAndObserveTransformNodeID(bent.GetID())
    with pytest.raises(InputError, match="stands under a non-linear transform; take it out or harden it"):
        T_overlay_scene(splat, scene.AddNewNodeByClass("vtkMRMLLinearTransformNode", "frame"))
    assert all("transform is not linear" in text for text in host.record.vtk_errors)
    host.record.vtk_errors.clear()


def test_live_surface_of_another_case(splat):
    live = LiveOverlay(splat, organ().faces)
    with pytest.raises(InputError, match="live overlay: expected at least"):
        live.update(organ().scene_vertices[:3])
    live.remove()


def test_node_put_there_by_hand(scene, rigid_case):
    model, between = (scene.AddNewNodeByClass(f"vtkMRML{kind}Node") for kind in ("Model", "LinearTransform"))
    between.SetAndObserveTransformNodeID(rigid_case.node("ct_to_scene").GetID())
    model.SetAndObserveTransformNodeID(between.GetID())
    with pytest.raises(InputError, match="which OrganPhys has not put there"):
        take_out(rigid_case, model)


def test_nothing_to_undo(scene, splat, segmentation):
    undo = begin_run(segmentation, segmentation.GetSegmentation().GetNthSegmentID(0), splat)
    scene.RemoveNode(splat)
    with pytest.raises(InputError, match="the splat of this run is no longer in the scene"):
        undo.undo()
    manager = RunManager()
    with pytest.raises(InputError, match="There is no run to undo"):
        manager.undo()
    manager.close()


def test_live_update_of_the_slow_method(rigid_case, splat, segmentation):
    manager, segment_id = RunManager(), segmentation.GetSegmentation().GetNthSegmentID(0)
    with pytest.raises(InputError, match="only the method OrganPhys is quick enough"):
        manager.start_live(RunInputs(segmentation, segment_id, splat, method="paper"), None)
    manager.close()


def test_landmarks_beyond_those_in_use():
    with pytest.raises(InputError, match="none of them belongs to the first 2 landmarks"):
        _first_used(Landmarks(np.zeros((4, 3)), points_scene=np.zeros((1, 3)), pairs=(3,)))


def test_splat_of_another_file(splat, tmp_path):
    with pytest.raises(InputError, match="does not say which file it came from"):
        gaussians_of_file(splat)
    one = Gaussians(
        means=np.zeros((1, 3)), log_scales=np.zeros((1, 3)), quaternions=np.eye(4)[:1], opacity_logits=np.zeros(1),
        sh_dc=np.zeros((1, 3)), sh_rest=np.zeros((1, 3, 0)), valid=np.ones(1, dtype=bool),
    )  # fmt: skip
    write_gaussians(tmp_path / "one.ply", one)
    splat.SetAttribute("OrganPhys.SplatFile", str(tmp_path / "one.ply"))
    with pytest.raises(InputError, match="holds another number of Gaussians than Splat"):
        gaussians_of_file(splat)


def test_simulation_without_its_splat(splat, tmp_path, monkeypatch):
    live = SimpleNamespace(followers=SimpleNamespace(binding=None))
    with pytest.raises(InputError, match="the simulation runs without one"):
        export_splat(live, None, tmp_path / "splat.ply")
    monkeypatch.setattr(runs, "organ_of", lambda node: organ())
    monkeypatch.setattr(runs, "splat_of_organ", lambda node: splat)
    other = SimpleNamespace(GetName=lambda: "other")
    with pytest.raises(InputError, match="other was registered onto Splat; choose that one"):
        runs.gathered(
            other, other, pins=None, box=None, pin_radius_mm=1.0, tissue="", youngs_kpa=0.0, gravity=None,
            instrument="prograsp", detail=False,
        )  # fmt: skip


def test_a_child_that_is_just_stopping(splat, segmentation, monkeypatch):
    manager, segment_id = RunManager(), segmentation.GetSegmentation().GetNthSegmentID(0)
    monkeypatch.setattr(manager, "_session", SimpleNamespace(process=SimpleNamespace(busy=True)))
    with pytest.raises(InputError, match="Live update is just stopping"):
        manager.start(RunInputs(segmentation, segment_id, splat), ("coarse",), None)


def test_a_splat_of_which_nothing_is_shown(splat, monkeypatch):
    monkeypatch.setattr(
        camera_input, "shown_gaussians", lambda node: np.zeros(splat.GetPolyData().GetNumberOfPoints(), bool)
    )
    with pytest.raises(InputError, match="nothing of it is shown; lower the opacity"):
        camera_input._shown_points(splat)


def test_layouts_without_a_3d_view(monkeypatch):
    layout = SimpleNamespace(threeDWidget=lambda number: None)
    for module in (camera_section, organ_section):
        monkeypatch.setattr(module, "slicer", SimpleNamespace(app=SimpleNamespace(layoutManager=lambda: layout)))
    with pytest.raises(InputError, match="There is no 3D view: choose the CT and 3D layout first"):
        camera_section.CameraSection._view_node(None)
    with pytest.raises(InputError, match="There is no 3D view: choose a layout with one first"):
        organ_section.OrganSection.look_from_endoscope.__wrapped__(None)


def test_a_simulation_without_an_organ():
    panel = SimpleNamespace(parameters=SimpleNamespace(organ=None))
    with pytest.raises(InputError, match="organ: none chosen; choose a registered organ or take the sample"):
        RunSection._prepare(SimpleNamespace(panel=panel), None)


def test_a_surface_that_cannot_be_written(scene, splat, tmp_path, monkeypatch):
    class Refusing(slicer.vtkMRMLModelStorageNode):
        def WriteData(self, node):
            return 0

    monkeypatch.setattr(slicer, "vtkMRMLModelStorageNode", Refusing)
    monkeypatch.setattr(export, "T_world_sim", lambda frame: np.eye(4))
    with pytest.raises(InputError, match="cannot be written; choose a folder that you may write to"):
        export_surface(splat, None, tmp_path / "organ.stl")
    assert list(tmp_path.iterdir()) == []


def test_simulation_that_is_busy(scene):
    logic = OrganPhysSimulationLogic()
    logic.session, logic._work = object(), SimpleNamespace(running=True, drop=lambda: None)
    with pytest.raises(InputError, match="busy changing its pins; wait"):
        logic.reset()
    with pytest.raises(InputError, match="something is being prepared; wait"):
        logic._in_background(None, None, None)
    logic.session = logic._work = None
    logic.cleanup()
    assert slicer.mrmlScene is scene
