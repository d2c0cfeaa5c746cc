"""Messages about single values, as far as no other test raises them: each by the value that it is about."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from organphys.align.paper_coarse import projected_diameter
from organphys.align.splat_surface import SplatSurface
from organphys.align.splat_view import _in_front, look
from organphys.basis.error_radius import error_radius
from organphys.basis.reduced_covariance import ReducedCovariance
from organphys.basis.rkpm import rkpm_weights
from organphys.basis.skinning import weights_from_arrays
from organphys.ground.checks import InputError, as_points, as_positive, one_of
from organphys.ground.frames import Similarity
from organphys.mechanics.neo_hookean import LogNeoHookean
from organphys.mechanics.tissue import Tissue
from organphys.pipeline.landmark_checks import checked_partners
from organphys.pipeline.landmark_weights import landmark_weights
from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.simulated_organ import tissue_named
from organphys.pipeline.simulation_plan import step_count
from organphys.pipeline.tracking import FollowOptions
from organphys.points.point_sets import Box, Landmarks, Organ, SceneUnit
from organphys.points.surface_samples import sample_surface
from organphys.points.trajectory import Trajectory
from organphys.readers.label_schemes import scheme_names
from organphys.readers.landmark_pairs import paired_landmarks
from organphys.readers.organ_from_mask import organ_from_mask
from organphys.simulation.instruments import INSTRUMENTS
from organphys.simulation.local_detail import LocalDetail
from organphys.simulation.options import SimulationOptions
from organphys.simulation.pins import BoxPin
from organphys.simulation.psm import Psm, as_joints
from organphys.simulation.psm_trocar import default_trocar
from organphys.simulation.rest_shape import rest_shape
from organphys.simulation.tool_shapes import Capsule
from organphys.simulation.tools import Part, Tool

Raising = Callable[[], object]
CUBE = np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
DRIVER = INSTRUMENTS["large_needle_driver"]


def rotations(count: int) -> np.ndarray:
    return np.tile(np.eye(3), (count, 1, 1))


def trajectory(count: int = 2, **changed: object) -> Trajectory:
    given = {"times": np.arange(float(count)), "positions": np.zeros((count, 3)), "rotations": rotations(count),
             "jaw_deg": np.zeros(count)}  # fmt: skip
    return Trajectory(**(given | changed))  # type: ignore[arg-type]


def partners(places: list[list[float]], pairs: tuple[int, ...] | None) -> Raising:
    landmarks = Landmarks(CUBE[:2], ("a", "b"), np.array(places), pairs)
    return lambda: checked_partners(landmarks, CUBE)


def trocar(camera: np.ndarray) -> np.ndarray:
    return default_trocar(CUBE, camera=camera, right=np.array([1.0, 0, 0]), instrument=DRIVER)


PLAIN: dict[str, Raising] = {
    "expected numbers of shape (N, 3), got str": lambda: as_points("abc"),
    "expected an array of shape (N, 3), got shape (2,)": lambda: as_points([1.0, 2.0]),
    "expected at least 4 points, got 3": lambda: as_points(np.zeros((3, 3)), minimum=4),
    "1 of 2 points are not finite": lambda: as_points([[0, 0, 0], [np.nan, 0, 0]]),
    "expected a finite number above 0, got -1": lambda: as_positive(-1, "length"),
    "expected one of a, b, got 'c'": lambda: one_of("c", "name", ("a", "b")),
    "expected a finite matrix (4, 4)": lambda: Similarity.of_matrix(np.eye(3)),
    "expected rotation, shift and one scale": lambda: Similarity.of_matrix(np.diag([1.0, 2, 3, 1])),
    "Lame constant lam": lambda: LogNeoHookean(1.0, -1.0),
    "below 0.5, got 0.6": lambda: Tissue("x", 1e3, 0.6, 1e3, "assumed"),
    "probability: expected": lambda: error_radius(np.eye(3)[None], 1.5),
    "expected more than 2, got 1": lambda: error_radius(np.eye(3)[None], 0.5, freedom=1),
    "degrees of freedom: expected more than 2, got 2": lambda: ReducedCovariance(np.zeros((13, 1)), 2.0),
    "expected finite numbers (12H + 1, k)": lambda: ReducedCovariance(np.zeros((12, 1))),
    "rows do not fit a basis of 8": lambda: ReducedCovariance(np.zeros((13, 1))).at(np.zeros((1, 8)), np.zeros((1, 3))),
    "handles: expected at least 1": lambda: rkpm_weights(CUBE, handles=0),
    "use fewer": lambda: rkpm_weights(CUBE, handles=30, nodes=20),
    "they lie in a plane": lambda: rkpm_weights(CUBE * [1, 1, 0], handles=3, nodes=9),
    "stored RKPM weights are inconsistent": lambda: weights_from_arrays(
        "rkpm", {"nodes": np.zeros((2, 3)), "radii": np.zeros(3), "coefficients": np.zeros((3, 1))}
    ),
    "stored rkpm weights lack 'nodes'": lambda: weights_from_arrays("rkpm", {}),
    "stored learned weights are inconsistent": lambda: weights_from_arrays("learned", {"centre": np.zeros(3)}),
    "box axes: expected three orthonormal": lambda: Box(np.zeros(3), np.ones(3), np.ones((3, 3))),
    "box size: expected three numbers above 0": lambda: Box(np.zeros(3), np.array([1.0, 0, 1])),
    "mm per unit: expected 1e-06 to 1e+06 mm": lambda: SceneUnit(1e9),
    "a deviation of 0 to 100 percent": lambda: SceneUnit(1.0, 200.0),
    "seed: expected a whole number": lambda: RegisterOptions(seed=-1),
    "steps: expected 1 to 200": lambda: FollowOptions(steps=0),
    "damping: expected a number of at least 0": lambda: FollowOptions(damping=-1),
    "they lie on a line seen": lambda: projected_diameter(CUBE * [1, 0, 0], np.array([0, 0, 1.0])),
    "lies in the middle of the splat": lambda: look(np.zeros((9, 3)), _camera()),
    "the splat lies behind it": lambda: _in_front(SplatSurface(-CUBE, CUBE, -CUBE, CUBE, 1.0, 1.0)),
    "pick points on the visible surface": lambda: landmark_weights(CUBE, CUBE.mean(0)[None]),
    "it has no area": lambda: sample_surface(_flat_organ()),
    "expected one of": lambda: scheme_names("nobody's"),
    "organ mask: expected an array of shape (K, J, I)": lambda: organ_from_mask(np.ones((2, 2)), np.eye(4)),
    "no voxel is set": lambda: organ_from_mask(np.zeros((4, 4, 4), dtype=bool), np.eye(4)),
    "with the last row 0 0 0 1": lambda: organ_from_mask(np.ones((4, 4, 4), dtype=bool), np.ones((4, 4))),
    "3 for 2 landmarks in the CT, and their": lambda: paired_landmarks(
        Landmarks(CUBE[:2], ("a", "b")), Landmarks(CUBE[:3], ("x", "y", "z"))
    ),
    "1 for 2 landmarks in the CT; give one for each": partners([[0, 0, 0]], None),
    "landmark pairs: expected different numbers from 0 to 1": partners([[0, 0, 0], [1, 1, 1]], (0, 5)),
    "scene units off the splat": partners([[0, 0, 0], [99, 99, 99]], (0, 1)),
    "trajectory: 3 poses, at most": lambda: _with_most(2, lambda: trajectory(3)),
    "jaw_deg must be within": lambda: trajectory(jaw_deg=np.array([0, 4e3])),
    "trajectory times: expected 2 finite numbers": lambda: trajectory(times=np.array([0.0, np.nan])),
    "expected 2 finite matrices (3, 3)": lambda: trajectory(rotations=np.eye(3)),
    "pose 2 is no proper rotation": lambda: trajectory(rotations=np.stack([np.eye(3), -np.eye(3)])),
    "time: expected finite seconds, got nan": lambda: trajectory().at(np.nan),
    "time: expected finite seconds": lambda: trajectory().resampled([]),
    "whose transform to the simulation is not given": lambda: trajectory(frame="ct").in_metres(),
    "--fps: expected 1 to 1000": lambda: step_count(trajectory(), 0.1),
    "steps per second are more than": lambda: step_count(trajectory(times=np.array([0, 1e5])), 60),
    "--tissue: expected one of": lambda: tissue_named("bone"),
    "pin box axes: expected three unit vectors": lambda: BoxPin((0, 0, 0), ((1, 0, 0),) * 3, (1, 1, 1)),
    "count: expected at least 1 kernel": lambda: LocalDetail(count=0),
    "friction: expected a finite number of at least 0": lambda: SimulationOptions(friction=-1),
    "effort: expected at least 1": lambda: SimulationOptions(effort=0),
    "joints: expected six finite numbers": lambda: as_joints([1, 2]),
    "joints, jaw_deg: expected finite": lambda: Psm(DRIVER, np.eye(4)).poses(np.zeros((1, 6)), np.array([np.nan])),
    "a place beside the organ's middle": lambda: trocar(CUBE.mean(0)),
    "give a trocar yourself": lambda: trocar(np.array([0, 0, -9.0])),
    "volumes: expected 27 numbers above 0": lambda: rest_shape(CUBE, np.zeros(27), CUBE, np.zeros((1, 3), dtype=int)),
    "handles: expected at least 4": lambda: rest_shape(CUBE, np.ones(27), CUBE, np.zeros((1, 3), dtype=int), handles=3),
    "expected jaw -1 or 1": lambda: Tool((Part(Capsule(np.zeros(3), np.ones(3), 0.1), 2),)),
}


def _camera() -> object:
    from organphys.points.point_sets import Camera

    return Camera()


def _flat_organ() -> Organ:
    faces = np.array([[0, 1, 2]])
    return Organ(np.zeros((3, 3)), faces, np.ones((3, 3)), CUBE, 1.0, np.ones(3), "flat")


def _with_most(most: int, call: Raising) -> object:
    from organphys.points import trajectory as module

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MOST_POSES", most)
        return call()


@pytest.mark.parametrize("words", PLAIN)
def test_values(words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)):
        PLAIN[words]()
