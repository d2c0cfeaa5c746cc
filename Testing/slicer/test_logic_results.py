"""What the logic does with a finished case, and which organphys it says it uses."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import outcome_example as example
import pytest
import qt
import slicer
from vtk.util.numpy_support import vtk_to_numpy

import organphys
from organphys.asset.asset_file import load_asset
from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.outputs.case_nodes import write_outcome
from OrganPhysRegistrationLib.runs import core_in_use
from OrganPhysRegistrationLib.runs.stepped_work import SteppedWork, run_at_once


@pytest.fixture
def logic(scene: object) -> Iterator[OrganPhysRegistrationLogic]:
    made = OrganPhysRegistrationLogic()
    yield made
    made.cleanup()


@pytest.fixture
def case(scene: Any) -> Any:
    """An elastic result; its grid is coarse, which matters nowhere here."""
    segmentation = example.segmentation_node(scene)
    return write_outcome(
        example.outcome(sampled=False, grids=example.grids(25.0)),
        segmentation=segmentation,
        segment_id=segmentation.GetSegmentation().GetNthSegmentID(0),
        splat=example.splat_node(scene),
    )


def test_one_segment_goes_under_the_transform(logic: OrganPhysRegistrationLogic, case: Any, scene: Any) -> None:
    """One of two segments that stand under a transform of the user's; the source stays as it is."""
    source = case.segmentation
    source.GetSegmentation().AddEmptySegment("tumour", "tumour")
    shift = scene.AddNewNodeByClass("vtkMRMLLinearTransformNode", "Shift")
    source.SetAndObserveTransformNodeID(shift.GetID())
    node = logic.applyTransformToSegment(case, source, case.segment_id)
    assert list(node.GetSegmentation().GetSegmentIDs()) == [case.segment_id]
    kept = node.GetParentTransformNode()  # the shift is applied first
    assert kept.GetParentTransformNode() is case.node("ct_to_scene")
    assert source.GetParentTransformNode() is shift and source.GetSegmentation().GetNumberOfSegments() == 2
    with pytest.raises(InputError, match="choose"):
        logic.applyTransformToSegment(case, source, "no such segment")


@pytest.mark.parametrize(
    ("what", "name", "written"),
    [
        ("surface", "liver.ply", "liver.ply"),
        ("surface", "liver", "liver.stl"),
        ("asset", "liver", "liver.organphys"),
        ("transform", "ct_to_scene", "ct_to_scene.h5"),
        ("transform", "ct_to_scene.nrrd", "ct_to_scene.nrrd"),
        ("report", "report.html", "report.html"),
        ("report", "", "report.html"),
    ],
)
def test_exports_are_written_and_named(
    logic: OrganPhysRegistrationLogic, case: Any, tmp_path: Path, what: str, name: str, written: str
) -> None:
    assert logic.export(case, what, tmp_path / name) == str(tmp_path / written)
    assert (tmp_path / written).stat().st_size > 1000


def test_exports_hold_the_result(logic: OrganPhysRegistrationLogic, case: Any, tmp_path: Path) -> None:
    organ = load_asset(logic.export(case, "asset", tmp_path / "organ"))
    np.testing.assert_allclose(organ.scene_vertices, example.organ().scene_vertices)
    surface = slicer.util.loadModel(logic.export(case, "surface", tmp_path / "organ.ply"))
    points = vtk_to_numpy(surface.GetPolyData().GetPoints().GetData())
    expected = example.true_world_points(case, organ.vertices)
    np.testing.assert_allclose(points.min(0), expected.min(0), atol=0.5)
    np.testing.assert_allclose(points.max(0), expected.max(0), atol=0.5)
    transform = slicer.util.loadTransform(logic.export(case, "transform", tmp_path / "ct_to_scene"))
    some = organ.volume_points[::100]
    overlay = example.world_points(case.node("ct_to_scene"), some)
    np.testing.assert_allclose(example.world_points(transform, some), overlay, atol=1e-3)


@pytest.mark.parametrize(("what", "name"), [("picture", "a.png"), ("surface", "a.txt")])
def test_what_cannot_be_exported_is_told(
    logic: OrganPhysRegistrationLogic, case: Any, tmp_path: Path, what: str, name: str
) -> None:
    with pytest.raises(InputError):
        logic.export(case, what, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_the_core_in_use_is_logged(caplog: pytest.LogCaptureFixture, logic: OrganPhysRegistrationLogic) -> None:
    with caplog.at_level(logging.INFO):
        core_in_use.log_core_in_use()
    assert f"organphys {organphys.__version__}, {organphys.__file__}" in caplog.text
    assert logic.organphysInUse().own and logic.organphysInUse().warning is None


def test_a_copy_that_shadows_the_modules_own_is_warned_of(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(organphys, "__file__", "/slicer/lib/site-packages/organphys/__init__.py")
    core = core_in_use.log_core_in_use()
    assert not core.own and "pip_uninstall('organphys')" in caplog.text


def test_stepped_work_gives_the_loop_a_turn_at_every_step(host: Any) -> None:
    order: list[str] = []

    def steps() -> Iterator[None]:
        for k in range(3):
            order.append(f"step {k}")
            yield

    timer = qt.QTimer()
    timer.connect("timeout()", lambda: order.append("turn"))
    timer.start(0)
    done: list[Any] = []
    SteppedWork(steps(), on_done=done.append, on_error=done.append)
    host.wait_until(lambda: done, timeout=10)
    timer.stop()
    assert done == [None]
    places = [order.index(f"step {k}") for k in range(3)]
    assert all("turn" in order[first:second] for first, second in pairwise(places))


def test_stepped_work_passes_errors_on_and_stops(host: Any) -> None:
    told: list[Any] = []

    def fails() -> Iterator[None]:
        yield
        raise ValueError("no")

    SteppedWork(fails(), on_done=told.append, on_error=told.append)
    host.wait_until(lambda: told, timeout=10)
    assert isinstance(told[0], ValueError)
    closed: list[bool] = []

    def waits() -> Iterator[None]:
        try:
            while True:
                yield
        finally:
            closed.append(True)

    work = SteppedWork(waits(), on_done=told.append, on_error=told.append)
    host.wait(0.05)
    work.stop()
    assert closed and len(told) == 1


def test_steps_run_at_once_give_their_result() -> None:
    def steps() -> Iterator[None]:
        yield
        return 3

    assert run_at_once(steps()) == 3
