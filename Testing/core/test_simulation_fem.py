"""The simulator against full finite elements: a bending beam and a falling cube, computed elsewhere step by step.

The reference lies beside the repository in shared/fem (see its README); without it these tests are skipped.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulation_examples import box_grid

from organphys.mechanics.tissue import Tissue
from organphys.simulation.body import held_body
from organphys.simulation.factor import FactorCache
from organphys.simulation.options import SimulationOptions
from organphys.simulation.rest_shape import rest_shape
from organphys.simulation.scene import Scene
from organphys.simulation.step import step

FEM = Path(__file__).resolve().parents[3] / "shared" / "fem"
GRAVITY = np.array([0.0, -10.0, 0.0])
DT = 0.05
OPTIONS = SimulationOptions(gravity=GRAVITY, mass_damping=0, stiffness_damping=0, tolerance=1e-4)

pytestmark = pytest.mark.skipif(not FEM.is_dir(), reason="the finite-element reference (shared/fem) is not here")


def reference(name):
    with np.load(FEM / f"{name}.npz") as file:
        return {key: file[key].astype(np.float64 if key != "mesh_faces" else np.int64) for key in file}


def body_of(fem, youngs, held, **options):
    low, high = fem["v0"].min(0), fem["v0"].max(0)
    points = low + box_grid(high - low, (high - low).min() / 10)
    volumes = np.full(len(points), (high - low).prod() / len(points))
    tissue = Tissue("reference", youngs, 0.45, 500.0, "shared/fem")
    shape = rest_shape(points, volumes, fem["v0"], fem["mesh_faces"], tissue=tissue, sample_spacing=0.1, **options)
    return held_body(shape, held, np.full(len(held), 1e6), tissue=tissue)


def rms(a, b):
    return float(np.sqrt(((a - b) ** 2).sum(1).mean()))


def beam_error(fem, handles, steps):
    """Vertex rms error, m, after the given steps; the vertices at x >= 0.98 are held by stiff springs."""
    held = fem["v0"][fem["v0"][:, 0] >= 0.98]
    body = body_of(fem, 1e5, held, handles=handles, quadrature=1000, nodes=300)
    phi, scene, cache = body.basis.phi(fem["v0"]), Scene((body,), options=OPTIONS), FactorCache()
    state, errors = scene.initial_state(), {}
    for k in range(max(steps)):
        state, _ = step(scene, state, (), DT, cache=cache)
        if k + 1 in steps:
            target = fem["v1"] if k == 0 else fem["v_end"]
            errors[k + 1] = rms(fem["v0"] + phi @ state.bodies[0].z, target)
    return errors


def test_a_beam_bends_as_in_finite_elements_step_by_step():
    fem = reference("beam")
    errors = beam_error(fem, 20, (1, 100))
    largest = np.linalg.norm(fem["v_end"] - fem["v0"], axis=1).max()
    assert errors[1] < 0.0007  # what a public implementation with 32 handles reaches
    assert errors[100] < 0.0272
    assert errors[100] < 0.08 * largest


def test_more_handles_bend_more_exactly():
    fem = reference("beam")
    errors = [beam_error(fem, handles, (1,))[1] for handles in (6, 12, 40)]
    assert errors[0] > 1.2 * errors[2] and errors[1] <= errors[0]


def test_a_cube_falls_as_in_finite_elements_before_it_lands():
    fem = reference("cube")
    body = body_of(fem, 1e4, np.zeros((0, 3)), handles=8, quadrature=300, nodes=100)
    scene = Scene((replace(body, name="cube"),), options=OPTIONS)
    state, _ = step(scene, scene.initial_state(), (), DT)
    assert rms(fem["v0"] + body.basis.phi(fem["v0"]) @ state.bodies[0].z, fem["v1"]) < 1e-5
