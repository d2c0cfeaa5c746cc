"""Messages of files and scenes in rare states, as far as no other test raises them."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from asset_examples import bent_organ
from simulation_examples import box_body

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.basis import learned_training
from organphys.exports.baked_colours import baked_colours
from organphys.exports.tetrahedra import tetrahedra
from organphys.ground.checks import InputError
from organphys.pipeline.follow_request import follow_case
from organphys.pipeline.frame_view import Near, frame_view
from organphys.pipeline.output_folder import whole_or_nothing
from organphys.pipeline.points_file import read_points
from organphys.pipeline.recorded_moment import moment_at
from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.simulated_organ import body_from_options
from organphys.points.gaussians import Gaussians
from organphys.points.point_sets import Camera, GaussianCloud
from organphys.readers import trajectory_file
from organphys.readers.landmarks_file import read_landmarks
from organphys.readers.roi_file import read_box
from organphys.readers.trajectory_file import read_trajectory
from organphys.simulation.body import Body
from organphys.simulation.options import SimulationOptions
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.state import BodyState, ToolPose
from organphys.simulation.state_transfer import transferred
from organphys.simulation.tools import probe

POSE = {"time_s": 0, "position": [0, 0, 0], "direction": [0, 0, 1]}
TURNED = {"time_s": 1, "position": [0, 0, 0], "quaternion": [1, 0, 0, 0]}


@pytest.fixture(scope="module")
def organ() -> RegisteredOrgan:
    return bent_organ()


@pytest.fixture(scope="module")
def body() -> Body:
    return box_body()


def faint_splat(count: int) -> Gaussians:
    return Gaussians(
        means=np.zeros((count, 3)), log_scales=np.zeros((count, 3)), quaternions=np.tile([1.0, 0, 0, 0], (count, 1)),
        opacity_logits=np.full(count, -9.0), sh_dc=np.zeros((count, 3)), sh_rest=np.zeros((count, 3, 0)),
        valid=np.ones(count, dtype=bool),
    )  # fmt: skip


def cloud() -> GaussianCloud:
    centres = np.random.default_rng(0).normal(size=(500, 3))
    return GaussianCloud(centres, np.ones(500), np.ones((500, 3)), np.ones(500, dtype=bool))


def test_splat_without_colours_to_bake(organ: RegisteredOrgan) -> None:
    with pytest.raises(InputError, match="no Gaussian of opacity above"):
        baked_colours(organ, faint_splat(3))


def test_edges_longer_than_the_organ(organ: RegisteredOrgan) -> None:
    with pytest.raises(InputError, match="edge length: expected less than the size of the organ"):
        tetrahedra(organ.vertices, organ.faces, edge=1e6)


def test_learned_weights_of_too_few_points() -> None:
    with pytest.raises(InputError, match="expected 2 to a quarter of the 8 points, got 20"):
        learned_training.train(np.random.default_rng(0).normal(size=(8, 3)))


def test_learned_weights_without_torch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    with pytest.raises(InputError, match="learned weights need torch"):
        learned_training.train(np.zeros((8, 3)))


def test_names_left_out(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="output folder: no name given"), whole_or_nothing(" "):
        pass
    with pytest.raises(InputError, match="follow: name the folder"):
        follow_case(None, {}, tmp_path, lambda *_: None)  # type: ignore[arg-type]


def test_points_that_are_none(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_bytes(b"\xff\xfe\x00")
    for name, words in (("missing.npy", "no such file; give points"), ("points.csv", "not a text file")):
        with pytest.raises(InputError, match=words):
            read_points(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("list.fcsv", "# CoordinateSystem = RSA\n1,2,3\n", "is neither RAS nor LPS; save the list"),
        ("list.txt", "", "unknown kind of landmark file"),
    ],
)
def test_landmark_files(name: str, content: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=words):
        read_landmarks(tmp_path / name)


def test_round_region(tmp_path: Path) -> None:
    markup = {"type": "ROI", "roiType": "Sphere", "center": [0, 0, 0], "size": [1, 1, 1], "coordinateSystem": "RAS"}
    (tmp_path / "roi.mrk.json").write_text(json.dumps({"markups": [markup]}))
    with pytest.raises(InputError, match="is not supported; use a box"):
        read_box(tmp_path / "roi.mrk.json")


def test_trajectories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = {"format": "organphys-trajectory", "version": 1, "frame": "m", "poses": [POSE, TURNED]}
    (tmp_path / "path.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="all poses must give their rotation in the same way"):
        read_trajectory(tmp_path / "path.json")
    monkeypatch.setattr(trajectory_file, "MOST_POSES", 1)
    with pytest.raises(InputError, match="more than 1 poses; thin them out"):
        read_trajectory(tmp_path / "path.json")


def test_frame_without_the_organ() -> None:
    with pytest.raises(InputError, match="nothing is left where the organ was"):
        frame_view(cloud(), Camera(), None, RegisterOptions(), Near(np.full((4, 3), 99.0), 1.0))


def test_moment_outside_a_recording(body: Body) -> None:
    scene = Scene((body,), (probe(),))
    recording = Simulation(scene, scene.initial_state(ToolPose(np.array([0.05, 0.02, 0.08])))).recording()
    with pytest.raises(InputError, match="the recording goes from 0 s to 0 s, got 9"):
        moment_at(recording, 9.0)


def test_too_few_quadrature_points(organ: RegisteredOrgan) -> None:
    with pytest.raises(InputError, match="--quadrature: expected at least 50 points, got 3"):
        body_from_options(organ, argparse.Namespace(quadrature=3))


def test_tissue_that_is_inside_out(body: Body) -> None:
    points = body.shape.points
    z = np.linalg.lstsq(body.basis.phi(points), -2 * points, rcond=None)[0]  # x becomes -x
    state = replace(BodyState.at_rest(body.basis.size), z=z)
    with pytest.raises(InputError, match="too distorted to be brought over"):
        transferred(state, body, body)


def test_notices_of_a_scene(body: Body) -> None:
    heavy = SimulationOptions(gravity=np.array([0, 0, -9.8]))
    scene = Scene((body,), (probe(radius=0.4 * body.samples.spacing),), heavy)
    assert {notice.code for notice in scene.notices()} == {"unpinned", "coarse_samples"}
