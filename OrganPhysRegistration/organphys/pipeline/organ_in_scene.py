"""Where the splat holds more than the organ and nobody drew a crop box: which piece of the scene is the organ.

Every piece is tried as if it had been cropped, and the one to which the organ bends most readily is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError
from ..ground.notices import Notice
from ..ground.progress import Progress, no_progress
from ..points.scene_segments import scene_segments
from .case import Case
from .default_method import DefaultMethod
from .processor import one_blas_thread

ONE_PIECE = 0.85  # share of the opaque Gaussians; where one piece of one colour holds more, nothing is divided
FITS = 0.55  # elastic score: right poses reach 0.28 to 0.52, wrong ones 0.6 and more (seven cases with known truth)
CLOSE = 0.15  # a second piece within this of the best score is told
MOST = 6  # pieces tried


@dataclass(frozen=True)
class Piece:
    """Part of the scene, ``members`` (N,) bool of its centres, with the elastic score of the organ in it."""

    members: NDArray[np.bool_]
    score: float

    @property
    def percent(self) -> float:
        return 100 * float(self.members.mean())


@one_blas_thread
def organ_in_scene(case: Case, progress: Progress = no_progress) -> Case:
    """The case with its scene cut down to the organ's piece, or as it is where the splat is of one piece.

    The whole splat is kept if the organ fits it; a notice tells what was taken, another if that is not sure.
    """
    scene = case.scene
    segments = scene_segments(scene.centres, case.splat.colours[scene.rows], case.camera.position)
    if len(segments) < 2 or max(s.mean() for s in segments) > ONE_PIECE:
        return case
    method = DefaultMethod(case)
    whole = Piece(np.ones(len(scene.centres), dtype=bool), _score(method))
    if whole.score < FITS:
        return case
    pieces = [whole]
    for k, members in enumerate(segments[:MOST]):
        progress("clean splat", k / min(len(segments), MOST))
        try:
            pieces.append(Piece(members, _score(_same_organ(method, _cropped(case, members)))))
        except InputError:  # too small or too thin to be anything's surface
            continue
    pieces.sort(key=lambda piece: piece.score)
    return replace(_cropped(case, pieces[0].members), notices=(*case.notices, *_notices(pieces)))


def _score(method: DefaultMethod) -> float:
    """Elastic score of the best pose: two-way misfit plus bending, 0 to about 2."""
    score = method.rigid(method.coarse(no_progress), None, no_progress).score
    return np.inf if score is None else score


def _same_organ(method: DefaultMethod, case: Case) -> DefaultMethod:
    """The method for another scene with the same surface samples and basis."""
    other = DefaultMethod(case)
    vars(other).update(samples=method.samples, rough_organ=method.rough_organ)
    return other


def _cropped(case: Case, members: NDArray[np.bool_]) -> Case:
    return replace(case, scene=case.scene.cropped(members, case.options.seed))


def _notices(pieces: list[Piece]) -> list[Notice]:
    best = pieces[0]
    notices = [
        Notice(
            "organ_found_in_scene",
            f"The splat shows more than the organ and no crop box was given: the piece that fits, {best.percent:.0f} % "
            "of the opaque Gaussians, was taken. Give a crop box (ROI) if the overlay lies on other tissue.",
        )
    ]
    others = [p for p in pieces[1:] if (p.members & best.members).sum() < 0.5 * p.members.sum()]
    rival = others[0].score if others else np.inf
    if best.score > FITS or rival < best.score + CLOSE:
        against = f", the best of the other pieces {rival:.2f}" if np.isfinite(rival) else ""
        notices.append(
            Notice(
                "organ_in_scene_unsure",
                f"Which piece of the scene is the organ is not sure (cost {best.score:.2f}{against}; below {FITS:.2f} "
                "is good, no unit): give a crop box (ROI), or a landmark on the organ in CT and splat.",
            )
        )
    return notices
