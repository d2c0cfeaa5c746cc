"""Cases and outcomes as files: what comes back is what went in, and damage is told."""

import json
import subprocess
import sys
import zipfile
from dataclasses import fields, replace

import numpy as np
import pytest
from asset_examples import bent_organ

from organphys.asset.asset_file import asset_bytes, asset_from_bytes
from organphys.exports.grid_records import DisplacementGrid, DisplacementGrids
from organphys.ground.checks import InputError
from organphys.pipeline.case_file import load_case
from organphys.pipeline.case_outcome import CaseOutcome
from organphys.pipeline.outcome_files import OUTCOME, load_outcome, save_case, save_outcome
from organphys.pipeline.registration import RegisterOptions
from organphys.points.point_sets import Box, Camera, GaussianCloud, Landmarks, SceneUnit


def example(stage="elastic") -> CaseOutcome:
    bent, rng = bent_organ(), np.random.default_rng(0)
    names = ("before", "coarse", "rigid", "elastic")
    names = names[: names.index(stage) + 1]
    count = len(bent.vertices)
    step = np.full(3, 2.5)
    grids = [
        DisplacementGrid(rng.normal(size=3), step, rng.normal(size=(3, 4, 5, 3)).astype(np.float32), {"max": 0.1}, {})
        for _ in range(2)
    ]
    outcome = CaseOutcome(
        stage=stage,
        similarities={name: bent.T_scene_ct.matrix * (k + 1) for k, name in enumerate(names)},
        vertices_ct=bent.vertices,
        faces=bent.faces,
        surfaces={name: rng.normal(size=(count, 3)) for name in names},
        distance_mm={name: rng.uniform(size=count) for name in names},
        mm_per_unit=29.7,
        unit_stated=True,
        camera_position=np.array([0.1, 0.2, 1 / 3]),
        metrics={name: {"scale": {"value": 1 / 3, "unit": "scene units per mm"}} for name in names[1:]},
        seconds={"coarse": 0.1},
        notices=(("little_seen", "Only 10 % seen: café"),),
        stops={"coarse": "every candidate was tried"},
        facts={"organ": "liver"},
        twists={"twists_deg": [0.0, 30.0], "costs": [0.5, 0.7], "cost_name": "cost", "chosen_deg": 0.0},
    )
    if stage != "elastic":
        return outcome
    return replace(
        outcome,
        steps=({"alpha": 0.4, "energy": 1e-3}, {"alpha": 0.1, "energy": 2e-3}),
        displacement_mm=rng.uniform(size=count),
        det_f=rng.uniform(size=count),
        volume_ct=bent.volume_points,
        volume_scene=bent.volume_points * 0.01,
        asset=asset_bytes(bent),
        grids=DisplacementGrids(*grids),
    )


def assert_same(a, b, where="outcome"):
    if isinstance(a, np.ndarray):
        np.testing.assert_array_equal(a, b, err_msg=where)
    elif hasattr(a, "__dataclass_fields__"):
        for field in fields(a):
            assert_same(getattr(a, field.name), getattr(b, field.name), f"{where}.{field.name}")
    elif isinstance(a, dict):
        assert list(a) == list(b), where
        for key in a:
            assert_same(a[key], b[key], f"{where}[{key}]")
    elif isinstance(a, tuple):
        assert len(a) == len(b), where
        for k, entry in enumerate(a):
            assert_same(entry, b[k], f"{where}[{k}]")
    else:
        assert a == b, where


@pytest.mark.parametrize("stage", ["coarse", "elastic"])
def test_outcome_comes_back_as_it_was(tmp_path, stage):
    outcome = example(stage)
    save_outcome(outcome, tmp_path / "o")
    assert [path.name for path in (tmp_path / "o").iterdir()] == [OUTCOME]
    assert_same(outcome, load_outcome(tmp_path / "o"))


def test_asset_of_an_outcome_maps_as_the_organ():
    bent = bent_organ()
    again = asset_from_bytes(asset_bytes(bent))
    points = bent.vertices[::50] + 3.0
    np.testing.assert_array_equal(again.map_points(points), bent.map_points(points))
    with pytest.raises(InputError, match="organ X"):
        asset_from_bytes(asset_bytes(bent)[:500], name="organ X")


def changed(path, change):
    """The archive with its JSON text changed and everything else kept."""
    with zipfile.ZipFile(path) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    header = json.loads(members["outcome.json"])
    change(header)
    members["outcome.json"] = json.dumps(header).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


