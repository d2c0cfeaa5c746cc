"""Local detail: extra functions and quadrature points where a tool touches, so that a poke makes a dimple.

The functions sit on a lattice fixed in the rest geometry. When the contact moves, those ahead of it are added and
those behind it are dropped once they carry next to nothing: the tissue keeps its shape, and only what is new is
computed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError, as_positive
from .body import Body
from .local_cells import lattice_near, within
from .local_functions import LocalFunctions
from .pins import spring_matrix
from .simulation_basis import SimulationBasis
from .strain_energy import StrainEnergy

FINER = 0.4  # spacing of the fine quadrature points in kernel radii
CELLS = 0.8  # cells whose middle is within so many kernel radii of a kernel are refined
AROUND = 4  # and so many cells nearest to each kernel
WIDER = 1.8  # kernel radius in spacings of the lattice
BESIDE = 0.3  # kernels may lie outside the body by so many spacings


@dataclass(frozen=True)
class LocalDetail:
    """About ``count`` kernels (each three degrees of freedom) within ``radius`` m of the contact at rest.

    They follow the contact when it has moved by more than ``follow`` of the radius.
    """

    radius: float = 0.020
    count: int = 16
    follow: float = 0.3

    def __post_init__(self) -> None:
        as_positive(self.radius, "radius of the local detail")
        as_positive(self.follow, "follow")
        if self.count < 1:
            raise InputError(f"count: expected at least 1 kernel, got {self.count}")

    @property
    def spacing(self) -> float:
        """Edge of the lattice, m: half of a ball of the radius holds ``count`` of its points."""
        return float(self.radius * (2 / 3 * np.pi / self.count) ** (1 / 3))


def with_detail(body: Body, centre: Array, detail: LocalDetail) -> Body:
    """The body with local functions round ``centre`` (3,), m at rest, in place of any it had.

    InputError if no tissue is there.
    """
    return with_kernels(body, kernels_near(body, centre, detail))


def kernels_near(body: Body, centre: Array, detail: LocalDetail) -> LocalFunctions:
    """The kernels of the lattice round ``centre`` (3,), m at rest; InputError if no tissue is there."""
    centres = _centres_near(body, centre, detail)
    if not len(centres):
        raise InputError(f"local detail: no tissue within {1000 * detail.radius:g} mm of the given point")
    return LocalFunctions(centres, WIDER * detail.spacing, np.array(centre))


def _centres_near(body: Body, centre: Array, detail: LocalDetail) -> Array:
    """Lattice points (k, 3) in or just beside the tissue within the radius of ``centre``; the nearest 1.5 ``count``."""
    lattice = lattice_near(centre, detail.radius, detail.spacing)
    lattice = lattice[body.shape.surface.signed(lattice) < BESIDE * detail.spacing] if len(lattice) else lattice
    if not len(lattice):
        surface, points = body.samples.points, body.shape.points
        near = [part[within(part, centre, detail.radius)] for part in (surface, points)]
        return np.concatenate(near)[:1]
    order = np.argsort(((lattice - centre) ** 2).sum(1), kind="stable")
    return lattice[np.sort(order[: 3 * detail.count // 2 + 1])]


def with_kernels(body: Body, kernels: LocalFunctions) -> Body:
    """The body with these local functions in place of any it had."""
    plain = body.plain or body
    away = cKDTree(kernels.centres).query(plain.strain.points)[0]
    refined = away < CELLS * kernels.radius
    nearest = cKDTree(plain.strain.points).query(kernels.centres, k=min(AROUND, len(away)))[1]
    refined[nearest] = True
    fine = plain.refined(_fine(kernels.radius)).of(np.flatnonzero(refined))
    values, local_slopes = kernels.values_and_gradients(fine.points)
    total = plain.shape.volumes.sum()
    basis = plain.basis.with_local(kernels, fine.phi, values, fine.weights / total)
    coarse = plain.strain.rows.reshape(3, -1, plain.basis.size)[:, ~refined]
    rows = np.empty((3, coarse.shape[1] + len(fine.points), basis.size))
    rows[:, : coarse.shape[1], : plain.basis.size] = coarse
    rows[:, coarse.shape[1] :, : plain.basis.size] = fine.slopes
    slopes = np.zeros((3, rows.shape[1], len(kernels.centres)))
    slopes[:, coarse.shape[1] :] = local_slopes
    rows[:, :, plain.basis.size :] = basis.local_values(rows[:, :, : plain.basis.size], slopes)
    strain = StrainEnergy(
        rows.reshape(-1, basis.size),
        np.concatenate([plain.strain.points[~refined], fine.points]),
        np.concatenate([plain.strain.weights[~refined], fine.weights]),
        body.strain.material,
    )
    return replace(body, basis=basis, strain=strain, held=_held(plain, basis, kernels), plain=plain)


def prepare(body: Body, detail: LocalDetail) -> None:
    """Makes once what local functions need wherever they will be."""
    (body.plain or body).refined(_fine(WIDER * detail.spacing))


def _fine(radius: float) -> float:
    return FINER * radius


def _held(plain: Body, basis: SimulationBasis, kernels: LocalFunctions) -> Array:
    """Spring matrix with the local columns; these are known where no kernel reaches, by what they take from others."""
    if kernels.values(plain.held_points).any():
        return spring_matrix(basis, plain.held_points, plain.springs)
    assert basis.local is not None
    spread = np.concatenate([np.eye(plain.basis.size), -basis.local.overlap], axis=1)
    held: Array = spread.T @ plain.held @ spread
    return held
