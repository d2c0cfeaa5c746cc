"""Seed archives: a small registered organ, a sequence, a recording, a case and what its stages gave."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from asset_examples import ellipsoid
from simulation_examples import SIZE, TISSUE, box_grid, box_surface

from organphys.asset.asset_file import asset_bytes
from organphys.asset.organ_sequence import OrganSequence
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.asset.sequence_file import sequence_bytes
from organphys.basis.learned import LearnedWeights
from organphys.basis.reduced_basis import ReducedBasis
from organphys.basis.reduced_covariance import ReducedCovariance
from organphys.basis.rkpm import RkpmWeights
from organphys.exports.grid_records import DisplacementGrid, DisplacementGrids
from organphys.exports.recording_file import save_recording
from organphys.ground.frames import Normalisation, Similarity, rotation_about
from organphys.pipeline.case_file import save_case
from organphys.pipeline.case_outcome import CaseOutcome
from organphys.pipeline.outcome_files import OUTCOME, save_outcome
from organphys.pipeline.registration import RegisterOptions
from organphys.points.point_sets import Box, Camera, GaussianCloud, Landmarks, SceneUnit
from organphys.simulation.body import build_body
from organphys.simulation.options import SimulationOptions
from organphys.simulation.pins import Pin
from organphys.simulation.rest_shape import rest_shape
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.state import ToolPose
from organphys.simulation.tools import gripper

TURN = rotation_about(np.array([1.0, 2.0, 3.0]), 0.7)


def small_organ() -> RegisteredOrgan:
    """An ellipsoid of 32 vertices with 3 handles."""
    vertices, faces = ellipsoid(6, 6)
    rng = np.random.default_rng(0)
    normalisation = Normalisation(vertices.mean(0), 40.0)
    nodes = normalisation.apply(vertices[:10])
    basis = ReducedBasis.plain(RkpmWeights(nodes, np.full(10, 0.8), rng.normal(size=(10, 2))))
    inside = vertices.mean(0) + 0.8 * (vertices - vertices.mean(0))
    return RegisteredOrgan(
        T_scene_ct=Similarity(0.01, TURN, np.array([0.1, -0.2, 1.5])),
        normalisation=normalisation,
        basis=basis,
        z=0.01 * rng.normal(size=(12, 3)),
        vertices=vertices,
        faces=faces,
        volume_points=inside,
        quadrature_points=inside,
        quadrature_weights=np.full(len(inside), 1 / len(inside)),
        volume_ml=200.0,
        name="ellipsoid",
        tissue={"youngs_pa": 5000.0, "nu": 0.45},
        mm_per_scene_unit=100.0,
        provenance={"seed": 0, "inputs": {"splat.ply": "00ff"}},
        uncertainty=ReducedCovariance(0.01 * rng.normal(size=(37, 4)), 7.0),
    )


def learned_organ() -> RegisteredOrgan:
    """The same with learned weights and without uncertainty."""
    organ, rng = small_organ(), np.random.default_rng(1)
    matrices, offsets = (rng.normal(size=(3, 5)), rng.normal(size=(5, 2))), (rng.normal(size=5), rng.normal(size=2))
    basis = ReducedBasis.plain(LearnedWeights(matrices, offsets, np.zeros(3), 1.0))
    return replace(organ, basis=basis, uncertainty=None, mm_per_scene_unit=None)


def sequence(frames: int = 3) -> OrganSequence:
    organ = small_organ()
    return OrganSequence(
        organ=organ,
        times=np.arange(frames) / 30,
        z=np.stack([organ.z * (1 + 0.1 * k) for k in range(frames)]),
        scales=np.full(frames, 0.01),
        rotations=np.stack([TURN] * frames),
        translations=np.zeros((frames, 3)),
        status=("first", "tracked", "lost"),
        figures={"fit_mm": np.array([1.0, 1.1, 1.2]), "Moved_mm": np.zeros(frames)},
        notices=((2, "the organ was not found"),),
    )


def recording_bytes(folder: Path) -> bytes:
    points, (vertices, faces) = box_grid(SIZE, 0.02), box_surface(SIZE, 0.04)
    volumes = np.full(len(points), SIZE.prod() / len(points))
    shape = rest_shape(
        points, volumes, vertices, faces, tissue=TISSUE, handles=4, quadrature=12, nodes=16, sample_spacing=4e-2
    )
    body = build_body(shape, pins=(Pin((0.05, 0.02, -0.02), 0.045),), tissue=TISSUE, name="box")
    scene, pose = Scene((body,), (gripper(),), SimulationOptions()), ToolPose(np.array([0.05, 0.02, 0.3]))
    simulation = Simulation(scene, scene.initial_state(pose))
    simulation.step((pose,))
    simulation.set_pins(0, Pin((0.0, 0.02, 0.02), 0.03))
    simulation.set_options(SimulationOptions(friction=0.1))
    simulation.step((pose,))
    save_recording(folder / "r.npz", simulation.recording())
    return (folder / "r.npz").read_bytes()


def case_bytes(folder: Path) -> bytes:
    mask = np.zeros((9, 8, 10), dtype=bool)
    mask[2:7, 2:6, 2:8] = True
    rng = np.random.default_rng(0)
    cloud = GaussianCloud(
        rng.normal(size=(40, 3)), np.full(40, 0.9), rng.uniform(size=(40, 3)), np.ones(40, dtype=bool)
    )
    save_case(
        folder, mask=mask, ijk_to_ras=np.diag([2.0, 2, 3, 1]), splat=cloud, name="liver", options=RegisterOptions(),
        landmarks=Landmarks(np.array([[6.0, 6, 9]]), ("front",)), camera=Camera(np.zeros(3), 60.0),
        box=Box(np.zeros(3), np.full(3, 9.0)), unit=SceneUnit(10.0, 5.0), provenance={"seed": 1}, file="c.npz",
    )  # fmt: skip
    return (folder / "c.npz").read_bytes()


def outcome_bytes(folder: Path, stage: str) -> bytes:
    """Of one triangle; after the elastic stage with all that only that one has."""
    names = ("before", "coarse", "rigid", "elastic")[: 4 if stage == "elastic" else 2]
    corners, grid = (
        np.eye(3),
        DisplacementGrid(np.zeros(3), np.ones(3), np.zeros((2, 2, 2, 3), np.float32), {"max": 0.1}),
    )
    elastic = {
        "displacement_mm": np.ones(3), "det_f": np.ones(3), "error_68_mm": np.ones(3), "error_95_mm": np.full(3, 2.0),
        "volume_ct": corners, "volume_scene": corners, "steps": ({"alpha": 0.4, "energy": 1e-3},), "asset": b"organ",
        "grids": DisplacementGrids(grid, grid),
        "verdict": {"level": "check", "headline": "h", "reasons": [{"code": "c", "level": "check", "message": "m"}]},
    }  # fmt: skip
    outcome = CaseOutcome(
        stage=names[-1], similarities=dict.fromkeys(names, np.eye(4)), vertices_ct=corners, faces=np.array([[0, 1, 2]]),
        surfaces=dict.fromkeys(names, corners), distance_mm=dict.fromkeys(names, np.ones(3)), mm_per_unit=30.0,
        unit_stated=True, camera_position=np.zeros(3), metrics={"coarse": {"rms": {"value": 1.5, "unit": "mm"}}},
        seconds={"coarse": 0.5}, notices=(("little_seen", "Only 10 % seen"),), stops={"coarse": "done"},
        facts={"organ": "liver"},
        twists={"twists_deg": [0.0, 30.0], "costs": [0.5, 0.7], "cost_name": "cost", "chosen_deg": 0.0},
        **(elastic if stage == "elastic" else {}),
    )  # fmt: skip
    save_outcome(outcome, folder)
    return (folder / OUTCOME).read_bytes()


def archive_seeds() -> dict[str, dict[str, bytes]]:
    """Reader -> name -> content."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        assets = {"rkpm.organphys": asset_bytes(small_organ()), "learned.organphys": asset_bytes(learned_organ())}
        return {
            "asset": assets,
            "sequence": {"frames.organphys-seq": sequence_bytes(sequence())},
            "recording": {"run.npz": recording_bytes(folder)},
            "case": {"case.npz": case_bytes(folder)},
            "outcome": {f"{stage}.npz": outcome_bytes(folder, stage) for stage in ("coarse", "elastic")},
        }
