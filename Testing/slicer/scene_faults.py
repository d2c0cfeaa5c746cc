"""Runs and simulations that end, lose a node or their scene at a random moment, and what that leaves behind."""

from __future__ import annotations

import ctypes
import gc
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import outcome_example as example
import slicer

from organphys.pipeline.outcome_files import save_outcome
from OrganPhysRegistrationLib.inputs.splat_node import load_splat
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.runs.registration_run import RegistrationRun
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs
from OrganPhysRegistrationLib.runs.run_process import RunProcess
from OrganPhysSimulationLib.logic import OrganPhysSimulationLogic
from OrganPhysSimulationLib.roles import ROLE
from OrganPhysSimulationLib.session import SimulationSession

FAKE = Path(__file__).with_name("fake_server.py")
INPUTS = ("splat", "segmentation", "landmarks")
RUN_S, SIMULATION_S = 1.2, 0.3  # the moment of the fault: up to so long after the start
FINENESS = {"handles": 6, "quadrature": 120}
GOES_ON = ("delete pins", "delete Pinned regions")  # the list it was pinned by, and its picture of the pins
ACTS = ("cancel", "delete", "close")


@dataclass(frozen=True)
class Trial:
    """``act``: what happened to it, ``at`` s after the start; ``failure``: empty if nothing is left over."""

    module: str
    act: str
    at: float
    ended: str
    failure: str


def write_outcomes(folder: Path) -> Path:
    """What the fake server answers with."""
    for stage in ("coarse", "rigid", "elastic"):
        save_outcome(example.outcome(stage, sampled=False), folder / stage)
    save_outcome(example.outcome(sampled=False, grids=example.grids(25.0)), folder / "grids")
    np.save(folder / "surface.npy", example.organ().scene_vertices.astype(np.float32))
    return folder


def fake_logic(outcomes: Path, at: str) -> OrganPhysRegistrationLogic:
    """Its child answers at once, but for the stage named in ``at``."""

    def arguments(folder: Path) -> list[str]:
        return [str(FAKE), "--folder", str(folder), "--outcomes", str(outcomes), *(["--at", at] if at else [])]

    return OrganPhysRegistrationLogic(process=RunProcess(arguments))


def run_inputs() -> RunInputs:
    """Segment, splat and a landmark in the scene."""
    scene = slicer.mrmlScene
    landmarks = scene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "Landmarks")
    landmarks.AddControlPoint(example.organ().vertices[0].tolist(), "tip")
    segmentation = example.segmentation_node(scene)
    segment_id = segmentation.GetSegmentation().GetNthSegmentID(0)
    return RunInputs(segmentation, segment_id, example.splat_node(scene), landmarks=landmarks)


def registration_trial(
    host: Any, logic: OrganPhysRegistrationLogic, contents: Callable[[], frozenset[str]], rng: np.random.Generator
) -> Trial:
    """One run in an empty scene; the scene is empty again after it."""
    host.clear_scene()
    inputs, told = run_inputs(), list[str]()
    before = contents()
    run = logic.startRun(inputs, onFailed=lambda code, _: told.append(code))
    at = float(rng.uniform(0, RUN_S))
    host.wait(at)
    act = str(rng.choice(ACTS))
    over = run.finished
    if act == "cancel":
        run.cancel()
    elif act == "close":
        slicer.mrmlScene.Clear(0)
    else:
        act = _delete(rng, [getattr(inputs, name) for name in INPUTS])
    host.wait_until(lambda: run.finished, timeout=30)
    host.process()
    ended = "finished before" if over else told[-1] if told else "finished"
    wrong = _left_of_run(act, contents(), before, run, told)
    host.clear_scene()
    return Trial("registration", act, at, ended, wrong or _recorded(host))