@pytest.mark.parametrize(
    "change",
    [
        lambda header: header.update(stage="rigit"),
        lambda header: header.pop("metrics"),
        lambda header: header.update(unknown=1),
        lambda header: header.update(notices=3),
        lambda header: header["grids"]["forward"].update(origin=[1, 2]),
        lambda header: header["grids"]["inverse"].update(spacing=[1, 0, 1]),
        lambda header: header.update(mm_per_unit="30"),
        lambda header: header.update(unit_stated=1),
        lambda header: header.update(metrics={"rigid": {"scale": 3}}),
        lambda header: header.update(seconds=[1.0]),
        lambda header: header["twists"].update(costs=[1.0]),
        lambda header: header.update(verdict={"level": "fine", "headline": "", "reasons": []}),
    ],
)
def test_damaged_outcome_is_told(tmp_path, change):
    save_outcome(example(), tmp_path)
    changed(tmp_path / OUTCOME, change)
    with pytest.raises(InputError, match="damaged"):
        load_outcome(tmp_path)


def test_arrays_that_do_not_belong_together_are_told(tmp_path):
    outcome = example()
    for wrong in (
        replace(outcome, det_f=outcome.det_f[:-1]),
        replace(outcome, faces=outcome.faces + 1),
        replace(outcome, det_f=np.full_like(outcome.det_f, np.nan)),
        replace(outcome, volume_scene=outcome.volume_ct[:-1]),
        replace(outcome, surfaces={**outcome.surfaces, "rigid": outcome.vertices_ct[:4]}),
    ):
        save_outcome(wrong, tmp_path)
        with pytest.raises(InputError, match="damaged"):
            load_outcome(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        load_outcome(tmp_path / "none")
    (tmp_path / OUTCOME).write_bytes((tmp_path / OUTCOME).read_bytes()[:2000])
    with pytest.raises(InputError):
        load_outcome(tmp_path)


def test_case_comes_back_as_it_was(tmp_path):
    rng = np.random.default_rng(0)
    mask = np.zeros((14, 16, 18), dtype=bool)
    mask[3:11, 3:13, 3:15] = True
    affine = np.diag([-2.0, 2, 2, 1])
    affine[:3, 3] = [5, 6, 7]
    centres = rng.normal(size=(500, 3)).astype(np.float32)
    splat = GaussianCloud(centres, rng.uniform(0.2, 1, 500), rng.uniform(size=(500, 3)), rng.uniform(size=500) > 0.01)
    options = RegisterOptions(method="paper", seed=3, landmark_radius_mm=12.5)
    file = save_case(
        tmp_path, mask=mask, ijk_to_ras=affine, splat=splat, name="liver", options=options,
        landmarks=Landmarks(np.array([[-10.0, 12, 12]]), ("tip",)), camera=Camera([0, 0, -3], 60.0),
        box=Box([0, 0, 0], [9, 9, 9]), unit=SceneUnit(30.0, 5.0), opening=False, provenance={"labels": "00ff"},
    )  # fmt: skip
    case = load_case(tmp_path / file).state.case
    assert case.options == options and case.unit == SceneUnit(30.0, 5.0) and case.provenance == {"labels": "00ff"}
    assert (case.organ.name, case.camera.fov_deg) == ("liver", 60.0)
    assert case.organ.volume_ml == pytest.approx(mask.sum() * 8 / 1000)
    assert case.organ.vertices[:, 0].max() < 1 < case.organ.vertices[:, 1].min()
    for name in ("centres", "opacities", "colours", "valid"):
        np.testing.assert_array_equal(getattr(case.splat, name), getattr(splat, name))
        assert getattr(case.splat, name).dtype == getattr(splat, name).dtype
    np.testing.assert_array_equal(case.landmarks, [[-10.0, 12, 12]])
    assert len(case.scene.centres) == splat.valid.sum()


def test_case_with_unusable_inputs_is_told_when_loaded(tmp_path):
    mask, splat = np.zeros((9, 9, 9), bool), GaussianCloud(np.eye(3), np.ones(3), np.ones((3, 3)), np.ones(3, bool))
    file = save_case(tmp_path, mask=mask, ijk_to_ras=np.eye(4), splat=splat, name="spleen")
    with pytest.raises(InputError, match="spleen is empty"):
        load_case(tmp_path / file)


def test_writing_and_reading_files_loads_no_solver(tmp_path):
    """The process that shows results must not wait for scipy and the readers."""
    save_outcome(example("coarse"), tmp_path)
    code = (
        "import sys; from organphys.pipeline.outcome_files import load_outcome, save_case;"
        f"load_outcome({str(tmp_path)!r});"
        "assert not any(m.startswith(('scipy', 'vtk', 'SimpleITK', 'torch')) for m in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
