"""Where an organ will be in the next frame if it goes on as it moved: a guess to begin with and to damp towards."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..elastic.elastic_registration import ElasticState
from ..ground.frames import Similarity


def moved_on(before: ElasticState, now: ElasticState, share: float) -> ElasticState:
    """``now`` and ``share`` of the motion since ``before`` on top: coordinates and translation go on along a line, the
    rotation about its axis. Both with gamma = 1 and poses into the same frame; the scale stays."""
    turn = share * Rotation.from_matrix(now.pose.rotation @ before.pose.rotation.T).as_rotvec()
    shift = share * (now.pose.translation - before.pose.translation)
    rotation = Rotation.from_rotvec(turn).as_matrix() @ now.pose.rotation
    pose = Similarity(now.pose.scale, rotation, now.pose.translation + shift)
    return ElasticState(np.asarray(now.z + share * (now.z - before.z)), 1.0, pose)
