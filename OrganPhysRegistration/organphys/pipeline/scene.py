"""The part of the splat that is registered: opaque, finite, in the crop box; and the rest of the scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.notices import Notice
from ..ground.progress import Progress
from ..points.point_sets import Box, GaussianCloud
from ..points.sampling import random_subset
from ..points.target_selection import clean_points, select_target
from .registration import RegisterOptions

TARGET_POINTS = 5000
PICTURE_POINTS = 60_000


@dataclass(frozen=True)
class Scene:
    """centres (N, 3): the organ's opaque Gaussians; others (K, 3): opaque ones outside the crop box; target (M, 3):
    the paper's uniform subsample of the organ's; picture: indices into the splat for pictures."""

    centres: Array
    others: Array
    target: Array
    picture: NDArray[np.int64]
    notices: tuple[Notice, ...]


def select_scene(splat: GaussianCloud, box: Box | None, options: RegisterOptions, progress: Progress) -> Scene:
    """Split the splat; InputError where nothing is left."""
    chosen = select_target(splat, opacity=options.opacity, box=box)
    opaque = splat.valid & (splat.opacities > options.opacity)
    notices = []
    centres = splat.centres[chosen].astype(np.float64)
    if options.clean:
        cleaning = clean_points(centres, progress=progress)
        centres = centres[cleaning.keep]
        notices.append(
            Notice(
                "splat_cleaned",
                f"Cleaning removed {cleaning.outliers} outliers and {cleaning.in_small_clusters} Gaussians in small "
                f"clusters of {len(cleaning.keep)}.",
            )
        )
    others = splat.centres[opaque & ~chosen].astype(np.float64)
    shown = np.flatnonzero(opaque)
    return Scene(
        centres=centres,
        others=others,
        target=centres[random_subset(len(centres), TARGET_POINTS, options.seed)],
        picture=shown[random_subset(len(shown), PICTURE_POINTS, options.seed)],
        notices=tuple(notices),
    )
