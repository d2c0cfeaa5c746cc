"""The learned skinning weights: training, what it reaches, and what happens without torch."""

import sys

import numpy as np
import pytest

from organphys.basis.learned import LearnedWeights, learned_weights
from organphys.basis.learned_training import TrainingOptions, orthonormalised, train
from organphys.basis.rkpm import rkpm_weights
from organphys.ground.checks import InputError
from organphys.ground.progress import Cancelled
from organphys.mechanics.neo_hookean import StableNeoHookean, lame_constants


@pytest.fixture(scope="module")
def points():
    points = np.random.default_rng(0).uniform(-1, 1, (6000, 3))
    return points[(points**2).sum(1) < 1] * [1.0, 0.6, 0.4]


def stiffness(weights, points):
    """Mean squared gradient of every weight but the constant one, from soft to stiff."""
    gradients = weights.values_and_gradients(points)[1][:, :-1]
    return np.linalg.eigvalsh(np.einsum("nhm,nkm->hk", gradients, gradients) / len(points))


def test_training_comes_close_to_the_rkpm_modes(points):
    pytest.importorskip("torch")
    options = TrainingOptions(handles=5, steps=150, layers=3, width=32, samples=300, batch=4)
    learned, exact = train(points, options), rkpm_weights(points, handles=5, nodes=200)
    untrained = train(points, TrainingOptions(handles=5, steps=1, layers=3, width=32, samples=300, batch=4))
    assert stiffness(learned, points).sum() < 1.35 * stiffness(exact, points).sum()
    assert stiffness(untrained, points).sum() > 1.5 * stiffness(exact, points).sum()
    gram = learned.values(points).T @ learned.values(points) / len(points)
    np.testing.assert_allclose(gram, np.eye(5), atol=0.1)


def test_training_is_seeded_and_can_be_cancelled(points):
    pytest.importorskip("torch")
    a, b, c = (learned_weights(points, handles=4, steps=3, seed=seed).values(points[:50]) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert np.abs(a - c).max() > 1e-3
    seen = []

    def stop(stage, fraction):
        seen.append((stage, fraction))
        if fraction > 0.4:
            raise Cancelled

    with pytest.raises(Cancelled):
        learned_weights(points, handles=4, steps=10, progress=stop)
    assert seen[0] == ("basis", 0.0) and len(seen) < 10


def test_losses_are_the_energies_of_the_mechanics():
    torch = pytest.importorskip("torch")
    from organphys.basis.learned_loss import _linear, _neo_hookean

    mu, lam = lame_constants(1.0, 0.45)
    f = np.eye(3) + np.random.default_rng(0).uniform(-0.3, 0.3, (20, 3, 3))
    expected = StableNeoHookean(mu, lam).energy(f)
    np.testing.assert_allclose(_neo_hookean(torch.tensor(f), mu, lam, torch).numpy(), expected, rtol=1e-10, atol=1e-6)
    small = np.eye(3) + 1e-3 * (f - np.eye(3))
    linear = _linear(torch.tensor(small), mu, lam, torch).numpy()
    np.testing.assert_allclose(linear, StableNeoHookean(mu, lam).energy(small), rtol=2e-2)


def test_orthonormalised_keeps_the_space_of_deformations(points):
    rng = np.random.default_rng(3)
    network = LearnedWeights(
        (rng.normal(size=(3, 8)), rng.normal(size=(8, 3))),
        (rng.normal(size=8), rng.normal(size=3)),
        np.zeros(3),
        1.0,
    )
    clean = orthonormalised(network, points)
    before, after = network.values(points), clean.values(points)
    np.testing.assert_allclose(after.T @ after / len(points), np.eye(4), atol=1e-9)
    fitted = before @ np.linalg.lstsq(before, after, rcond=None)[0]
    np.testing.assert_allclose(fitted, after, atol=1e-8)


def test_without_torch_the_error_says_what_to_do(points, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(InputError, match=r"pip install .*rkpm"):
        learned_weights(points, handles=4, steps=1)


def test_bad_handles(points):
    pytest.importorskip("torch")
    with pytest.raises(InputError, match="handles"):
        learned_weights(points, handles=1, steps=1)
