"""The simulator against full finite elements: a bending beam and a falling cube, computed elsewhere step by step.

The reference lies beside the repository in shared/fem (see its README); without it these tests are skipped.
"""

import numpy as np
import pytest
from outside_fem import FEM, beam_errors, cube_error, reference

pytestmark = pytest.mark.skipif(not FEM.is_dir(), reason="the finite-element reference (shared/fem) is not here")


def test_a_beam_bends_as_in_finite_elements_step_by_step():
    fem = reference("beam")
    errors = beam_errors(fem, 20, (1, 100))
    largest = np.linalg.norm(fem["v_end"] - fem["v0"], axis=1).max()
    assert errors[1] < 0.0007  # what a public implementation with 32 handles reaches
    assert errors[100] < 0.0272
    assert errors[100] < 0.08 * largest


def test_more_handles_bend_more_exactly():
    fem = reference("beam")
    errors = [beam_errors(fem, handles, (1,))[1] for handles in (6, 12, 40)]
    assert errors[0] > 1.2 * errors[2] and errors[1] <= errors[0]


def test_a_cube_falls_as_in_finite_elements_before_it_lands():
    assert cube_error(reference("cube"), 8) < 1e-5
