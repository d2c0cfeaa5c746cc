"""A smooth deformation that keeps volume: the flow of a velocity field without divergence.

v(x) = sum_j c_j cos(k_j . x + phase_j) with c_j at right angles to k_j has div v = 0, so the map that carries every
point along v for unit time has det F = 1 (Liouville), up to the error of the time integration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..ground.checks import Array
from ..ground.frames import fit_similarity, tangent_axes


@dataclass(frozen=True)
class Flow:
    """waves (J, 3) in rad/mm, velocities (J, 3) in mm per unit time with waves . velocities = 0, phases (J,) rad."""

    waves: Array
    velocities: Array
    phases: Array
    centre: Array
    steps: int = 4

    def velocity(self, points: Array) -> Array:
        """Velocity (N, 3) in mm per unit time at points (N, 3) mm."""
        result: Array = np.cos((points - self.centre) @ self.waves.T + self.phases) @ self.velocities
        return result

    def apply(self, points: Array) -> Array:
        """Points (N, 3) mm carried along for unit time (classical Runge-Kutta, order 4)."""
        h = 1 / self.steps
        for _ in range(self.steps):
            a = self.velocity(points)
            b = self.velocity(points + h / 2 * a)
            c = self.velocity(points + h / 2 * b)
            d = self.velocity(points + h * c)
            points = points + h / 6 * (a + 2 * b + 2 * c + d)
        return points

    def normals(self, points: Array, normals: Array, *, step: float = 0.05) -> Array:
        """Unit normals (N, 3) of the carried surface, from two carried tangents."""
        first, second = tangent_axes(normals)
        moved = self.apply(points)
        turned = np.cross(self.apply(points + step * first) - moved, self.apply(points + step * second) - moved)
        return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def random_flow(points: Array, mainly: Array, *, rms_mm: float, rng: np.random.Generator, modes: int = 6) -> Flow:
    """A flow whose displacement of points (N, 3), after the best rigid motion, has root mean square ``rms_mm``.

    Tissue moves mostly along ``mainly`` (3,), as an organ bends under gravity and gas pressure.
    """
    push = mainly / np.linalg.norm(mainly) + rng.normal(0, 0.25, (modes, 3))
    directions = np.cross(push, rng.normal(size=(modes, 3)))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    waves = directions * (2 * np.pi / rng.uniform(180.0, 340.0, modes))[:, None]
    velocities = push * rng.uniform(0.5, 1, (modes, 1))
    flow = Flow(waves, velocities, rng.uniform(0, 2 * np.pi, modes), points.mean(0))
    for _ in range(4):  # the rms grows almost in proportion to the velocity
        factor = rms_mm / float(np.sqrt((nonrigid(points, flow.apply(points)) ** 2).sum(1).mean()))
        flow = replace(flow, velocities=flow.velocities * factor)
    return flow


def nonrigid(points: Array, moved: Array) -> Array:
    """What is left (N, 3) of the displacement of points (N, 3) after the best rigid motion, without scale."""
    return moved - fit_similarity(points, moved, scale=False).apply(points)
