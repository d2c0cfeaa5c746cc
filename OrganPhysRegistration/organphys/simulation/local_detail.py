"""Local detail: extra functions and quadrature points where a tool touches, so that a poke makes a dimple."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError, as_positive
from ..points.sampling import farthest_points
from .body import Body
from .local_cells import inside_grid, refined_cells, within
from .local_functions import LocalFunctions
from .pins import spring_matrix
from .simulation_basis import SimulationBasis
from .state import BodyState
from .state_transfer import untangled
from .strain_energy import StrainEnergy

FINER = 0.35  # spacing of the fine quadrature points in kernel radii
AT_REST = 5e-5  # m: local displacements below this are dropped with their functions
WIDER = 1.8  # kernel radius in spacings of the kernels


@dataclass(frozen=True)
class LocalDetail:
    """``count`` kernels (each three degrees of freedom) within ``radius`` m of the contact at rest.

    They follow the contact when it has moved by more than ``follow`` of the radius.
    """

    radius: float = 0.010
    count: int = 16
    follow: float = 0.4

    def __post_init__(self) -> None:
        as_positive(self.radius, "radius of the local detail")
        as_positive(self.follow, "follow")
        if self.count < 1:
            raise InputError(f"count: expected at least 1 kernel, got {self.count}")


def with_detail(body: Body, centre: Array, detail: LocalDetail) -> Body:
    """The body with local functions round ``centre`` (3,), m at rest, in place of any it had.

    InputError if no tissue is there.
    """
    plain = body.plain or body
    kernels = _kernels(plain, centre, detail)
    cells = refined_cells(plain.shape, centre, kernels.reach, FINER * kernels.radius)
    phi, slopes = plain.basis.phi_and_gradient(cells.new.points)
    values, local_slopes = kernels.values_and_gradients(cells.new.points)
    share = cells.new.weights / plain.shape.volumes.sum()
    basis = plain.basis.with_local(kernels, phi, values, share)
    coarse = plain.strain.rows.reshape(3, -1, plain.basis.size)[:, cells.kept]
    rows = np.concatenate([coarse, slopes], axis=1)
    away = np.zeros((*coarse.shape[:2], len(kernels.centres)))
    local_rows = basis.local_values(rows, np.concatenate([away, local_slopes], axis=1))
    strain = StrainEnergy(
        np.concatenate([rows, local_rows], axis=2).reshape(-1, basis.size),
        np.concatenate([plain.strain.points[cells.kept], cells.new.points]),
        np.concatenate([plain.strain.weights[cells.kept], cells.new.weights]),
        body.tissue.material,
    )
    return replace(body, basis=basis, strain=strain, held=_held(plain, basis, kernels), plain=plain)


def _held(plain: Body, basis: SimulationBasis, kernels: LocalFunctions) -> Array:
    """Spring matrix with the local columns; these are known where no kernel reaches, by what they take from others."""
    if kernels.values(plain.held_points).any():
        return spring_matrix(basis, plain.held_points, plain.springs)
    assert basis.local is not None
    spread = np.concatenate([np.eye(plain.basis.size), -basis.local.overlap], axis=1)
    held: Array = spread.T @ plain.held @ spread
    return held


def detail_state(state: BodyState, old: Body, new: Body) -> BodyState:
    """The state of ``old`` for ``new``, which differs in its local functions: what these can tell is kept."""
    n, size = old.basis.mixing.shape[1], new.basis.size
    project = np.zeros((size, old.basis.size))
    project[:n, :n] = np.eye(n)
    if old.basis.local is not None and new.basis.local is not None:
        project[n:, n:] = _local_products(new, old)
    return state.projected(project)


def _local_products(new: Body, old: Body) -> Array:
    """Mass products (k', k) of the local columns of two bodies, the other columns being orthonormal."""
    ours, theirs = new.basis.local, old.basis.local
    assert ours is not None and theirs is not None
    share = (new.strain.weights / new.strain.weights.sum())[:, None]
    points = new.strain.points
    products = ours.functions.values(points).T @ (share * theirs.functions.values(points))
    return ours.mixing.T @ products @ theirs.mixing - ours.overlap.T @ theirs.overlap


def contact_centre(body: Body, state: BodyState) -> Array | None:
    """Rest position (3,) m of the middle of all contacts and grips, weighted by force and area; None: no contact."""
    samples, weights = state.touch.sample, state.touch.force
    held = [grip.sample for grip in state.grips if len(grip.sample)]
    if held:
        samples = np.concatenate(held)
        weights = body.samples.areas[samples]
    if not len(samples) or not weights.sum() > 0:
        return None
    middle: Array = weights @ body.samples.points[samples] / weights.sum()
    return middle


def followed(body: Body, state: BodyState, detail: LocalDetail) -> tuple[Body, BodyState]:
    """Body and state with local functions made or moved where the contact asks for it, and dropped once at rest.

    They stay where they are while moving them would turn tissue inside out.
    """
    centre, local, new = contact_centre(body, state), body.basis.local, body
    if centre is None:
        if local is not None and _dimple(body, state) < AT_REST:
            new = body.plain or body
    elif local is None or np.linalg.norm(local.functions.middle - centre) > detail.follow * detail.radius:
        new = with_detail(body, centre, detail)
    moved = None if new is body else untangled(new, detail_state(state, body, new), first=new.basis.mixing.shape[1])
    return (body, state) if moved is None else (new, moved)


def _dimple(body: Body, state: BodyState) -> float:
    """Largest displacement of a contact sample by the local functions, m."""
    n = body.basis.mixing.shape[1]
    assert body.basis.local is not None
    samples = np.flatnonzero(
        within(body.samples.points, body.basis.local.functions.middle, body.basis.local.functions.reach)
    )
    return float(np.sqrt(((body.sample_phi(samples)[:, n:] @ state.z[n:]) ** 2).sum(1).max(initial=0.0)))


def _kernels(body: Body, centre: Array, detail: LocalDetail) -> LocalFunctions:
    """Kernels spread evenly over the tissue near ``centre``, half of it the surface."""
    grid = inside_grid(body.shape, centre, detail.radius, detail.radius / 5)
    points = np.concatenate([grid, body.samples.points[within(body.samples.points, centre, detail.radius)]])
    if not len(points):
        raise InputError(f"local detail: no tissue within {1000 * detail.radius:g} mm of the given point")
    centres = points[farthest_points(points, detail.count)]
    spacing = detail.radius if len(centres) < 2 else float(np.median(cKDTree(centres).query(centres, k=2)[0][:, 1]))
    return LocalFunctions(centres, WIDER * spacing, np.array(centre))
