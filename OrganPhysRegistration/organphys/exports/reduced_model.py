"""The reduced model of a body as one documented .npz, for simulators that bring their own time stepping.

Displacement u(X) = Phi(X) Z in metres, Z (n, 3). All arrays are float64 in SI units, positions along the scene's axes
in metres (scene coordinates times metres_per_unit).
"""

from __future__ import annotations

import os

import numpy as np

from ..asset.registered_organ import RegisteredOrgan
from ..ground.atomic_file import atomic_path
from ..simulation.body import Body
from ..simulation.organ_body import metres_per_unit

VERSION = 1
ARRAYS = {
    "version": "() int, of this table",
    "metres_per_unit": "() m, of one scene unit of the splat",
    "quadrature_points": "(Q, 3) m, at rest",
    "quadrature_weights": "(Q,) m^3, volume each point stands for",
    "quadrature_phi": "(Q, n) 1, basis Phi at the quadrature points",
    "quadrature_gradient": "(3, Q, n) 1/m, dPhi/dx, dPhi/dy, dPhi/dz; F = I + sum_i Z_i (grad Phi_i)^T",
    "vertices": "(Nv, 3) m, surface at rest",
    "faces": "(Nf, 3) int, corners, counter-clockwise from outside",
    "vertex_phi": "(Nv, n) 1, basis at the vertices",
    "mass": "(n, n) kg, mass matrix of each axis: density times the integral of Phi^T Phi",
    "mean_phi": "(n,) 1, volume mean of Phi: gravity loads Z with mass_total mean_phi g^T",
    "mass_total": "() kg",
    "stiffness": "(3n, 3n) N/m, elastic Hessian at rest, in the order column of Phi, axis; without pins",
    "pin_stiffness": "(n, n) N/m of each axis, springs of the pins; 0 without pins",
    "held_points": "(k, 3) m, where the pins hold the tissue",
    "held_springs": "(k,) N/m",
    "youngs_pa": "() Pa",
    "nu": "() 1, Poisson's ratio",
    "mu": "() Pa, shear modulus",
    "lam": "() Pa, first Lame constant; Psi = mu/2 (tr F^T F - 3 - 2 ln J) + lam/2 (J - 1)^2",
    "density": "() kg/m^3",
    "tissue": "() text, preset and source of its numbers",
    "node_points": "(k, 3) 1, kernel nodes of the basis in X = (x - centre) / length",
    "node_radii": "(k,) 1, their kernel radii: f_I = exp(-|X - X_I|^2 / r_I^2), first-order RKPM shape functions",
    "node_weights": "(k, w) 1, node coefficients of the weight functions w_h = sum_I phi_I c_Ih",
    "handles": "() int, the first so many weight functions come with [1, X], the others alone",
    "mixing": "(r, n) 1, Phi = [1, X, w_1 [1, X], ..., other w] @ mixing, columns orthonormal in the mass",
    "centre": "(3,) m",
    "length": "() m",
    "about": "() text, this table",
}


def reduced_arrays(organ: RegisteredOrgan, body: Body) -> dict[str, np.ndarray]:
    """The arrays of the file, by the names of ARRAYS; local functions of the body are left out."""
    body = body.plain or body
    basis, tissue, shape = body.basis, body.tissue, body.shape
    phi, slopes = basis.phi_and_gradient(body.strain.points)
    volumes = shape.volumes
    everywhere = basis.phi(shape.points)
    values = {
        "version": VERSION,
        "metres_per_unit": metres_per_unit(organ),
        "quadrature_points": body.strain.points,
        "quadrature_weights": body.strain.weights,
        "quadrature_phi": phi,
        "quadrature_gradient": slopes,
        "vertices": body.samples.vertices,
        "faces": body.samples.faces,
        "vertex_phi": body.vertex_phi,
        "mass": tissue.density * everywhere.T @ (volumes[:, None] * everywhere),
        "mean_phi": body.mean_phi,
        "mass_total": body.mass,
        "stiffness": body.elasticity.rest_hessian(),
        "pin_stiffness": body.held,
        "held_points": body.held_points,
        "held_springs": body.springs,
        "youngs_pa": tissue.youngs_pa,
        "nu": tissue.nu,
        "mu": tissue.material.mu,
        "lam": tissue.material.lam,
        "density": tissue.density,
        "tissue": f"{tissue.name}: {tissue.source}",
        "node_points": basis.kernel.nodes,
        "node_radii": basis.kernel.radii,
        "node_weights": basis.coefficients,
        "handles": basis.handles,
        "mixing": basis.mixing,
        "centre": basis.normalisation.centre,
        "length": basis.normalisation.length,
        "about": "\n".join(f"{name}: {text}" for name, text in ARRAYS.items()),
    }
    return {name: np.asarray(value) for name, value in values.items()}


def write_reduced_model(path: str | os.PathLike[str], organ: RegisteredOrgan, body: Body) -> None:
    """Write the model to ``path``, atomically; ``numpy.load`` reads it without pickle."""
    arrays = reduced_arrays(organ, body)
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]
