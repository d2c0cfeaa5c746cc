"""Loss that the learned skinning weights are trained on: elastic energy of random transforms and orthonormality.

All functions take the module ``torch`` as an argument, so that importing this file does not load it.
"""

from __future__ import annotations

from typing import Any

from ..ground.checks import Array
from ..mechanics.neo_hookean import lame_constants


def training_loss(
    network: list[Any],
    at: Array,
    frame: tuple[Array, float],
    transforms: Array,
    *,
    blend: float,
    nu: float,
    orthogonality: float,
    torch: Any,
) -> Any:
    """Scalar loss at points ``at`` (Q, 3) under handle transforms (B, 4H, 3).

    Energy per unit Young's modulus, ``blend`` from 0 (linear) to 1 (Neo-Hookean); frame: (centre (3,), extent) of the
    network's input; ``orthogonality`` weighs the squared Frobenius norm of the weights' Gram matrix minus identity.
    """
    x = torch.tensor(at, dtype=torch.float32, device=network[0].device)
    w, slope = weights_and_slopes(network, x, frame, torch)
    count = len(x)
    w = torch.cat([w, torch.ones(count, 1, device=x.device)], 1)
    slope = torch.cat([slope, torch.zeros(3, count, 1, device=x.device)], 2)
    affine = torch.cat([x, torch.ones(count, 1, device=x.device)], 1)
    gradient = slope[:, :, :, None] * affine[None, :, None, :]  # d(w_h [X, 1]) / dX_m: (3, Q, H, 4)
    eye = torch.eye(3, 4, device=x.device)
    gradient = (gradient + w[None, :, :, None] * eye[:, None, None, :]).reshape(3 * count, -1)
    z = torch.tensor(transforms, dtype=torch.float32, device=x.device)
    f = (gradient @ z).reshape(len(z), 3, count, 3).permute(0, 2, 3, 1) + torch.eye(3, device=x.device)
    mu, lam = lame_constants(1.0, nu)
    energy = ((1 - blend) * _linear(f, mu, lam, torch) + blend * _neo_hookean(f, mu, lam, torch)).mean()
    gram = w.T @ w / count - torch.eye(w.shape[1], device=x.device)
    return energy + orthogonality * (gram**2).sum()


def _linear(f: Any, mu: float, lam: float, torch: Any) -> Any:
    """Energy density of linear elasticity at F (..., 3, 3)."""
    strain = 0.5 * (f + f.transpose(-1, -2)) - torch.eye(3, device=f.device)
    trace = strain.diagonal(dim1=-1, dim2=-2).sum(-1)
    return mu * (strain**2).sum((-1, -2)) + 0.5 * lam * trace**2


def _neo_hookean(f: Any, mu: float, lam: float, torch: Any) -> Any:
    """StableNeoHookean's energy density, finite also for the inverted F that random transforms make."""
    j = (f[..., 0, :] * torch.linalg.cross(f[..., 1, :], f[..., 2, :])).sum(-1) - 1
    return 0.5 * mu * ((f**2).sum((-1, -2)) - 3) - mu * j + 0.5 * (lam + mu) * j**2


def weights_and_slopes(network: list, x: Any, frame: tuple, torch: Any) -> tuple[Any, Any]:
    """Network outputs (Q, H - 1) and derivatives (3, Q, H - 1), carried forward so that both can be trained on."""
    centre, extent = frame
    value = (x - torch.tensor(centre, dtype=torch.float32, device=x.device)) / extent
    slope = (torch.eye(3, device=x.device) / extent)[:, None, :].expand(3, len(x), 3)
    for k in range(0, len(network) - 2, 2):
        value = torch.nn.functional.elu(value @ network[k] + network[k + 1])
        slope = (slope @ network[k]) * (1 + torch.clamp(value, max=0.0))
    return value @ network[-2] + network[-1], slope @ network[-2]
