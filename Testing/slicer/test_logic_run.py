"""A run from start to nodes, and every other way it can end: nothing is left over, and plain words say what to do."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import outcome_example as example
import pytest
import slicer

from organphys.pipeline.outcome_files import save_outcome
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.outputs.snapshot import remove_case
from OrganPhysRegistrationLib.runs.live_view import LiveView
from OrganPhysRegistrationLib.runs.result_nodes import result_steps
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs
from OrganPhysRegistrationLib.runs.run_manager import BUSY
from OrganPhysRegistrationLib.runs.run_process import RunProcess

FAKE = Path(__file__).with_name("fake_server.py")


@pytest.fixture(scope="module")
def outcomes(host: object, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the fake server answers with."""
    folder = tmp_path_factory.mktemp("outcomes")
    for stage in ("coarse", "rigid", "elastic"):
        save_outcome(example.outcome(stage, sampled=False), folder / stage)
    save_outcome(example.outcome(sampled=False, grids=example.grids(25.0)), folder / "grids")
    np.save(folder / "surface.npy", example.organ().scene_vertices.astype(np.float32))
    return folder


@pytest.fixture
def make_logic(outcomes: Path, scene: object) -> Iterator[Callable[..., OrganPhysRegistrationLogic]]:
    """Logic whose process misbehaves as told, ``at`` "STAGE=WHAT"."""
    made: list[OrganPhysRegistrationLogic] = []

    def make(at: str = "") -> OrganPhysRegistrationLogic:
        def arguments(folder: Path) -> list[str]:
            return [str(FAKE), "--folder", str(folder), "--outcomes", str(outcomes), *(["--at", at] if at else [])]

        made.append(OrganPhysRegistrationLogic(process=RunProcess(arguments)))
        return made[-1]

    yield make
    for logic in made:
        logic.cleanup()


@pytest.fixture
def inputs(scene: object) -> RunInputs:
    """Segment, splat and a landmark."""
    landmarks = scene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "Landmarks")
    landmarks.AddControlPoint(example.organ().vertices[0].tolist(), "tip")
    segmentation = example.segmentation_node(scene)
    segment_id = segmentation.GetSegmentation().GetNthSegmentID(0)
    return RunInputs(segmentation, segment_id, example.splat_node(scene), landmarks=landmarks)


class Told:
    """What a run has told so far."""

    def __init__(self) -> None:
        self.progress: list[tuple[str, float]] = []
        self.surfaces: list[Any] = []
        self.done: list[Any] = []
        self.transforms: list[Any] = []
        self.failed: list[tuple[str, str]] = []

    @property
    def callbacks(self) -> dict[str, Callable[..., None]]:
        return {
            "onProgress": lambda stage, fraction: self.progress.append((stage, fraction)),
            "onSurface": self.surfaces.append,
            "onDone": self.done.append,
            "onTransform": self.transforms.append,
            "onFailed": lambda code, message: self.failed.append((code, message)),
        }


def finish(host: Any, run: Any) -> None:
    host.wait_until(lambda: run.finished, timeout=30)


def splat_place(inputs: RunInputs) -> tuple[Any, ...]:
    """Where the splat stands, and its attributes."""
    mover = inputs.splat.GetParentTransformNode()
    data = slicer.util.arrayFromTransformMatrix(mover)
    names = inputs.splat.GetAttributeNames()
    return mover.GetTransformNodeID(), data.tobytes(), tuple((name, inputs.splat.GetAttribute(name)) for name in names)


def test_all_stages_then_the_transforms(host: Any, make_logic: Callable, inputs: RunInputs) -> None:
    logic, told = make_logic(), Told()
    run = logic.startRun(inputs, **told.callbacks)
    finish(host, run)
    assert told.failed == [] and told.done == told.transforms == [run.case]
    assert run.case.stages == ["before", "coarse", "rigid", "elastic"]
    assert run.case.node("ct_to_scene").GetAttribute("OrganPhys.Transform") == "elastic"
    fractions = [fraction for _, fraction in told.progress]
    assert fractions == sorted(fractions) and fractions[0] < 0.1 and fractions[-1] == 1.0
    assert len(told.surfaces) == 3  # after coarse, after rigid, and one of the elastic stage
    assert not slicer.util.getNodesByClass("vtkMRMLModelNode")[-1].GetName().startswith("OrganPhys live")


def test_single_steps_go_on_from_each_other(host: Any, make_logic: Callable, inputs: RunInputs) -> None:
    logic, asked = make_logic(), list[str]()
    for stage, expected in (("coarse", ["load", "coarse"]), ("rigid", ["rigid"]), ("elastic", ["elastic"])):
        asked.clear()
        run = logic.startRun(inputs, (stage,), onProgress=lambda stage, fraction: asked.append(stage))
        finish(host, run)
        assert [name for name in dict.fromkeys(asked) if name not in ("results", "prepare")] == expected
        assert run.case.stage == stage


