"""Tissue that a tool draws up is left out of the data together with its flanks; clutter beside the organ stays."""

from dataclasses import replace

import numpy as np
import pytest
from scene_examples import POSE, bumpy_organ, seen_from_camera

from organphys.align.splat_view import SplatView
from organphys.elastic.data_terms import DataOptions, splat_matches
from organphys.elastic.elastic_registration import ElasticOptions, ElasticState, register_elastically
from organphys.elastic.held_tissue import free_tissue
from organphys.elastic.reduced_organ import ReducedOrganOptions, reduce_organ
from organphys.points.surface_samples import sample_surface

TAU = 0.12


@pytest.fixture(scope="module")
def setting():
    """Reduced organ, view of a rigid copy and its true state."""
    record = bumpy_organ()
    samples = sample_surface(record, count=2500)
    options = ReducedOrganOptions(handles=6, nodes=150, basis_samples=1500, quadrature=600)
    organ, truth = reduce_organ(record, samples, options=options), POSE @ samples.normalisation.T_ct_normalised
    return organ, seen_from_camera(record).view(), ElasticState(np.zeros((organ.basis.size, 3)), 1.0, truth)


def drawn_up(view: SplatView, *, reach: float, height: float) -> tuple[SplatView, np.ndarray]:
    """The samples around the middle one within ``reach`` moved towards the camera, up to ``height``; which were."""
    samples = view.surface.samples
    middle = samples[np.linalg.norm(samples - np.median(samples, axis=0), axis=1).argmin()]
    share = np.clip(1 - (np.linalg.norm(samples - middle, axis=1) / reach) ** 2, 0, None)
    moved = samples - height * share[:, None] * samples / np.linalg.norm(samples, axis=1, keepdims=True)
    return replace(view, surface=replace(view.surface, samples=moved)), share > 0


def weights(organ, view, state):
    shape = state.deformed(organ)
    return free_tissue(shape, view, splat_matches(shape, view, TAU, DataOptions()), TAU)


def test_all_of_an_undisturbed_organ_is_free(setting):
    assert np.quantile(weights(*setting), 0.02) > 0.8


def test_a_fold_is_left_out_with_its_flanks(setting):
    organ, view, state = setting
    size = state.pose.scale
    view, fold = drawn_up(view, reach=0.45 * size, height=0.3 * size)
    free = weights(organ, view, state)
    shape = state.deformed(organ)
    robust = len(fold) * splat_matches(shape, view, TAU, DataOptions()).weights
    flanks = fold & (robust > 0.3 * np.median(robust))  # what the robust weight alone would keep
    assert flanks.sum() > 0.15 * fold.sum()
    assert free[flanks].mean() < 0.5
    assert np.median(free[fold]) < 0.15
    far = np.linalg.norm(view.surface.samples - view.surface.samples[fold].mean(0), axis=1) > 0.9 * size
    assert far.any()
    assert np.median(free[far]) > 0.8


def test_surface_beside_the_organ_does_not_take_its_edge_away(setting):
    """A neighbour that goes on where the organ ends lies across the rays from it, not along them."""
    organ, view, state = setting
    samples = view.surface.samples
    right = samples[samples[:, 0] > np.quantile(samples[:, 0], 0.9)]
    beyond = right + np.array([0.3 * state.pose.scale, 0.0, 0.0])
    added = np.concatenate([samples, beyond])
    normals = np.concatenate([view.surface.sample_normals, view.surface.sample_normals[: len(beyond)]])
    cluttered = replace(view, surface=replace(view.surface, samples=added, sample_normals=normals))
    free = weights(organ, cluttered, state)[: len(samples)]
    assert np.median(free[samples[:, 0] > np.quantile(samples[:, 0], 0.85)]) > 0.5


def test_the_fold_does_not_pull_the_organ(setting):
    organ, view, state = setting
    size = state.pose.scale
    view, _ = drawn_up(view, reach=0.45 * size, height=0.35 * size)
    moved = []
    for kept in (True, False):
        options = ElasticOptions(data=DataOptions(free_only=kept))
        found, _ = register_elastically(organ, view, state.start, options=options)
        placed = found.pose.apply(organ.points(found.z))
        moved.append(np.linalg.norm(placed - state.start.apply(organ.samples.points), axis=1).mean() / size)
    assert moved[0] < 0.6 * moved[1]
