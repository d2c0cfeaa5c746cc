"""Poses known from earlier searches, scored again when a landmark moves: no new search."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..align.landmark_prior import LandmarkPrior
from ..align.pose_view import pose_view
from ..align.poses import Poses
from ..align.splat_view import SplatView
from ..align.start_search import Starts
from ..ground.checks import Array
from ..points.surface_samples import SurfaceSamples
from .default_stages import DefaultCoarse

SAME = {"angle_deg": 8.0, "log_scale": 0.08}  # as ``Starts.modes`` tells modes apart
TURNED_AWAY = -0.1  # cosine of a landmark's normal to the camera: the search tries no such view


@dataclass(frozen=True)
class StartPool:
    """Poses T_camera_normalised and their scores (B,) without landmarks, in any order."""

    poses: Poses
    scores: Array
    candidates: int

    @classmethod
    def of(cls, starts: Starts, landmarks: LandmarkPrior, view: SplatView) -> StartPool:
        """Of a search that knew ``landmarks``: its best pose of every mode, so that the same one stands for a mode
        wherever the landmarks go."""
        kept = starts.poses.distinct(starts.scores, most=len(starts.scores), **SAME)
        poses = starts.poses[kept]
        return cls(poses, starts.scores[kept] - landmarks.cost(poses, view), starts.candidates)

    def joined(self, other: StartPool) -> StartPool:
        """With the modes of ``other`` that are not known yet."""
        poses, count = Poses.join([self.poses, other.poses]), len(self.scores)
        kept = poses.distinct(np.arange(len(poses), dtype=float), most=len(poses), **SAME)  # the first of each stays
        kept = np.concatenate([np.arange(count), kept[kept >= count]])
        scores = np.concatenate([self.scores, other.scores])[kept]
        return StartPool(poses[kept], scores, self.candidates + other.candidates)

    def starts(self, landmarks: LandmarkPrior, view: SplatView) -> Starts:
        """Best first for other ``landmarks``; poses in which one of them faces away are left out, as in the search."""
        scores, chosen = self.scores + landmarks.cost(self.poses, view), np.arange(len(self.scores))
        if len(landmarks):
            towards = -view.surface.centre / np.linalg.norm(view.surface.centre)
            cosine = np.einsum("bij,lj,i->bl", self.poses.rotation, landmarks.normals, towards).min(1)
            chosen = np.flatnonzero(cosine >= TURNED_AWAY) if (cosine >= TURNED_AWAY).any() else chosen
        order = chosen[np.argsort(scores[chosen], kind="stable")]
        return Starts(self.poses[order], scores[order], self.candidates)


def coarse_of(starts: Starts, before: DefaultCoarse, samples: SurfaceSamples, view: SplatView) -> DefaultCoarse:
    """The coarse stage with other starts; what is told of the pose is kept where the best one is the same."""
    pose = starts.poses.at(0)
    if np.array_equal(pose.matrix, before.starts.poses.at(0).matrix):
        return replace(before, starts=starts)
    T_scene_ct = view.T_camera_scene.inverse() @ pose @ samples.normalisation.T_ct_normalised.inverse()
    return replace(before, starts=starts, T_scene_ct=T_scene_ct, view=pose_view(pose, samples, view))
