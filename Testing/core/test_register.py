"""register(): one call from point sets to a registered organ, its warnings and its refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scene_examples import FRONT_CT, MM_PER_UNIT, POSE, bend, bumpy_organ, map_error, seen_from_camera
from session_examples import small_problem

from organphys.elastic.joint_scale import ScalePrior
from organphys.ground.checks import InputError
from organphys.ground.frames import Similarity, rotation_about
from organphys.ground.progress import Cancelled
from organphys.pipeline.landmark_checks import checked_landmarks
from organphys.pipeline.register import register
from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.result_notices import SurfaceState, result_notices
from organphys.pipeline.scale_checks import SWELLING, scale_prior, unit_notices, unit_scale
from organphys.pipeline.scene import select_scene
from organphys.points.point_sets import Box, GaussianCloud, Landmarks, SceneUnit
from organphys.points.surface_samples import sample_surface

T_MOVED_CT = Similarity(1.0, rotation_about(np.array([1.0, -0.5, 2.0]), 1.3), np.array([-80.0, 40.0, 25.0]))


@pytest.fixture(scope="module", autouse=True)
def small():
    with small_problem():
        yield


@pytest.fixture(scope="module")
def organ():
    return bumpy_organ()


@pytest.fixture(scope="module")
def seen(organ):
    return seen_from_camera(organ, deformation=bend)


@pytest.fixture(scope="module")
def landmarks(organ):
    """Two points of the seen side, the second one 20 mm above the surface."""
    height = organ.vertices @ FRONT_CT
    first = organ.vertices[height.argmax()]
    second = organ.vertices[np.where(organ.vertices[:, 0] < 0, height, -np.inf).argmax()]
    return Landmarks(np.array([first, second + 20 * FRONT_CT / np.linalg.norm(FRONT_CT)]), ("middle", "tip"))


@pytest.fixture(scope="module")
def result(organ, seen):
    """Without landmarks and unit."""
    return register(organ, seen.cloud)


@pytest.fixture(scope="module")
def with_landmarks(organ, seen, landmarks):
    """With landmarks, an exact unit, a box, and progress noted."""
    told = []
    box = Box(seen.points.mean(0), np.full(3, 8.0))
    found = register(
        organ, seen.cloud, landmarks=landmarks, unit=SceneUnit(MM_PER_UNIT), box=box, provenance={"splat": "00ff"},
        progress=lambda stage, part: told.append((stage, part)),
    )  # fmt: skip
    return found, told


@pytest.fixture(scope="module")
def wrong_unit(organ, seen, landmarks):
    """One landmark, half the true unit."""
    one = Landmarks(landmarks.positions[:1])
    return register(organ, seen.cloud, landmarks=one, unit=SceneUnit(MM_PER_UNIT / 2, 3.0))


def codes(registration):
    return [notice.code for notice in registration.notices]


def test_finds_pose_and_deformation_without_landmarks(organ, seen, result):
    truth = POSE.apply(bend(seen.points_ct))
    error = map_error(result.organ.map_points(seen.points_ct), truth)
    assert error < 3.5
    assert error < map_error(result.similarities["rigid"].apply(seen.points_ct), truth)
    assert error < map_error(result.similarities["coarse"].apply(seen.points_ct), truth)
    inside = POSE.apply(bend(organ.volume_points))
    assert map_error(result.organ.map_points(organ.volume_points), inside) < 4.5
    assert result.organ.mm_per_unit == pytest.approx(MM_PER_UNIT, rel=0.06)
    assert result.organ.mm_per_scene_unit is None
    assert codes(result) == []


def test_same_seed_same_bits(organ, seen, result):
    again = register(organ, seen.cloud)
    grid = organ.volume_points[::7]
    np.testing.assert_array_equal(again.organ.map_points(grid), result.organ.map_points(grid))
    assert again.metrics == result.metrics


def test_moving_the_ct_changes_nothing(organ, seen, result):
    """A rigid motion of the CT: the same points of the organ land in the same place."""
    moved = replace(
        organ,
        vertices=T_MOVED_CT.apply(organ.vertices),
        vertex_normals=T_MOVED_CT.turn(organ.vertex_normals),
        volume_points=T_MOVED_CT.apply(organ.volume_points),
    )
    found = register(moved, seen.cloud)
    before = result.organ.map_points(seen.points_ct)
    after = found.organ.map_points(T_MOVED_CT.apply(seen.points_ct))
    assert map_error(after, before) < 1.5  # other samples and candidates: 52 mm is the organ's rms radius
    assert found.organ.mm_per_unit == pytest.approx(result.organ.mm_per_unit, rel=0.02)


def test_registration_tells_its_stages(organ, seen, result):
    assert list(result.similarities) == ["before", "coarse", "rigid", "elastic"]
    before = result.stage_points("before")
    np.testing.assert_allclose(before.mean(0), result.target.mean(0), atol=0.05 * 52 / MM_PER_UNIT)
    np.testing.assert_array_equal(result.similarities["before"].rotation, np.eye(3))
    np.testing.assert_array_equal(result.stage_points("elastic"), result.organ.scene_vertices)
    np.testing.assert_allclose(result.stage_points("rigid"), result.similarities["rigid"].apply(organ.vertices))
    assert set(result.stops) == {"coarse", "rigid", "elastic"}
    assert set(result.seconds) == {"coarse", "basis", "rigid", "elastic"}
    assert all(value > 0 for value in result.seconds.values())
    assert len(result.steps) == result.stops["elastic"].iterations
    assert result.facts["landmarks"] == "0" and result.facts["unit"] == "not stated"
    assert len(result.splat_points) == len(result.splat_colours) <= len(seen.points)


def test_elastic_similarity_holds_the_whole_rigid_part(organ, result):
    """What is left beyond the similarity is no rotation and no shift."""
    rest = result.organ.quadrature_points
    moved = rest + result.organ.deformation.inside(rest)[0]
    np.testing.assert_allclose(moved.mean(0), rest.mean(0), atol=1e-6)
    a, b = rest - rest.mean(0), moved - moved.mean(0)
    np.testing.assert_allclose((a.T @ b) - (b.T @ a), 0, atol=1e-6 * (a * a).sum())


def test_metrics_have_units_and_tell_progress(result, with_landmarks):
    for registration in (result, with_landmarks[0]):
        for stage in ("coarse", "rigid", "elastic"):
            for name, entry in registration.metrics[stage].items():
                assert set(entry) == {"value", "unit"} and entry["unit"], name
                assert np.isfinite(entry["value"]), name
    units = {name: entry["unit"] for name, entry in result.metrics["elastic"].items()}
    assert units["trim30_splat_to_ct"] == "mm" and units["volume_drift"] == "%" and units["min_det_F"] == "1"
    trims = [result.metrics[stage]["trim30_splat_to_ct"]["value"] for stage in ("coarse", "elastic")]
    assert trims[1] < trims[0]
    assert result.metrics["elastic"]["min_det_F"]["value"] > 0.5
    assert abs(result.metrics["elastic"]["volume_drift"]["value"]) < 3


def test_exact_unit_holds_the_scale_to_the_organs_own_percent(with_landmarks, seen):
    found, _ = with_landmarks
    assert 1 / found.organ.T_scene_ct.scale == pytest.approx(MM_PER_UNIT, rel=SWELLING / 100)
    assert found.organ.mm_per_scene_unit == MM_PER_UNIT
    for stage in ("coarse", "rigid"):  # the search already keeps to it
        assert found.similarities[stage].scale == pytest.approx(1 / MM_PER_UNIT)
    truth = POSE.apply(bend(seen.points_ct))
    assert map_error(found.organ.map_points(seen.points_ct), truth) < 3.0


def test_landmark_off_the_surface_is_projected_and_told(with_landmarks):
    found, _ = with_landmarks
    assert codes(found) == ["landmark_projected"]
    assert "tip" in found.notices[0].message
    assert found.facts["landmarks"] == "2" and "30 mm" in found.facts["unit"]
    assert found.organ.provenance == {"splat": "00ff"}


def test_progress_goes_through_all_stages(with_landmarks):
    stages = [stage for stage, _ in with_landmarks[1]]
    assert list(dict.fromkeys(stages)) == ["coarse", "basis", "rigid", "elastic"]
    assert all(0 <= part <= 1 for _, part in with_landmarks[1])
    for stage in ("rigid", "elastic"):
        parts = [part for name, part in with_landmarks[1] if name == stage]
        assert parts == sorted(parts)


def test_wrong_unit_and_single_landmark_are_told(wrong_unit):
    assert {"scale_disagrees", "single_landmark"} <= set(codes(wrong_unit))
    message = next(n.message for n in wrong_unit.notices if n.code == "scale_disagrees")
    assert "15 mm" in message


@pytest.mark.parametrize("stage", ["coarse", "elastic"])
def test_cancelling_early_or_late_is_passed_on(organ, seen, stage):
    def cancel(name, fraction):
        if name == stage:
            raise Cancelled

    with pytest.raises(Cancelled):
        register(organ, seen.cloud, progress=cancel)


def test_landmark_far_away_is_refused(organ, seen):
    far = Landmarks(organ.vertices[:1] + np.array([0.0, 0, 60]), ("apex",))
    with pytest.raises(InputError, match=r"landmark apex lies \d\d mm"):
        register(organ, seen.cloud, landmarks=far)


def test_paper_method_without_landmarks_is_refused(organ, seen):
    with pytest.raises(InputError, match="landmarks"):
        register(organ, seen.cloud, RegisterOptions(method="paper"))


@pytest.mark.parametrize(
    "wrong", [{"method": "icp"}, {"stiffness": "soft"}, {"weights": "none"}, {"seed": -1}], ids=lambda w: next(iter(w))
)
def test_unknown_options_are_refused(wrong):
    with pytest.raises(InputError, match=r"expected|method|stiffness|weights|seed"):
        RegisterOptions(**wrong)


def test_empty_selection_is_refused(organ, seen):
    with pytest.raises(InputError, match="opacity"):
        register(organ, seen.cloud, RegisterOptions(opacity=0.95))
    with pytest.raises(InputError, match="region of interest"):
        register(organ, seen.cloud, box=Box(np.full(3, 99.0), np.ones(3)))


def test_scene_splits_target_and_surroundings():
    centres = np.array([[0, 0, 5.0], [1, 0, 5], [0, 1, 5], [9, 0, 5], [9, 1, 5], [0, 0, 6]])
    opacity = np.array([0.9, 0.9, 0.9, 0.9, 0.05, 0.9])
    valid = np.array([True, True, True, True, True, False])
    cloud = GaussianCloud(centres, opacity, np.zeros((6, 3)), valid)
    scene = select_scene(cloud, Box([0, 0, 5], [4, 4, 4]), RegisterOptions(), lambda stage, part: None)
    np.testing.assert_array_equal(scene.centres, centres[:3])
    np.testing.assert_array_equal(scene.others, centres[3:4])
    np.testing.assert_array_equal(scene.picture, [0, 1, 2, 3])
    assert scene.notices == ()


@pytest.mark.parametrize(("off_mm", "expected"), [(5.0, []), (20.0, ["landmark_projected"])])
def test_landmark_checks(organ, off_mm, expected):
    top = organ.vertices[organ.vertices[:, 2].argmax()]
    position = (top + np.array([0.0, 0.0, off_mm]))[None]
    given = position.copy()
    found, notices = checked_landmarks(Landmarks(position), organ)
    assert [notice.code for notice in notices] == expected
    np.testing.assert_allclose(found[0], top if expected else position[0])
    np.testing.assert_array_equal(position, given)  # the input is left alone
    assert not expected or "number 1" in notices[0].message


def test_unit_as_prior_of_the_scale(organ):
    """At scale s = length / unit the prior holds the scale: gamma = s_start / s."""
    samples = sample_surface(organ, count=1500)
    unit = SceneUnit(20.0, 4.0)
    expected = unit_scale(unit, samples)
    assert expected == pytest.approx(samples.normalisation.length / 20)
    start = Similarity(1.1 * expected, np.eye(3), np.zeros(3))
    prior = scale_prior(start, expected, unit)
    assert start.scale / prior.gamma == pytest.approx(expected) and 0 < prior.weight < np.inf
    exact = scale_prior(start, expected, SceneUnit(20.0))
    assert exact.weight == pytest.approx(ScalePrior.of(1.1, SWELLING).weight)
    assert prior.weight == pytest.approx(exact.weight / (1 + (4 / SWELLING) ** 2))
    assert unit_scale(None, samples) is None and scale_prior(start, None, None).weight == 0


@pytest.mark.parametrize(
    ("factor", "disagrees"), [(1.0, False), (1.1, False), (1 / 1.1, False), (1.2, True), (1 / 1.2, True), (10, True)]
)
def test_unit_is_doubted_beyond_fifteen_percent(organ, factor, disagrees):
    samples = sample_surface(organ, count=1500)
    unit = SceneUnit(20.0)
    notices = unit_notices(factor * unit_scale(unit, samples), samples, unit)
    assert [notice.code for notice in notices] == ["scale_disagrees"] * disagrees
    assert unit_notices(1.0, samples, None) == ()


def healthy(**changes):
    """A half seen sphere of 50 mm 150 mm from the camera at the origin, 1 scene unit = 1 mm."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    seen = normals[:, 2] < -0.3
    state = SurfaceState(
        points=np.array([0, 0, 200.0]) + 50 * normals,
        normals=normals,
        displacement_mm=np.where(seen, 6.0, 4.0),
        distance_mm=np.where(seen, 0.5, 30.0),
        radius_mm=50.0,
        det_f=rng.uniform(0.8, 1.2, 500),
    )
    return replace(state, **changes)