def test_a_pose_set_by_hand_reaches_the_child(
    host: Any, make_logic: Callable, inputs: RunInputs, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[tuple[str, Any]] = []
    request = RunProcess.request
    monkeypatch.setattr(
        RunProcess,
        "request",
        lambda self, do, listener, **fields: (sent.append((do, fields)), request(self, do, listener, **fields))[1],
    )
    logic, pose = make_logic(), np.diag([0.01, 0.01, 0.01, 1.0])
    finish(host, logic.startRun(inputs, ("rigid", "elastic"), start=pose))
    assert [do for do, _ in sent] == ["load", "coarse", "rigid", "elastic", "grids"]
    assert sent[2][1] == {"start": pose.tolist()} and sent[3][1] == {}


def test_changed_inputs_are_loaded_again(
    host: Any, make_logic: Callable, inputs: RunInputs, monkeypatch: pytest.MonkeyPatch
) -> None:
    logic, asked, faces = make_logic(), list[str](), list[Any]()
    finish(host, logic.startRun(inputs, ("coarse", "rigid")))
    monkeypatch.setattr(LiveView, "start", lambda self, known: faces.append(known))
    finish(host, logic.startRun(inputs, ("rigid",)))
    assert faces[0] is not None
    faces.clear()
    inputs.landmarks.SetNthControlPointPosition(0, *example.organ().vertices[50].tolist())
    finish(host, logic.startRun(inputs, ("rigid",), onProgress=lambda stage, fraction: asked.append(stage)))
    assert {"load", "coarse", "rigid"} <= set(asked)
    assert faces[0] is None  # those known may be another organ's


@pytest.mark.parametrize("stage", ["load", "coarse", "elastic", "grids"])
@pytest.mark.parametrize("how", ["slow", "hang"])
def test_cancel_restores_the_scene(
    host: Any, make_logic: Callable, inputs: RunInputs, scene_contents: Callable, stage: str, how: str
) -> None:
    before, place = scene_contents(), splat_place(inputs)
    logic, told = make_logic(f"{stage}={how}"), Told()
    run = logic.startRun(inputs, **told.callbacks)
    reached = (lambda: told.done) if stage == "grids" else (lambda: any(name == stage for name, _ in told.progress))
    host.wait_until(reached, timeout=30)
    host.wait(0.1)
    began = time.monotonic()
    run.cancel()
    assert run.state == "cancelling" and scene_contents() == before
    finish(host, run)
    assert time.monotonic() - began < 5
    assert told.failed == [("cancelled", "The registration was cancelled.")] and told.transforms == []
    assert scene_contents() == before and splat_place(inputs) == place
    assert not logic.canUndo()


def test_cancel_before_the_child_is_asked(
    host: Any, make_logic: Callable, inputs: RunInputs, scene_contents: Callable
) -> None:
    before, logic, told = scene_contents(), make_logic(), Told()
    run = logic.startRun(inputs, **told.callbacks)
    run.cancel()
    assert run.finished and [code for code, _ in told.failed] == ["cancelled"] and scene_contents() == before
    again = logic.startRun(inputs)
    finish(host, again)
    assert again.case is not None


def test_cancelling_a_second_run_brings_the_first_result_back(
    host: Any, make_logic: Callable, inputs: RunInputs, scene_contents: Callable
) -> None:
    first = make_logic().startRun(inputs)
    finish(host, first)
    before, mesh = scene_contents(), first.case.node("surface_elastic").GetPolyData()
    second = make_logic("grids=slow").startRun(inputs)
    host.wait_until(lambda: second.state == "sampling", timeout=30)
    second.cancel()
    finish(host, second)
    assert scene_contents() == before
    assert first.case.node("surface_elastic").GetPolyData() is mesh
    assert first.case.node("ct_to_scene").GetAttribute("OrganPhys.Transform") == "elastic"


def test_a_result_given_up_when_it_is_just_written_is_undone(
    inputs: RunInputs, outcomes: Path, scene_contents: Callable
) -> None:
    before, place = scene_contents(), splat_place(inputs)
    steps = result_steps(outcomes / "elastic", inputs)
    while scene_contents() == before:
        next(steps)
    steps.close()
    assert scene_contents() == before and splat_place(inputs) == place


def test_undo_goes_back_run_by_run(
    host: Any, make_logic: Callable, inputs: RunInputs, scene_contents: Callable
) -> None:
    before, place, logic = scene_contents(), splat_place(inputs), make_logic()
    assert not logic.canUndo()
    for stages in (("coarse",), ("rigid",)):
        finish(host, logic.startRun(inputs, stages))
    assert logic.canUndo() and logic.undo().stage == "coarse"
    assert logic.undo() is None
    assert scene_contents() == before and splat_place(inputs) == place and not logic.canUndo()


@pytest.mark.parametrize(
    ("at", "code", "words"),
    [
        ("coarse=refused", "input", "Landmark 1 lies 80 mm from the organ; check it."),
        ("elastic=crash", "internal", "no more memory"),
        ("rigid=garbage", "internal", "cannot be read"),
    ],
)
def test_a_failure_is_told_and_leaves_nothing(
    host: Any, make_logic: Callable, inputs: RunInputs, scene_contents: Callable, at: str, code: str, words: str
) -> None:
    before, logic, told = scene_contents(), make_logic(at), Told()
    finish(host, logic.startRun(inputs, **told.callbacks))
    [(found, message)] = told.failed
    assert found == code and words in message and "\n" not in message
    assert told.done == [] and scene_contents() == before
    assert logic.problems(inputs) == []  # nothing stands in the way of the next try


def test_without_grids_the_surfaces_stand(host: Any, make_logic: Callable, inputs: RunInputs) -> None:
    logic, told = make_logic("grids=crash"), Told()
    run = logic.startRun(inputs, **told.callbacks)
    finish(host, run)
    assert [code for code, _ in told.failed] == ["transform"] and told.done == [run.case]
    assert run.case.get("surface_elastic") is not None and logic.canUndo()


@pytest.mark.parametrize(
    ("role", "name"), [("splat", "splat"), ("segmentation", "segmentation"), ("landmarks", "land")]
)
def test_an_input_that_is_deleted_stops_the_run(
    host: Any, make_logic: Callable, inputs: RunInputs, scene_contents: Callable, role: str, name: str
) -> None:
    logic, told = make_logic("elastic=slow"), Told()
    run = logic.startRun(inputs, **told.callbacks)
    host.wait_until(lambda: len(told.surfaces) > 1, timeout=30)
    slicer.mrmlScene.RemoveNode(getattr(inputs, role))
    finish(host, run)
    [(code, message)] = told.failed
    assert code == "input" and name in message and "choose another" in message
    assert not [line for line in scene_contents() if "OrganPhys" in line or "surface" in line]


def test_a_closed_scene_stops_the_run(host: Any, make_logic: Callable, inputs: RunInputs) -> None:
    logic, told = make_logic("elastic=slow"), Told()
    run = logic.startRun(inputs, **told.callbacks)
    host.wait_until(lambda: len(told.surfaces) > 1, timeout=30)
    slicer.mrmlScene.Clear(0)
    finish(host, run)
    assert [code for code, _ in told.failed] == ["closed"]
    assert slicer.util.getNodesByClass("vtkMRMLModelNode") == []


def test_a_scene_closed_while_the_transform_is_made(host: Any, make_logic: Callable, inputs: RunInputs) -> None:
    logic, told = make_logic("grids=slow"), Told()
    run = logic.startRun(inputs, **told.callbacks)
    host.wait_until(lambda: told.done, timeout=30)
    slicer.mrmlScene.Clear(0)
    finish(host, run)
    assert [code for code, _ in told.failed] == ["closed"] and told.transforms == []
    assert slicer.util.getNodesByClass("vtkMRMLTransformNode") == []


def test_a_case_deleted_while_its_transform_is_made(host: Any, make_logic: Callable, inputs: RunInputs) -> None:
    logic, told = make_logic("grids=slow"), Told()
    run = logic.startRun(inputs, **told.callbacks)
    host.wait_until(lambda: told.done, timeout=30)
    remove_case(run.case)
    finish(host, run)
    [(code, message)] = told.failed
    assert code == "transform" and "Press Register" in message


def test_a_second_start_is_refused(host: Any, make_logic: Callable, inputs: RunInputs) -> None:
    logic, told = make_logic("elastic=slow"), Told()
    run = logic.startRun(inputs)
    assert logic.startRun(inputs, **told.callbacks) is None
    assert told.failed == [("input", BUSY)] and logic.problems(inputs) == [BUSY]
    finish(host, run)
    assert run.case is not None


def test_what_cannot_start_is_told(make_logic: Callable, inputs: RunInputs, scene_contents: Callable) -> None:
    before, logic, told = scene_contents(), make_logic(), Told()
    assert logic.startRun(RunInputs(None, "", inputs.splat), **told.callbacks) is None
    assert logic.startRun(inputs, ("elastic", "coarse"), **told.callbacks) is None
    assert "no segmentation chosen" in told.failed[0][1] and "stages" in told.failed[1][1]
    assert scene_contents() == before


def test_cleanup_during_a_run_leaves_no_child(
    host: Any, make_logic: Callable, inputs: RunInputs, scene_contents: Callable
) -> None:
    before, logic, told = scene_contents(), make_logic("elastic=hang"), Told()
    logic.startRun(inputs, **told.callbacks)
    host.wait_until(lambda: len(told.surfaces) > 1, timeout=30)
    process = logic._runs._session.process
    logic.cleanup()
    assert not process.running and scene_contents() == before
