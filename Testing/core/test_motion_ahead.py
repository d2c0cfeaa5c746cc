"""Where an organ is expected next: steady motion is met exactly."""

import numpy as np
import pytest

from organphys.elastic.elastic_registration import ElasticState
from organphys.ground.frames import Similarity, rotation_about
from organphys.pipeline.motion_ahead import moved_on

AXIS, SPEED, STEP = np.array([0.2, 1.0, -0.4]), np.array([0.3, -0.1, 0.2]), 0.15
Z = np.random.default_rng(0).normal(size=(2, 8, 3))


def state_at(time):
    """Coordinates and translation rise with time, the organ turns at a steady rate."""
    rotation = rotation_about(AXIS, STEP * time) @ rotation_about(np.array([1.0, 0.0, 0.0]), 0.7)
    return ElasticState(Z[0] + time * Z[1], 1.0, Similarity(0.02, rotation, [0, 0, 5] + time * SPEED))


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0, 2.0])
def test_steady_motion_goes_on(share):
    found, expected = moved_on(state_at(1.0), state_at(2.0), share), state_at(2.0 + share)
    np.testing.assert_allclose(found.z, expected.z)
    np.testing.assert_allclose(found.pose.matrix, expected.pose.matrix, atol=1e-12)
    assert found.gamma == 1.0
