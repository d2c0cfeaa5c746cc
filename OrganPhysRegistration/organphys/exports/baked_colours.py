"""The splat's colours on the vertices of the organ's surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import expit

from ..asset.registered_organ import RegisteredOrgan
from ..asset.surface_distance import vertex_normals
from ..ground.checks import Array, InputError, as_positive, as_vector
from ..points.gaussians import Gaussians, colour_from_sh

HIDDEN = np.array([0.72, 0.66, 0.62])  # what no Gaussian shows: a neutral grey-beige, sRGB (184, 168, 158)
VISIBLE = 0.1  # opacity
NEIGHBOURS, ENOUGH = 12, 3  # most and fewest Gaussians that colour a vertex: fewer are stray ones
SIDEWAYS = -0.2  # cosine between normal and direction to the camera from which a vertex counts as facing it


def baked_colours(
    organ: RegisteredOrgan, gaussians: Gaussians, *, reach_mm: float = 4.0, camera: Array | None = None
) -> tuple[Array, float]:
    """Colours (Nv, 3) in 0..1 of the registered surface, and the part (0..1) of its vertices that the splat shows.

    A vertex takes the mean head-on colour of the up to 12 nearest Gaussians of opacity above 0.1 within ``reach_mm``,
    weighted by opacity times exp(-(d/d0)^2), d0 the distance of the nearest few. Vertices turned away from the camera
    (at (3,) scene units, the origin if not given) or with no Gaussian near are HIDDEN. InputError where none is near.
    """
    reach = as_positive(reach_mm, "reach") * organ.T_scene_ct.scale
    eye = np.zeros(3) if camera is None else as_vector(camera, "camera")
    vertices = organ.scene_vertices
    opacity = expit(gaussians.opacity_logits.astype(np.float64))
    shown = np.flatnonzero(gaussians.valid & (opacity > VISIBLE))
    if not len(shown):
        raise InputError("splat: no Gaussian of opacity above 0.1, so there are no colours to bake")
    towards = eye - vertices
    facing = (vertex_normals(vertices, organ.faces) * towards).sum(1) > SIDEWAYS * np.linalg.norm(towards, axis=1)
    count = min(NEIGHBOURS, len(shown))
    away, nearest = cKDTree(gaussians.means[shown]).query(vertices, k=count, distance_upper_bound=reach)
    away, nearest = away.reshape(len(vertices), count), nearest.reshape(len(vertices), count)
    seen = facing & np.isfinite(away[:, min(ENOUGH, count) - 1])
    if not seen.any():
        raise InputError(f"splat: no Gaussian within {reach_mm:g} mm of the organ's seen side; is it the right splat?")
    away, nearest = away[seen], np.minimum(nearest[seen], len(shown) - 1)
    near = np.isfinite(away)
    wide = np.maximum(away[:, : min(4, count)].max(1, where=near[:, : min(4, count)], initial=0.0), 1e-12)
    weights = np.where(near, opacity[shown][nearest] * np.exp(-((np.where(near, away, 0) / wide[:, None]) ** 2)), 0.0)
    own = colour_from_sh(gaussians.sh_dc[shown].astype(np.float64))[nearest]
    colours = np.tile(HIDDEN, (len(vertices), 1))
    colours[seen] = (weights[:, :, None] * own).sum(1) / weights.sum(1)[:, None]
    return colours, float(seen.mean())
