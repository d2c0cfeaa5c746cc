"""Messages about organs, sequences and scenes that do not fit together, as far as no other test raises them."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from asset_examples import bent_organ
from simulation_examples import box_body

from organphys.asset.organ_sequence import OrganSequence
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.basis.reduced_basis import ReducedBasis
from organphys.basis.reduced_covariance import ReducedCovariance
from organphys.ground.checks import InputError
from organphys.pipeline.commands_map import organ_of
from organphys.pipeline.commands_map import run as map_points
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.splat_binding import bind_splat
from organphys.simulation.state import SceneState, ToolPose
from organphys.simulation.tools import probe


@pytest.fixture(scope="module")
def organ() -> RegisteredOrgan:
    return bent_organ()


@pytest.fixture(scope="module")
def organ_file(organ: RegisteredOrgan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from organphys.asset.asset_file import save_asset

    path = tmp_path_factory.mktemp("asset") / "organ.organphys"
    save_asset(organ, path)
    return path


ORGAN = {
    "faces: expected triangles": {"faces": np.zeros((0, 3))},
    "indices must lie within": {"faces": np.array([[0, 1, 10**6]])},
    "z: expected finite coordinates": {"z": np.zeros((3, 3))},
    "one number per quadrature point": {"quadrature_weights": np.zeros(3)},
    "covariance factor: expected 145 rows": {"uncertainty": ReducedCovariance(np.zeros((13, 1)))},
}


@pytest.mark.parametrize("words", ORGAN)
def test_organs(words: str, organ: RegisteredOrgan) -> None:
    with pytest.raises(InputError, match=words):
        replace(organ, **ORGAN[words])


def sequence(organ: RegisteredOrgan, **changed: object) -> OrganSequence:
    T = organ.T_scene_ct
    given = {"times": np.arange(2.0), "z": np.stack([organ.z] * 2), "scales": np.full(2, T.scale),
             "rotations": np.stack([T.rotation] * 2), "translations": np.stack([T.translation] * 2),
             "status": ("first", "tracked")}  # fmt: skip
    return OrganSequence(organ, **(given | changed))  # type: ignore[arg-type]


SEQUENCE = {
    "sequence z: expected finite numbers": {"z": np.zeros((2, 3))},
    "sequence times: expected at least one": {"times": np.array([1.0, 0.0])},
    "sequence status: expected": {"status": ("first", "somewhere")},
    "sequence similarities: expected": {"scales": np.array([1.0, -1.0])},
    "sequence figures: expected 2 numbers": {"figures": {"score": np.zeros(3)}},
}


@pytest.mark.parametrize("words", SEQUENCE)
def test_sequences(words: str, organ: RegisteredOrgan) -> None:
    with pytest.raises(InputError, match=words):
        sequence(organ, **SEQUENCE[words])


def test_frame_that_is_not_there(organ: RegisteredOrgan) -> None:
    with pytest.raises(InputError, match="frame: expected 0 to 1, got 7"):
        sequence(organ).map_points(np.zeros((1, 3)), 7)


def test_basis_of_too_few_points(organ: RegisteredOrgan) -> None:
    with pytest.raises(InputError, match="are not independent on 200 points"):
        ReducedBasis.whitened(organ.basis.weights, np.tile(organ.normalisation.apply(organ.volume_points[:4]), (50, 1)))
    with pytest.raises(InputError, match="stored basis is inconsistent"):
        ReducedBasis.from_arrays("rkpm", organ.basis.arrays() | {"whitening": np.eye(3)})


def test_map(organ: RegisteredOrgan, organ_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from organphys.asset.sequence_file import save_sequence

    save_sequence(sequence(organ), tmp_path / "organ.organphys-seq")
    with pytest.raises(InputError, match="is no sequence; leave it out"):
        organ_of(str(organ_file), 3)
    with pytest.raises(InputError, match="a sequence of 2 frames; say which one"):
        organ_of(str(tmp_path / "organ.organphys-seq"), None)
    arguments = argparse.Namespace(
        out=str(tmp_path / "mapped.txt"), points=str(tmp_path / "far.npy"), asset=str(organ_file), frame=None,
        inverse=True, confidence=False, quiet=False,
    )  # fmt: skip
    with pytest.raises(InputError, match="expected a file that ends in"):
        map_points(arguments)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene((box_body(),), (probe(),))


def test_scenes(scene: Scene) -> None:
    pose = ToolPose(np.array([0.05, 0.02, 0.08]))
    with pytest.raises(InputError, match="tool poses: expected 1, one per tool, got 0"):
        scene.initial_state()
    with pytest.raises(InputError, match="jaw opening must be finite"):
        scene.initial_state(replace(pose, jaw_deg=np.nan))
    simulation = Simulation(scene, scene.initial_state(pose))
    with pytest.raises(InputError, match="body: expected a number from 0 to 0, got 4"):
        simulation.set_pins(4)
    with pytest.raises(InputError, match="state: expected 1 bodies, got 0"):
        Simulation(scene, SceneState((), (pose,), 0.0)).step((pose,))


def test_splat_that_is_elsewhere(scene: Scene) -> None:
    from organphys.points.gaussians import Gaussians

    far = Gaussians(
        means=np.full((3, 3), 50.0), log_scales=np.zeros((3, 3)), quaternions=np.tile([1.0, 0, 0, 0], (3, 1)),
        opacity_logits=np.zeros(3), sh_dc=np.zeros((3, 3)), sh_rest=np.zeros((3, 3, 0)), valid=np.ones(3, dtype=bool),
    )  # fmt: skip
    with pytest.raises(InputError, match="distance: expected a finite number"):
        bind_splat(scene.bodies[0], far, 1.0, distance=-1)
    with pytest.raises(InputError, match="is the scale right"):
        bind_splat(scene.bodies[0], far, 1.0)
