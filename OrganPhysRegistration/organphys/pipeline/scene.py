"""The part of the splat that is registered: opaque, finite, in the crop box; and the rest of the scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, InputError
from ..ground.notices import Notice
from ..ground.progress import Progress
from ..points.point_sets import Box, GaussianCloud
from ..points.sampling import random_subset
from ..points.target_selection import select_clean_target, select_target
from .registration import RegisterOptions

TARGET_POINTS = 5000
PICTURE_POINTS = 60_000
ON_A_LINE = 1e-4  # ratio of the second largest extent to the largest


@dataclass(frozen=True)
class Scene:
    """centres (N, 3): the organ's opaque Gaussians; others (K, 3): opaque ones outside the crop box; target (M, 3):
    the paper's uniform subsample of the organ's; picture: indices into the splat for pictures; rows (N,): those of the
    centres."""

    centres: Array
    others: Array
    target: Array
    picture: NDArray[np.int64]
    notices: tuple[Notice, ...]
    rows: NDArray[np.int64]

    def cropped(self, members: NDArray[np.bool_], seed: int) -> Scene:
        """The scene with only the centres of ``members`` (N,) bool as the organ's; the others join the rest."""
        centres = self.centres[members]
        _check_spread(centres)
        return replace(
            self,
            centres=centres,
            others=np.concatenate([self.others, self.centres[~members]]),
            target=centres[random_subset(len(centres), TARGET_POINTS, seed)],
            rows=self.rows[members],
        )


def select_scene(splat: GaussianCloud, box: Box | None, options: RegisterOptions, progress: Progress) -> Scene:
    """Split the splat; InputError where nothing is left."""
    inside = select_target(splat, opacity=options.opacity, box=box)
    opaque = select_target(splat, opacity=options.opacity)
    chosen, notices = inside, list[Notice]()
    if options.clean:
        chosen, cleaning = select_clean_target(splat, opacity=options.opacity, box=box, progress=progress)
        notices.append(cleaning.notice)
    centres = splat.centres[chosen].astype(np.float64)
    _check_spread(centres)
    others = splat.centres[opaque & ~inside].astype(np.float64)
    shown = np.flatnonzero(opaque)
    return Scene(
        centres=centres,
        others=others,
        target=centres[random_subset(len(centres), TARGET_POINTS, options.seed)],
        picture=shown[random_subset(len(shown), PICTURE_POINTS, options.seed)],
        notices=tuple(notices),
        rows=np.flatnonzero(chosen),
    )


def _check_spread(centres: Array) -> None:
    """InputError where the points (N, 3) are one point or a line, so that no surface can be seen in them."""
    offsets = centres - centres.mean(0)
    variances = np.linalg.eigvalsh(offsets.T @ offsets)
    if variances[1] <= ON_A_LINE**2 * variances[2]:
        raise InputError(
            f"splat: its {len(centres)} opaque Gaussians lie on one line or point; "
            "check the file, the ROI and --opacity"
        )
