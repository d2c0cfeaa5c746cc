"""The data term of landmarks that were clicked in the CT and on the splat: each is held softly near its place.

Clicks err by several millimetres, more than the surface terms do where the organ is seen (pulling all the way made
seven cases with known truth worse even by exact clicks), so a pair within ``FREE_MM`` is left alone.
"""

from __future__ import annotations

import numpy as np

from ..align.landmark_prior import LandmarkPrior
from ..ground.checks import Array
from ..points.surface_samples import SurfaceSamples
from .matches import Deformed, Matches, geman_mcclure

FREE_MM = 10.0  # a pair this near counts as met
WEIGHT = 0.03  # of all pairs together; a data term of thousands of matches weighs 1
WIDTH = 0.25  # normalised length beyond which a pair is taken for a slip and soon counts nothing


def landmark_matches(
    samples: SurfaceSamples, organ: Deformed, landmarks: LandmarkPrior | None, *, weight: float = WEIGHT
) -> Matches:
    """Nearest organ sample of every paired landmark, to within ``FREE_MM`` of the place clicked on the splat."""
    if landmarks is None or landmarks.partners is None:
        return _matches(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros(0))
    paired = np.isfinite(landmarks.partners).all(1)
    rows = landmarks.sample_index[paired]
    beside = landmarks.positions[paired] - samples.points[rows]  # from the sample to the landmark itself
    targets = organ.target_frame(landmarks.partners[paired]) - beside / organ.gamma
    way = targets - organ.points[rows] / organ.gamma
    distance = organ.gamma * np.linalg.norm(way, axis=1)
    excess = np.maximum(distance - FREE_MM / samples.normalisation.length, 0.0)
    targets = targets - (1 - excess / np.maximum(distance, 1e-12))[:, None] * way
    squared = excess**2
    return _matches(rows, targets, weight / len(rows) * geman_mcclure(squared, WIDTH))


def _matches(rows: np.ndarray, targets: Array, weights: Array) -> Matches:
    return Matches(rows, targets, weights, np.tile([0.0, 0.0, 1.0], (len(rows), 1)), np.zeros(len(rows)))