def _left_of_run(act: str, after: frozenset[str], before: frozenset[str], run: RegistrationRun, told: list[str]) -> str:
    if act == "close":
        left = {line for line in after if "SubjectHierarchy" not in line}  # Slicer keeps that one
        return f"after the scene was closed: {sorted(left)}" if left else ""
    if run.case is not None and not told:
        return ""  # the result was there already
    if act == "cancel" and (told == ["transform"] or told == []):
        return ""
    new = sorted(after - before)
    return f"{act}: {told}, new {new}" if new else ""


def simulation_trial(
    host: Any,
    logic: OrganPhysSimulationLogic,
    files: Any,
    contents: Callable[[], frozenset[str]],
    rng: np.random.Generator,
) -> Trial:
    """One running simulation in an empty scene; the scene is empty again after it."""
    host.clear_scene()
    organ, splat = logic.loadOrgan(files.asset), load_splat(files.splat, mm_per_unit=100)
    pins = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "pins")
    pins.AddControlPointWorld(0, 175, 0)
    session = logic.startSimulation(organ, splat, pinsNode=pins, **FINENESS)
    session.show_splat(bool(rng.random() < 0.5))
    logic.run()
    at = float(rng.uniform(0, SIMULATION_S))
    host.wait(at)
    act = str(rng.choice(ACTS))
    if act == "cancel":
        logic.closeSimulation()
    elif act == "close":
        slicer.mrmlScene.Clear(0)
    else:
        act = _delete(rng, [organ, splat, pins, *own_nodes()])
    host.process()
    host.wait(0.03)
    if act in GOES_ON:
        logic.closeSimulation()
    own = [node.GetName() for node in own_nodes()]
    wrong = f"{act}: {own} are left" if own or logic.session is not None or logic.running else ""
    logic.closeSimulation()
    host.clear_scene()
    return Trial("simulation", act, at, "ended", wrong or _recorded(host))


def own_nodes() -> list[Any]:
    """Nodes that the simulation has put into the scene."""
    scene = slicer.mrmlScene
    nodes = [scene.GetNthNode(k) for k in range(scene.GetNumberOfNodes())]
    return [node for node in nodes if node.GetAttribute(ROLE)]


def _delete(rng: np.random.Generator, nodes: list[Any]) -> str:
    node = nodes[int(rng.integers(len(nodes)))]
    name = node.GetName()
    slicer.mrmlScene.RemoveNode(node)
    return f"delete {name}"


def _recorded(host: Any) -> str:
    """Exceptions in callbacks and errors of VTK since the last look."""
    wrong = [*host.record.errors, *host.record.vtk_errors]
    host.record.clear()
    return " | ".join(wrong)


def observers() -> int:
    """Of the scene."""
    return str(slicer.mrmlScene).count("vtkObserver (")


def alive(kind: type) -> int:
    """Objects of a class that something still holds."""
    gc.collect()
    return sum(isinstance(thing, kind) for thing in gc.get_objects())


def resident_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


class _Mallinfo(ctypes.Structure):
    """glibc's struct mallinfo2 (malloc.h)."""

    _names = ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")
    _fields_ = tuple((name, ctypes.c_size_t) for name in _names)


def allocated_mb() -> float:
    """Memory that is allocated and not freed, without what the allocator keeps for later; glibc from 2.33 only."""
    mallinfo = ctypes.CDLL(None).mallinfo2
    mallinfo.restype = _Mallinfo
    held = mallinfo()
    return (held.uordblks + held.hblkhd) / 2**20


def whole_runs(host: Any, logic: OrganPhysRegistrationLogic, count: int) -> Iterator[tuple[float, float]]:
    """Resident and allocated memory in MB after each of ``count`` whole runs, in a new scene each."""
    for _ in range(count):
        host.clear_scene()
        run = logic.startRun(run_inputs())
        host.wait_until(lambda run=run: run.finished, timeout=30, poll=0.01)
        host.process()
        host.clear_scene()
        gc.collect()
        yield resident_mb(), allocated_mb()


HELD = (RegistrationRun, SimulationSession)
