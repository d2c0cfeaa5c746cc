"""The verdict: what speaks against a registration, and how much."""

from dataclasses import replace

import numpy as np
import pytest
from asset_examples import bent_organ

from organphys.asset.surface_distance import vertex_normals
from organphys.basis.reduced_covariance import ReducedCovariance
from organphys.elastic.mirrored import mirror_image, mirror_starts
from organphys.elastic.reduced_organ import ReducedOrganOptions, reduce_organ
from organphys.exports.report_page import verdict_box
from organphys.ground.frames import Similarity, rotation_about
from organphys.ground.notices import Notice
from organphys.pipeline.confidence_metrics import confidence_metrics
from organphys.pipeline.fit_evidence import FitEvidence
from organphys.pipeline.verdict import CHECK, REFUSE, TRUST, verdict_of
from organphys.points.point_sets import Organ
from organphys.points.surface_samples import sample_surface

GOOD = FitEvidence(score=0.4, landmarks=0.0, seen=0.3, last_move=4e-4, mirrored=0.85)
SHAPE = {"min_det_F": 0.8, "volume_drift": -1.0, "error_95_hidden": 5.0}


def judged(evidence: FitEvidence | None = GOOD, notices: tuple[Notice, ...] = (), **shape: float) -> tuple[str, set]:
    metrics = {name: {"value": value, "unit": "1"} for name, value in (SHAPE | shape).items()}
    verdict = verdict_of(evidence, metrics, notices, radius_mm=50.0)
    return verdict.level, {reason.code for reason in verdict.reasons}


def test_a_good_fit_is_trusted() -> None:
    assert judged() == (TRUST, set())
    assert judged(notices=(Notice("single_landmark", "One landmark."),)) == (TRUST, set())


@pytest.mark.parametrize(
    ("change", "level", "code"),
    [
        ({"score": 0.62}, CHECK, "poor_fit"),
        ({"score": 0.9}, REFUSE, "poor_fit"),
        ({"score": float("nan")}, REFUSE, "poor_fit"),
        ({"landmarks": 0.15}, CHECK, "landmarks_disagree"),
        ({"seen": 0.1}, CHECK, "barely_seen"),
        ({"seen": 0.02}, REFUSE, "barely_seen"),
        ({"last_move": 0.05}, CHECK, "not_converged"),
        ({"last_move": np.inf}, REFUSE, "not_converged"),
        ({"mirrored": 0.41}, CHECK, "handedness"),
        ({"mirrored": 0.3}, REFUSE, "handedness"),
    ],
)
def test_evidence_against_the_fit(change: dict[str, float], level: str, code: str) -> None:
    assert judged(replace(GOOD, **change)) == (level, {code})


@pytest.mark.parametrize(
    ("change", "level", "code"),
    [
        ({"min_det_F": 0.2}, CHECK, "squeezed"),
        ({"min_det_F": -0.1}, REFUSE, "squeezed"),
        ({"volume_drift": -15.0}, CHECK, "volume_changed"),
        ({"error_95_hidden": 15.0}, CHECK, "hidden_side_unsure"),
        ({"error_95_hidden": 30.0}, REFUSE, "hidden_side_unsure"),
    ],
)
def test_shape_against_the_fit(change: dict[str, float], level: str, code: str) -> None:
    assert judged(**change) == (level, {code})


def test_the_worst_reason_decides_and_comes_first() -> None:
    metrics = {"volume_drift": {"value": 20.0, "unit": "%"}}
    verdict = verdict_of(replace(GOOD, score=1.2), metrics, (), radius_mm=50.0)
    assert verdict.level == REFUSE
    assert [reason.code for reason in verdict.reasons] == ["poor_fit", "volume_changed"]
    assert verdict.as_dict()["reasons"][0]["level"] == REFUSE


