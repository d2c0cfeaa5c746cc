"""Training of the learned skinning weights (Modi et al., "Simplicits", ACM TOG 2024, section 4.2), with torch.

Loss: mean elastic energy of random handle transforms, blended from linear to Neo-Hookean elasticity over the
training, plus the departure of the weights (constant handle included) from orthonormality over the organ.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..ground.checks import Array, InputError, as_points
from ..ground.progress import Progress, no_progress
from ..points.sampling import random_subset
from .learned import LearnedWeights
from .learned_loss import training_loss


@dataclass(frozen=True)
class TrainingOptions:
    """hidden layers of ``width``; per step ``samples`` points and ``batch`` random transforms with entries of standard
    deviation ``spread``; ``orthogonality``: weight of that loss against the energy per unit Young's modulus."""

    handles: int = 20
    steps: int = 1500
    layers: int = 4
    width: int = 64
    samples: int = 600
    batch: int = 8
    spread: float = 0.1
    orthogonality: float = 50.0
    learning_rate: float = 5e-3
    nu: float = 0.45
    seed: int = 0
    device: str = "cpu"


def train(points: Array, options: TrainingOptions | None = None, *, progress: Progress = no_progress) -> LearnedWeights:
    """Learned weights on volume points (N, 3) of the normalised frame; same seed and machine, same weights."""
    torch, options = _torch(), options or TrainingOptions()
    points = as_points(points, "volume points", minimum=8)
    if not 2 <= options.handles <= len(points) // 4:
        raise InputError(f"handles: expected 2 to a quarter of the {len(points)} points, got {options.handles}")
    rng = np.random.default_rng(options.seed)
    centre = points.mean(0)
    extent = float(np.abs(points - centre).max())
    network = _initial(rng, options, torch)
    optimiser = torch.optim.Adam(network, lr=options.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, options.steps, options.learning_rate / 30)
    for step in range(options.steps):
        progress("basis", step / options.steps)
        at = points[rng.choice(len(points), min(options.samples, len(points)), replace=False)]
        transforms = options.spread * rng.standard_normal((options.batch, 4 * options.handles, 3))
        optimiser.zero_grad()
        training_loss(
            network,
            at,
            (centre, extent),
            transforms,
            blend=step / options.steps,
            nu=options.nu,
            orthogonality=options.orthogonality,
            torch=torch,
        ).backward()
        optimiser.step()
        schedule.step()
    layers = [layer.detach().cpu().numpy().astype(np.float64) for layer in network]
    learned = LearnedWeights(tuple(layers[::2]), tuple(layers[1::2]), centre, extent)
    return orthonormalised(learned, points[random_subset(len(points), 4000, options.seed)])


def _initial(rng: np.random.Generator, options: TrainingOptions, torch: Any) -> list[Any]:
    """Random matrices and zero offsets [W_0, b_0, W_1, ...], drawn by numpy: no global torch seed is touched."""
    widths = [3, *[options.width] * options.layers, options.handles - 1]
    arrays: list[Array] = []
    for a, b in pairwise(widths):
        arrays += [rng.standard_normal((a, b)) * np.sqrt(1.5 / a), 0.1 * rng.standard_normal(b)]
    return [torch.tensor(x, dtype=torch.float32, device=options.device, requires_grad=True) for x in arrays]


def orthonormalised(weights: LearnedWeights, points: Array) -> LearnedWeights:
    """The same space of deformations with zero-mean, orthonormal weights in the order of their stiffness.

    Only the last, linear layer changes: it takes up the mean, the QR factor and the rotation to principal modes.
    """
    values, gradients = weights.values_and_gradients(points)
    values, gradients = values[:, :-1], gradients[:, :-1]
    mean = values.mean(0)
    mix = np.linalg.inv(np.linalg.qr((values - mean) / np.sqrt(len(points)), mode="r"))
    mixed = np.einsum("nkm,kh->nhm", gradients, mix)
    mix = mix @ np.linalg.eigh(np.einsum("nhm,nkm->hk", mixed, mixed))[1]
    mix *= np.sign(mix[np.abs(mix).argmax(0), np.arange(mix.shape[1])])
    matrices = (*weights.matrices[:-1], weights.matrices[-1] @ mix)
    offsets = (*weights.offsets[:-1], (weights.offsets[-1] - mean) @ mix)
    return LearnedWeights(matrices, offsets, weights.centre, weights.extent)


def _torch() -> Any:
    """torch, or one line that says how to get it."""
    try:
        import torch
    except ImportError as error:
        raise InputError(
            "learned weights need torch: install it with pip install 'torch==2.13.0', or choose weights 'rkpm'"
        ) from error
    return torch
