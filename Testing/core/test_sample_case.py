"""The sample case: its truth is true, its splat lies where it should, and the same seed gives the same files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from organphys.ground.checks import InputError
from organphys.ground.frames import fit_similarity
from organphys.pipeline import sample_flow, sample_organ, sample_splat
from organphys.pipeline.evaluation import Truth, errors_mm, mean_by_region, oracle_by_region, read_truth
from organphys.pipeline.sample_case import SampleCase, write_sample_case
from organphys.readers.gaussian_ply import read_splat
from organphys.readers.landmarks_file import read_landmarks
from organphys.readers.segmentation_file import read_organ


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> SampleCase:
    return write_sample_case(tmp_path_factory.mktemp("sample"), seed=5, size="small")


def test_flow_keeps_volume() -> None:
    rng = np.random.default_rng(1)
    points = sample_organ.interior_points(200, rng)
    flow = sample_flow.random_flow(points, np.array([0.0, 1.0, -0.5]), rms_mm=5.0, rng=rng)
    step = 1e-3
    moved = [(flow.apply(points + step * axis) - flow.apply(points - step * axis)) / (2 * step) for axis in np.eye(3)]
    gradient = np.stack(moved, axis=-1)
    assert np.abs(np.linalg.det(gradient) - 1).max() < 1e-6
    assert np.abs(gradient - np.eye(3)).max() > 0.05  # it does deform
    left = sample_flow.nonrigid(points, flow.apply(points))
    assert np.sqrt((left**2).sum(1).mean()) == pytest.approx(5.0, rel=0.01)


def test_flow_converges_with_order_four() -> None:
    rng = np.random.default_rng(2)
    points = sample_organ.interior_points(50, rng)
    flow = sample_flow.random_flow(points, np.array([0.0, 1.0, 0.0]), rms_mm=20.0, rng=rng)
    at = {n: sample_flow.replace(flow, steps=n).apply(points) for n in (2, 4, 64)}
    ratio = np.abs(at[2] - at[64]).max() / np.abs(at[4] - at[64]).max()
    assert 10 < ratio < 25  # 2^4 = 16


def test_flow_carries_normals() -> None:
    rng = np.random.default_rng(3)
    points = sample_organ.surface_points(100, rng)
    flow = sample_flow.random_flow(points, np.array([0.0, 1.0, 0.0]), rms_mm=5.0, rng=rng)
    normals = sample_organ.outward(points)
    step = 1e-3
    columns = [(flow.apply(points + step * axis) - flow.apply(points - step * axis)) / (2 * step) for axis in np.eye(3)]
    expected = np.einsum("nji,nj->ni", np.linalg.inv(np.stack(columns, -1)), normals)  # F^-T n
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.abs(flow.normals(points, normals) - expected).max() < 2e-3


def test_surface_points_lie_on_the_surface_and_face_outwards() -> None:
    points = sample_organ.surface_points(500, np.random.default_rng(0))
    assert len(points) == 500
    assert np.abs(sample_organ.level(points)).max() < 5e-3
    normals = sample_organ.outward(points)
    assert (sample_organ.level(points + normals) > 0).all()
    assert (sample_organ.level(points - normals) < 0).all()


def test_surface_points_are_uniform_by_area() -> None:
    """Counts in two halves follow the areas, measured by thin shells filled with an independent method."""
    points = sample_organ.surface_points(20_000, np.random.default_rng(0))
    grid = sample_organ.box_grid(2.0)
    level = sample_organ.level(grid)
    near = np.abs(level) < 4
    grid, level = grid[near], level[near]
    shell = np.abs(level) / np.linalg.norm(sample_organ.gradient(grid), axis=1) < 2.0
    right = grid[shell, 0] > sample_organ.CENTRE[0]
    share = float((points[:, 0] > sample_organ.CENTRE[0]).mean())
    assert share == pytest.approx(float(right.mean()), abs=0.02)


def test_quaternions_turn_the_flat_axis_onto_the_normal() -> None:
    rng = np.random.default_rng(0)
    normals = np.concatenate([rng.normal(size=(20, 3)), [[0, 0, 1], [0, 0, -1]]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    gaussians = sample_splat._on_surface(np.tile([0.0, 0, 100], (22, 1)), normals, np.full((22, 3), 0.5), rng)
    w, x, y, z = (gaussians.quaternions / np.linalg.norm(gaussians.quaternions, axis=1, keepdims=True)).T
    third = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    assert np.abs(third - normals).max() < 1e-9


def test_label_map_is_the_organ(case: SampleCase) -> None:
    organ = read_organ(case.labels, organ=case.organ)
    truth = read_truth(case.truth)
    surface = truth.points_ct[truth.region < 2]
    distance = cKDTree(organ.vertices).query(surface)[0]
    assert np.mean(distance) < 2.0  # 4 mm voxels
    assert 1000 < organ.volume_ml < 1500
    affine_is_oblique = np.sort(np.abs(np.diff(organ.volume_points[:2], axis=0)).ravel())[1] > 0.1
    assert affine_is_oblique


def test_splat_lies_on_the_visible_truth(case: SampleCase) -> None:
    splat, truth = read_splat(case.splat), read_truth(case.truth)
    opaque = cKDTree(splat.centres[splat.opacities > 0.1])
    near = opaque.query(truth.points_scene)[0] * truth.mm_per_unit
    assert np.median(near[truth.region == 0]) < 3.0
    assert np.median(near[truth.region == 1]) > 10.0
    share = {name: float((truth.region == k).mean()) for k, name in enumerate(("visible", "hidden", "interior"))}
    assert 0.1 < share["visible"] < 0.35
    assert share["interior"] == pytest.approx(1 / 3)
    assert 0.1 < float((splat.opacities < 0.1).mean()) < 0.3  # floaters
    assert (truth.points_scene[:, 2] > 0).all()  # before the camera


def test_landmarks_are_on_the_visible_surface(case: SampleCase) -> None:
    landmarks = read_landmarks(case.landmarks)
    with np.load(case.truth) as truth:
        np.testing.assert_allclose(landmarks.positions, truth["landmarks_ct"], atol=1e-6)
        slip = np.linalg.norm(truth["landmarks_scene"] - truth["landmarks_scene_ideal"], axis=1) * truth["mm_per_unit"]
    assert ((slip > 1.0) & (slip < 4.0)).all()
    assert np.abs(sample_organ.level(landmarks.positions)).max() < 0.05


def test_same_seed_same_files(tmp_path: Path, case: SampleCase) -> None:
    again = write_sample_case(tmp_path, seed=5, size="small")
    for name in ("ct_labels.nii.gz", "splat.ply", "landmarks.mrk.json", "case.json"):
        assert (again.folder / name).read_bytes() == (case.folder / name).read_bytes(), name
    with np.load(again.truth) as a, np.load(case.truth) as b:
        assert all((a[name] == b[name]).all() for name in b)
    other = write_sample_case(tmp_path, seed=6, size="small")
    assert other.splat.read_bytes() != case.splat.read_bytes()


def test_facts_agree_with_the_truth(case: SampleCase) -> None:
    facts = json.loads((case.folder / "case.json").read_text())
    assert facts["label_id"] == case.organ
    assert 4.0 < facts["deformation"]["rms_nonrigid_mm"] < 6.0


def test_errors_of_a_known_shift() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(30, 3))
    truth = Truth(points, points * 2.0, np.repeat([0, 1, 2], 10), 0.5)
    shifted = truth.points_scene + np.array([0.0, 6.0, 8.0])
    shifted[25] += 1000.0
    means = mean_by_region(truth, shifted)
    assert means["visible"] == pytest.approx(5.0)
    assert means["interior"] > means["hidden"] == pytest.approx(5.0)
    shifted[0] = np.nan
    assert errors_mm(truth, shifted)[0] == np.inf
    assert oracle_by_region(truth)["all"] == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(InputError, match="expected shape"):
        errors_mm(truth, shifted[:5])


def test_oracle_is_the_least_squares_similarity(case: SampleCase) -> None:
    truth = read_truth(case.truth)
    with np.load(case.truth) as data:
        best = fit_similarity(truth.points_ct, truth.points_scene)
        np.testing.assert_allclose(data["similarity"], best.matrix, rtol=1e-12)
    assert 3.0 < oracle_by_region(truth)["all"] < 6.0


def test_unknown_size_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="size"):
        write_sample_case(tmp_path, size="huge")