def test_doubtful_notices_and_methods_without_evidence_ask_for_a_look() -> None:
    assert judged(notices=(Notice("scale_disagrees", "The unit disagrees."),)) == (CHECK, {"scale_disagrees"})
    assert judged(None) == (CHECK, {"not_measured"})


def test_report_box_shows_level_and_each_message_once() -> None:
    notice = Notice("little_seen", "Only 9 % <is> seen.")
    verdict = verdict_of(replace(GOOD, score=1.2), {}, (notice,), radius_mm=50.0)
    html = verdict_box(verdict, (notice, Notice("other", "Something else.")))
    assert "verdict stop" in html and "Do not trust" in html
    assert html.count("Only 9 % &lt;is&gt; seen.") == 1 and "Something else." in html
    assert 'class="verdict"' in verdict_box(verdict_of(GOOD, {}, (), radius_mm=50.0), ())


def test_mirror_image_is_the_reflected_organ() -> None:
    bent = bent_organ()
    normals = vertex_normals(bent.vertices, bent.faces)
    boundary = np.zeros(len(bent.volume_points), dtype=bool)
    organ = Organ(bent.vertices, bent.faces, normals, bent.volume_points, boundary, np.ones(3), bent.volume_ml)
    samples = sample_surface(organ, count=500)
    reduced = reduce_organ(organ, samples, options=ReducedOrganOptions(handles=5, nodes=60, basis_samples=400))
    mirror, flip = mirror_image(reduced), np.array([-1.0, 1.0, 1.0])
    z = 0.03 * np.random.default_rng(0).normal(size=(reduced.basis.size, 3))
    assert np.allclose(mirror.points(z * flip), reduced.points(z) * flip)
    assert mirror.elasticity.energy(z * flip) == pytest.approx(reduced.elasticity.energy(z))
    assert np.allclose(mirror.normals(z * flip), reduced.normals(z) * flip)
    step = z.ravel()
    assert (z * flip).ravel() @ mirror.rest_hessian @ (z * flip).ravel() == pytest.approx(
        step @ reduced.rest_hessian @ step
    )


def test_mirror_starts_reflect_the_placed_organ() -> None:
    rng = np.random.default_rng(1)
    points = rng.normal(size=(400, 3)) * [1.0, 0.6, 0.3] @ rotation_about(np.array([1.0, 2, 3]), 0.9).T
    points -= points.mean(0)
    pose = Similarity(2.0, rotation_about(np.array([0.0, 1, 1]), 0.4), np.array([1.0, 2, 9]))
    axes = np.linalg.svd(points, full_matrices=False)[2]
    placed = [start.apply(points * [-1, 1, 1]) for start in mirror_starts(points, pose)]
    assert all(np.linalg.det(start.rotation) > 0.999 for start in mirror_starts(points, pose))
    for axis in axes:
        expected = pose.apply(points - 2 * np.outer(points @ axis, axis))
        assert min(np.abs(found - expected).max() for found in placed) < 1e-9


def test_confidence_metrics_are_medians_of_the_radii() -> None:
    organ = bent_organ()
    assert confidence_metrics(organ, np.ones(len(organ.vertices), dtype=bool)) == {}
    factor = np.zeros((3 * organ.basis.size + 1, 1))
    factor[-1] = 0.01  # the scale alone is unsure: points move in proportion to their distance from the centre
    organ = replace(organ, uncertainty=ReducedCovariance(factor))
    seen = organ.vertices[:, 0] > 60
    metrics = confidence_metrics(organ, seen)
    assert set(metrics) == {f"error_{p}_{r}" for p in (68, 95) for r in ("visible", "hidden", "interior")}
    x = organ.normalisation.apply(organ.vertices)
    moved = 0.01 * organ.normalisation.length * np.linalg.norm(x + organ.basis.phi(x) @ organ.z, axis=1)
    value = metrics["error_95_visible"]["value"]
    assert value == pytest.approx(1.96 * np.median(moved[seen]), rel=0.02)