def notice_codes(state, *, name="liver", volume_ml=1500.0, mm_per_unit=1.0, camera=(0.0, 0.0, 0.0)):
    found = result_notices(state, np.array(camera), name=name, volume_ml=volume_ml, mm_per_unit=mm_per_unit)
    return [notice.code for notice in found]


def test_healthy_result_raises_no_notice():
    assert notice_codes(healthy()) == []


def test_each_result_notice_has_its_cause():
    state = healthy()
    few = np.where(np.arange(2000) < 100, state.distance_mm, 30.0)
    assert "little_seen" in notice_codes(replace(state, distance_mm=few, displacement_mm=np.zeros(2000)))
    assert notice_codes(replace(state, det_f=np.append(state.det_f, 0.0))) == ["folded"]
    hidden = np.where(state.distance_mm > 10, 12.0, 6.0)
    assert notice_codes(replace(state, displacement_mm=hidden)) == ["hidden_tissue_moved"]
    assert notice_codes(replace(state, displacement_mm=np.where(hidden > 10, 4.9, 0.1))) == []  # under 5 mm
    assert notice_codes(state, volume_ml=90.0) == ["implausible_volume"]
    assert notice_codes(state, name="kidney_left", volume_ml=90.0) == []
    assert notice_codes(state, name="thing", volume_ml=90.0) == []
    assert notice_codes(state, mm_per_unit=0.05) == ["implausible_scale"]
    assert notice_codes(state, mm_per_unit=4.0) == ["implausible_scale"]


def test_what_faces_away_is_not_seen():
    """The camera behind the organ: the surface near the splat faces the other way."""
    state = healthy()
    assert state.seen(np.zeros(3)).mean() == pytest.approx(0.35, abs=0.03)
    assert not state.seen(np.array([0.0, 0, 400])).any()
    assert "little_seen" in notice_codes(state, camera=(0.0, 0.0, 400.0))
