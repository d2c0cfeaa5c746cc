"""An organ that bends and drifts from frame to frame before a camera, with its true places."""

from __future__ import annotations

from functools import partial

import numpy as np
from scene_examples import POSE, Seen, bend, seen_from_camera

from organphys.ground.checks import Array
from organphys.ground.frames import Similarity, rotation_about
from organphys.points.point_sets import Organ


def bent_by(share: float, points: Array) -> Array:
    return points + share * (bend(points) - points)


def pose_at(share: float) -> Similarity:
    """The organ turns by up to 4 degrees and drifts by up to 6 mm."""
    turn = rotation_about(np.array([0.2, 1.0, 0.3]), 0.07 * share)
    centre = POSE.apply(np.array([[30.0, -55.0, 120.0]]))[0]
    moved = Similarity(1.0, turn, centre - turn @ centre + share * np.array([0.2, 0.0, 0.05]))
    return moved @ POSE


def seen_at(organ: Organ, share: float, *, seed: int, noise_mm: float = 0.6) -> Seen:
    """What the camera sees of the organ bent by ``share``, with noise of its own."""
    deformation = partial(bent_by, share)
    return seen_from_camera(organ, deformation=deformation, pose=pose_at(share), noise_mm=noise_mm, seed=seed)


def true_places(points_ct: Array, share: float) -> Array:
    """Scene positions (N, 3) of CT points (N, 3)."""
    return pose_at(share).apply(bent_by(share, points_ct))
