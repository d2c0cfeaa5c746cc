"""The splat of one time step made into a target quickly: fewer Gaussians than for a registration from nothing."""

from __future__ import annotations

from ..align.splat_surface import SplatSurfaceOptions
from ..align.splat_view import SplatView, splat_view
from ..ground.progress import no_progress
from ..points.point_sets import Box, Camera, GaussianCloud
from .registration import RegisterOptions
from .scene import select_scene

QUICK = SplatSurfaceOptions(centres=12_000, dense=40_000, samples=2000)
"""A third of the time of the full view; the liver of the dev cases, followed on, is as exact within what another
random subset of the same splat changes."""


def frame_view(splat: GaussianCloud, camera: Camera, box: Box | None, options: RegisterOptions) -> SplatView:
    """View of one frame's splat; InputError where nothing can be seen in it."""
    scene = select_scene(splat, box, options, no_progress)
    return splat_view(scene.centres, scene.others, camera, surface_options=QUICK, seed=options.seed)
