"""The function whose minimum is the next state: inertia, damping, gravity, pins, elasticity and contact, in joules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..ground.checks import Array
from .body import Body
from .contact_terms import ContactTerms, ContactValue
from .options import SimulationOptions
from .strain_energy import Tangent, Viscosity
from .time_scheme import SchemeStep


class Evaluation(NamedTuple):
    """Energy in J (infinite: inside out or through a tool), gradient (n, 3) in N, and parts of it for later use.

    ``largest`` N: norm of the largest of the forces that the gradient balances.
    """

    z: Array
    energy: float
    gradient: Array
    deformation: Array
    contact: ContactValue | None
    largest: float


@dataclass(frozen=True)
class IncrementalPotential:
    """One step of one body; ``contact`` None: no tool is near."""

    body: Body
    options: SimulationOptions
    scheme: SchemeStep
    viscosity: Viscosity | None
    contact: ContactTerms | None

    @classmethod
    def of_step(
        cls, body: Body, options: SimulationOptions, scheme: SchemeStep, contact: ContactTerms | None
    ) -> IncrementalPotential:
        """The potential of a step of the scheme."""
        viscosity = None
        if options.stiffness_damping > 0:
            start = body.strain.gradients(scheme.lagged)
            old = start if scheme.old is scheme.lagged else body.strain.gradients(scheme.old)
            viscosity = Viscosity(options.stiffness_damping / scheme.h, start, old)
        return cls(body, options, scheme, viscosity, contact)

    @property
    def mass(self) -> float:
        """Mass of the body, kg."""
        return self.body.mass

    @property
    def inertia(self) -> float:
        """m / h^2, N/m."""
        return self.body.mass / self.scheme.h**2

    @property
    def drag(self) -> float:
        """Mass damping alpha m / h, N/m."""
        return self.options.mass_damping * self.body.mass / self.scheme.h

    @property
    def rounding(self) -> float:
        """How exactly the elastic energy is known near rest, J: its density is a small difference of large numbers."""
        return 1e-14 * self.body.strain.material.mu * float(self.body.strain.weights.sum())

    def evaluate(self, z: Array) -> Evaluation:
        """Energy and gradient at Z (n, 3)."""
        body = self.body
        deformation = body.strain.gradients(z)
        energy, stress = body.strain.energy_and_stress(deformation, self.viscosity)
        if not np.isfinite(energy):
            return Evaluation(z, np.inf, np.zeros_like(z), deformation, None, 0.0)
        move, slide = z - self.scheme.predicted, z - self.scheme.old
        forces = [
            self.inertia * move,
            self.drag * slide,
            -body.mass * np.outer(body.mean_phi, self.options.felt_gravity),
            body.held @ z,
            body.strain.loads(stress),
        ]
        energy += 0.5 * self.inertia * float((move**2).sum()) + 0.5 * self.drag * float((slide**2).sum())
        energy += float((forces[2] * z).sum()) + 0.5 * float((forces[3] * z).sum())
        contact = None
        if self.contact is not None:
            contact = self.contact.value(z)
            energy += contact.energy
            forces.append(self.contact.phi.T @ contact.pull)
        largest = max(float(np.linalg.norm(force)) for force in forces)
        return Evaluation(z, energy, np.sum(forces, axis=0), deformation, contact, largest)

    def tangent(self, at: Evaluation) -> tuple[Tangent, Array | None]:
        """What ``product`` needs at ``at``: of the elasticity, and blocks (N, 3, 3) of the contact."""
        blocks = None
        if self.contact is not None and at.contact is not None:
            blocks = self.contact.whole_blocks(at.z, at.contact)
        return self.body.strain.tangent(at.deformation, self.viscosity), blocks

    def firmer(self, at: Evaluation, change: Array) -> Evaluation | None:
        """``at`` with friction that ``change`` (n, 3) would turn round taken as sticking; None: there is none."""
        if self.contact is None or at.contact is None:
            return None
        contact = self.contact.firmer(at.z, at.contact, change)
        return None if contact is None else at._replace(contact=contact)

    def product(self, tangent: tuple[Tangent, Array | None], change: Array) -> Array:
        """Hessian at the tangent's point times ``change`` (n, 3)."""
        out = (self.inertia + self.drag) * change + self.body.held @ change
        out += self.body.strain.hessian_product(tangent[0], change)
        if self.contact is not None and tangent[1] is not None:
            moved = np.einsum("nab,nb->na", tangent[1], self.contact.phi @ change)
            out += self.contact.phi.T @ moved
        return out

    def admissible(self, z: Array) -> bool:
        """Whether no tissue has gone through a tool on the way to Z (n, 3)."""
        return self.contact is None or not self.contact.crosses(z)
