"""A bending beam and a falling cube as finite elements computed elsewhere, and the simulator on the same bodies.

The reference lies beside the repository in shared/fem (see its README).
"""

from pathlib import Path

import numpy as np
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


def beam_errors(fem, handles, steps, quadrature=1000, nodes=300):
    """Vertex rms error, m, after the given steps (1, 100); the vertices at x >= 0.98 are held by stiff springs."""
    held = fem["v0"][fem["v0"][:, 0] >= 0.98]
    return errors(fem, body_of(fem, 1e5, held, handles=handles, quadrature=quadrature, nodes=nodes), steps)


def cube_error(fem, handles):
    """The same of the cube after step 1, before it lands."""
    return errors(fem, body_of(fem, 1e4, np.zeros((0, 3)), handles=handles, quadrature=300, nodes=100), (1,))[1]


def errors(fem, body, steps):
    """Vertex rms error, m, after step 1 and the last one of the reference, 100."""
    phi, scene, cache = body.basis.phi(fem["v0"]), Scene((body,), options=OPTIONS), FactorCache()
    state, out = scene.initial_state(), {}
    for k in range(1, max(steps) + 1):
        state, _ = step(scene, state, (), DT, cache=cache)
        if k in steps:
            out[k] = rms(fem["v0"] + phi @ state.bodies[0].z, fem["v1"] if k == 1 else fem["v_end"])
    return out
