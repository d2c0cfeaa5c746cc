"""Displacement grids of a registered organ, for programs that know transforms and no skinning: CT to scene and back.

The field beside the organ is a spline and is put on the grid axis by axis; the organ's own displacement, which costs
most, is taken on every second node and filled in by cubic interpolation. What interpolation of the result misses, cubic
as in Slicer and linear as elsewhere, is measured against the organ's own map, at points that are no nodes.
"""

from __future__ import annotations

import numpy as np

from ..asset.deformation import Deformation
from ..asset.registered_organ import RegisteredOrgan
from ..ground.checks import Array, as_positive
from ..ground.progress import Progress, no_progress
from ..points.sampling import random_subset
from .grid_axes import CATMULL_ROM, GridAxes, cubic, doubled, trilinear
from .grid_records import DisplacementGrid, DisplacementGrids
from .inverse_grid import inverse_displacement

__all__ = ["DisplacementGrid", "DisplacementGrids", "sample_displacement"]

LEAST_MARGIN_MM = 35.0
BESIDE_MM = 30.0  # how far round the organ the outside error is measured
TRIAL_MM = 3.0
ORDER = 2.5  # the cubic's error grows with this power of the spacing: the field is not smooth at the organ's surface
FINEST_MM, COARSEST_MM = 0.8, 6.0
MOST_NODES = 6_000_000  # 72 MB a grid; the error told is then what it is
ROUNDS = 3
PROBES = 1500  # each of volume points and of vertices


def sample_displacement(
    organ: RegisteredOrgan, *, tolerance_mm: float = 0.05, progress: Progress = no_progress
) -> DisplacementGrids:
    """Forward and inverse grids, so fine that the forward one, interpolated cubically as Slicer does, misses at most
    ``tolerance_mm`` inside the organ.

    Both reach at least 35 mm beyond it, to where the deformation has faded to nothing. A grid is never finer than
    0.8 mm or larger than six million nodes: the measured errors tell whether the tolerance was met.
    """
    as_positive(tolerance_mm, "tolerance in mm")
    progress("grids", 0.0)
    deformation = organ.deformation
    field = deformation.outside
    progress("grids", 0.5)
    inside, beside = _probes(organ)
    moved = deformation.displacement(inside), deformation.displacement(beside)
    spacing = _first_spacing(deformation, inside, moved[0], tolerance_mm)
    margin = max(LEAST_MARGIN_MM, field.reach + 2 * field.spline.spacing)
    for attempt in range(ROUNDS):
        axes = GridAxes.round(organ.vertices, margin + 2 * spacing, spacing, most=MOST_NODES)
        d = forward_displacement(deformation, axes)
        forward = _grid(axes, d, inside, beside, *moved)
        progress("grids", 0.7 + 0.05 * attempt)
        worst = forward.error_mm["max"]
        if worst <= tolerance_mm or axes.spacing <= FINEST_MM or axes.is_full(MOST_NODES):
            break
        spacing = max(FINEST_MM, 0.95 * axes.spacing * (tolerance_mm / worst) ** (1 / ORDER))
    e = inverse_displacement(deformation, axes, d, progress=lambda part: progress("grids", 0.85 + 0.15 * part))
    inverse = _grid(axes, e, inside + moved[0], beside + moved[1], -moved[0], -moved[1])
    progress("grids", 1.0)
    return DisplacementGrids(forward, inverse)


def forward_displacement(deformation: Deformation, axes: GridAxes) -> Array:
    """Displacement (nx, ny, nz, 3) in mm at the nodes."""
    field = deformation.outside
    values = field.spline.on_axes(*axes.all)
    distance, u = values[..., 0], values[..., 1:]
    b, f = field.inner(distance)[0], field.fade(distance)[0]
    needed = b > 0
    own = _own_displacement(deformation, axes, distance, field.margin + field.collar)
    u[needed] += b[needed, None] * (own[needed] - u[needed])
    u *= f[..., None]
    return u


def _own_displacement(deformation: Deformation, axes: GridAxes, distance: Array, reach: float) -> Array:
    """The reduced basis' own displacement (nx, ny, nz, 3), right wherever ``distance`` (nx, ny, nz) is below
    ``reach``; taken at every second node."""
    coarse = distance[::2, ::2, ::2] < reach + 3.5 * 2 * axes.spacing  # as far as the cubic's nodes reach
    own = np.zeros((*coarse.shape, 3))
    own[coarse] = deformation.inside_displacement(axes.every_second.nodes(coarse))
    return doubled(own)


def _probes(organ: RegisteredOrgan) -> tuple[Array, Array]:
    """Points (N, 3) inside the organ and on its surface, and (M, 3) up to 30 mm beside it."""
    rng = np.random.default_rng(0)
    volume = organ.volume_points[random_subset(len(organ.volume_points), PROBES, rng)]
    chosen = random_subset(len(organ.vertices), 2 * PROBES, rng)
    vertices, normals = organ.vertices[chosen], organ.surface_distance.normals[chosen]
    beside = vertices + normals * rng.uniform(0, BESIDE_MM, (len(vertices), 1))
    return np.concatenate([volume, vertices[::2]]), beside


def _first_spacing(deformation: Deformation, points: Array, moved: Array, tolerance_mm: float) -> float:
    """Spacing (mm) at which the middle of a cell is missed by about 0.9 of the tolerance."""
    few = slice(None, None, 9)
    steps = TRIAL_MM * np.array([-1.5, -0.5, 0.5, 1.5])
    nodes = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    middle = CATMULL_ROM @ (0.5 ** np.arange(4))
    weights = np.einsum("i,j,k->ijk", middle, middle, middle).ravel()
    at_nodes = deformation.displacement((points[few, None] + nodes).reshape(-1, 3)).reshape(-1, len(nodes), 3)
    missed = np.einsum("n,pnk->pk", weights, at_nodes) - moved[few]
    error = float(np.linalg.norm(missed, axis=1).max())
    return float(np.clip(TRIAL_MM * (0.9 * tolerance_mm / max(error, 1e-9)) ** (1 / ORDER), FINEST_MM, COARSEST_MM))


def _grid(
    axes: GridAxes, u: Array, inside: Array, beside: Array, expected_inside: Array, expected_beside: Array
) -> DisplacementGrid:
    vectors = np.ascontiguousarray(u.transpose(2, 1, 0, 3), dtype=np.float32)
    wanted = ((cubic, inside, expected_inside), (cubic, beside, expected_beside), (trilinear, inside, expected_inside))
    errors = [np.linalg.norm(at(vectors, axes, points) - expected, axis=1) for at, points, expected in wanted]
    told = [{"max": float(error.max()), "p95": float(np.percentile(error, 95))} for error in errors]
    return DisplacementGrid(axes.origin, np.full(3, axes.spacing), vectors, *told)
