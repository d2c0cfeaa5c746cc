"""What parts_benchmark.py times: reading, registration, mapping and simulation in parts, on the generated sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import numpy as np
from elastic_contest import same_sub_problem
from scaling_case import write_labels_of, write_splat_of
from simulation_splats import UNIT, gaussians
from simulation_step import DT, body_of, grasp_poses, pinned

from organphys.align.paper_coarse import paper_coarse
from organphys.align.paper_rigid import paper_rigid
from organphys.align.start_search import search_start
from organphys.basis.rkpm import rkpm_weights
from organphys.elastic.elastic_registration import ElasticLevel, ElasticOptions, register_elastically
from organphys.ground.checks import InputError
from organphys.ground.progress import no_progress
from organphys.pipeline.case import Case
from organphys.pipeline.case_state import CaseState
from organphys.pipeline.default_method import DefaultMethod
from organphys.pipeline.method_memory import MethodMemory
from organphys.pipeline.outer_loop import taken_over
from organphys.pipeline.sample_case import write_sample_case
from organphys.readers.gaussian_ply import read_splat
from organphys.readers.landmarks_file import read_landmarks
from organphys.readers.segmentation_file import read_organ
from organphys.simulation.options import SimulationOptions
from organphys.simulation.quick_splat import on_device, quick_splat
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.tools import gripper

READ, VOXELS, MAPPED, INVERTED, MOVED = 300_000, 1_000_000, 1_000_000, 100_000, 650_000
Timed = dict[str, Callable[[], object]]


@dataclass(frozen=True)
class Parts:
    """timed: work by name; by_clock: those on a GPU; missing: why, by name; remarks: on the figures."""

    timed: Mapping[str, Callable[[], object]]
    by_clock: tuple[str, ...]
    missing: Mapping[str, str]
    remarks: tuple[str, ...]


def made_parts(folder: Path) -> Parts:
    """All parts; makes the sample case, and registers it once."""
    sample = write_sample_case(folder / "sample", size="full")
    write_splat_of(folder / "many.ply", sample.splat, READ, 3)
    write_labels_of(folder / "labels.nii.gz", VOXELS)
    landmarks = read_landmarks(sample.landmarks)
    case = Case.of(read_organ(sample.labels, organ="5"), read_splat(sample.splat), landmarks=landmarks)
    contest, remarks = same_sub_problem(case)
    splat, by_clock, missing = splat_parts()
    timed = {
        f"read a splat of {READ} Gaussians, degree 3": lambda: read_splat(folder / "many.ply"),
        f"read a label map of {VOXELS} voxels": lambda: read_organ(folder / "labels.nii.gz", organ="5"),
        **registration_parts(case),
        **contest,
        **simulation_part(),
        **splat,
    }
    return Parts(timed, by_clock, missing, remarks)


def registration_parts(case: Case) -> Timed:
    """Start searches, rigid stages, basis, an elastic step and the map of the result."""
    method = DefaultMethod(case)
    coarse = method.coarse(no_progress)
    rigid = method.rigid(coarse, None, no_progress)
    elastic = method.elastic(coarse, rigid, None, no_progress)
    organ = CaseState(case).followed_by({"coarse": coarse, "rigid": rigid, "elastic": elastic}).registration.organ
    boundary, target, marks = case.organ.boundary_points, case.scene.target, case.landmarks
    paper, view = paper_coarse(boundary, target, marks, case.camera.position)
    one_step = ElasticOptions(levels=(ElasticLevel(0.04, 0.12, 1),))
    points = organ.volume_points[np.random.default_rng(0).integers(len(organ.volume_points), size=MAPPED)]
    inner = method.samples.normalisation.apply(points[:30_000])
    scene = organ.map_points(points[:INVERTED])

    def forgetful() -> DefaultMethod:  # with the view and basis, without the poses fitted before
        other = taken_over(method, case)
        other.memory = MethodMemory()
        return other

    return {
        "start search": lambda: search_start(method.samples, method.view, landmarks=method.landmarks),
        "twist search (paper)": lambda: paper_coarse(boundary, target, marks, case.camera.position),
        "rigid stage": lambda: forgetful().rigid(coarse, None, no_progress),
        "rigid ICP (paper)": lambda: paper_rigid(boundary, target, marks, coarse=paper, view=view),
        "RKPM weights, 32 handles": lambda: rkpm_weights(inner, handles=32),
        "elastic step, 5000 surface points, matches included": lambda: register_elastically(
            method.organ, method.view, rigid.pose, options=one_step
        ),
        f"map {MAPPED} points": lambda: organ.map_points(points),
        f"map {INVERTED} points back": lambda: organ.inverse_map_points(scene),
    }


def simulation_part() -> Timed:
    """A step while the gripper holds and lifts tissue."""
    body = pinned(body_of(None, 20, 1000))
    poses = grasp_poses(body, 240)
    simulation = Simulation(
        start := Scene((body,), (gripper(),), SimulationOptions(gravity=np.zeros(3))), start.initial_state(*poses[0])
    )
    for pose in poses[:110]:
        simulation.step(pose, dt=DT)
    held = cycle(poses[110:190])
    return {"simulation step, grasped": lambda: simulation.step(next(held), dt=DT)}


def splat_parts() -> tuple[Timed, tuple[str, ...], dict[str, str]]:
    """Updates of means and covariances by numpy, by warp on CPU and CUDA; which by the clock; what is missing, why."""
    body = body_of(None, 20, 1000)
    z = np.random.default_rng(1).normal(size=(body.basis.size, 3))
    z *= 0.3 / np.abs(body.strain.rates(z)).max()
    quick, timed, missing = quick_splat(body, gaussians(body, MOVED), UNIT), Timed(), {}
    for device in ("numpy", "cpu", "cuda"):
        name = f"move {MOVED} Gaussians by {device if device == 'numpy' else 'warp, ' + device}"
        try:
            moving = on_device(quick, device)
        except InputError as error:
            missing[name] = str(error)
            continue
        timed[name] = lambda moving=moving: moving.frame(body, z)
    return timed, tuple(name for name in timed if "cuda" in name), missing
