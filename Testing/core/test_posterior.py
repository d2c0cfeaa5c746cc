"""Confidence: covariance of coordinates and points, and the radius that holds an error."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from asset_examples import CENTRE_MM, bent_organ

from organphys.asset.asset_file import asset_bytes, asset_from_bytes, load_asset, save_asset
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.basis.error_radius import error_radius
from organphys.basis.reduced_covariance import ReducedCovariance
from organphys.elastic.posterior import PosteriorConstants, PosteriorTerms
from organphys.elastic.residual_statistics import residual_statistics
from organphys.ground.checks import InputError
from organphys.ground.frames import Similarity, rotation_about

COUNT = 40_000


def uncertain_organ(freedom: float = np.inf) -> RegisteredOrgan:
    organ = bent_organ()
    rng = np.random.default_rng(5)
    factor = 0.004 * rng.normal(size=(3 * organ.basis.size + 1, 30))
    return replace(organ, uncertainty=ReducedCovariance(factor, freedom))


@pytest.mark.parametrize("spread", [(1, 1, 1), (1, 0, 0), (1, 0.6, 0.2), (1, 0.9, 0.05), (3, 1, 1)])
@pytest.mark.parametrize("freedom", [np.inf, 6.0])
def test_radius_holds_the_stated_share_of_sampled_errors(spread: tuple[float, ...], freedom: float) -> None:
    rng = np.random.default_rng(0)
    turn = rotation_about(np.array([1.0, -2, 0.5]), 1.1)
    covariance = turn @ np.diag(np.square(spread)) @ turn.T
    errors = (rng.normal(size=(COUNT, 3)) * spread) @ turn.T
    if np.isfinite(freedom):
        errors *= np.sqrt((freedom - 2) / rng.chisquare(freedom, COUNT))[:, None]
    lengths = np.linalg.norm(errors, axis=1)
    for probability in (0.68, 0.95):
        radius = error_radius(covariance[None], probability, freedom=freedom)[0]
        assert (lengths <= radius).mean() == pytest.approx(probability, abs=0.025)


def test_radius_of_no_uncertainty_and_bad_probability() -> None:
    assert error_radius(np.zeros((2, 3, 3)), 0.95).tolist() == [0.0, 0.0]
    for probability in (0.0, 1.0, 68.0):
        with pytest.raises(InputError):
            error_radius(np.eye(3)[None], probability)


def test_covariance_of_a_linear_problem_is_that_of_its_estimates() -> None:
    """Noise on linear data through the estimator, many times over: Monte Carlo against the formula."""
    rng = np.random.default_rng(1)
    count, size, noise = 60, 13, 0.3
    slopes = rng.normal(size=(count, size))
    terms = PosteriorTerms(slopes.T @ slopes / noise**2, np.zeros((size - 1, size - 1)), 0.0)
    found = terms.covariance(PosteriorConstants(data=1.0, temperature=1.0, freedom=np.inf))
    estimates = np.linalg.lstsq(slopes, noise * rng.normal(size=(count, COUNT)), rcond=None)[0]
    expected = estimates @ estimates.T / COUNT
    whole = found.factor @ found.factor.T
    assert np.abs(whole - expected).max() < 0.03 * np.abs(expected).max()


def test_prior_takes_over_where_the_data_says_nothing() -> None:
    energy = np.diag(np.arange(1.0, 13.0))
    terms = PosteriorTerms(np.zeros((13, 13)), energy, 4.0)
    factor = terms.covariance(PosteriorConstants(data=2.0, temperature=0.5, freedom=np.inf)).factor
    assert np.allclose(factor @ factor.T, np.diag([*(0.5 / np.arange(1.0, 13.0)), 0.25]), rtol=1e-6)
    heavy = terms.covariance(PosteriorConstants(data=2.0, temperature=0.5, freedom=6.0)).factor
    assert np.allclose(heavy @ heavy.T, 1.5 * factor @ factor.T)  # the variance of a Student t: 6 / (6 - 2)


def test_correlated_residuals_count_less() -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform(-1, 1, (1500, 3)) * [1, 1, 0.02]
    white = rng.normal(size=1500)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    smooth = np.exp(-((distance / 0.1) ** 2)) @ white
    ones = np.ones(1500)
    independent = residual_statistics(points, white, ones).independent
    assert residual_statistics(points, 2 * white, ones).variance == pytest.approx(4 * np.mean(white**2))
    correlated = residual_statistics(points, smooth, ones).independent
    assert independent > 600
    assert 30 < correlated < 200  # 4 areas of 2 pi 0.1^2 each, about 64


def test_point_covariance_is_that_of_moved_organs() -> None:
    organ = uncertain_organ()
    points = CENTRE_MM + np.array([[0.0, 0, 0], [30, 10, -5], [-50, 0, 0], [10, -20, 10]])
    rng, moved = np.random.default_rng(3), []
    for _ in range(3000):
        q = organ.uncertainty.factor @ rng.normal(size=organ.uncertainty.factor.shape[1])
        pose = organ.T_scene_ct
        x = organ.normalisation.apply(points)
        shifted = x + organ.basis.phi(x) @ (organ.z + q[:-1].reshape(-1, 3))
        # scale s / gamma about the normalisation's centre
        centre = pose.apply(organ.normalisation.centre[None])[0]
        scale = pose.scale * organ.normalisation.length / (1 + q[-1])
        scene = Similarity(scale, pose.rotation, centre).apply(shifted)
        moved.append((scene - organ.map_points(points)) / pose.scale @ pose.rotation)
    sampled = np.einsum("kna,knb->nab", np.array(moved), np.array(moved)) / 3000
    assert np.abs(organ.covariance(points) - sampled).max() < 0.12 * np.abs(sampled).max()


def test_radius_grows_beside_the_organ_and_matches_at_its_surface() -> None:
    organ = uncertain_organ(6.0)
    away = CENTRE_MM + np.array([60.0, 0, 0]) + np.array([1.0, 0, 0]) * np.array([[-0.05], [0.05], [60], [400]])
    radius = organ.error_radius(away, 0.95)
    assert radius[1] == pytest.approx(radius[0], rel=0.1)
    assert radius[1] < radius[2] < radius[3]
    assert (organ.error_radius(away, 0.68) < radius).all()
    surface = organ.surface_error_mm(0.95)
    assert surface.shape == (len(organ.vertices),)
    assert np.allclose(surface[::50], organ.error_radius(organ.vertices[::50], 0.95), rtol=1e-3)


@pytest.mark.parametrize("freedom", [6.0, np.inf])
def test_asset_keeps_the_uncertainty(tmp_path: Path, freedom: float) -> None:
    organ = uncertain_organ(freedom)
    save_asset(organ, tmp_path / "organ.organphys")
    again = load_asset(tmp_path / "organ.organphys")
    points = CENTRE_MM + np.random.default_rng(0).normal(0, 30, (50, 3))
    assert np.array_equal(again.error_radius(points, 0.68), organ.error_radius(points, 0.68))
    assert again.uncertainty.freedom == freedom


def test_assets_without_uncertainty_still_load() -> None:
    plain = asset_bytes(bent_organ())
    assert asset_from_bytes(plain).uncertainty is None
    with pytest.raises(InputError, match="register it again"):
        asset_from_bytes(plain).covariance(CENTRE_MM[None])


def test_wrong_factor_is_refused() -> None:
    with pytest.raises(InputError, match="rows"):
        replace(bent_organ(), uncertainty=ReducedCovariance(np.zeros((13, 2))))
    with pytest.raises(InputError, match="finite"):
        ReducedCovariance(np.full((13, 2), np.nan))
    with pytest.raises(InputError, match="degrees"):
        ReducedCovariance(np.zeros((13, 2)), 2.0)
