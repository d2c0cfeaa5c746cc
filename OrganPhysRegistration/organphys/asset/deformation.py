"""The deformation in CT mm, inside and beside the organ, with its gradient; in chunks of bounded memory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..basis.reduced_basis import ReducedBasis
from ..ground.checks import Array
from ..ground.frames import Normalisation
from .outside_field import OutsideField, build_outside_field
from .surface_distance import SurfaceDistance

CHUNK = 8192  # points at once: some 100 MB with gradients at 20 handles


@dataclass(frozen=True)
class Deformation:
    """u(x) in CT mm: Phi(X) Z inside the surface, ``OutsideField`` beside it. All points (N, 3) in CT mm."""

    normalisation: Normalisation
    basis: ReducedBasis
    z: Array
    surface: SurfaceDistance

    @cached_property
    def outside(self) -> OutsideField:
        """The field beside the organ; baked on first use, about a second."""
        return build_outside_field(self.surface, self.inside)

    def inside(self, points: Array) -> tuple[Array, Array]:
        """Displacement (N, 3) in mm of the reduced basis itself and its gradient (N, 3, 3), [a, m] = d u_a / d x_m."""
        u, gradient = np.empty((len(points), 3)), np.empty((len(points), 3, 3))
        for part in _chunks(len(points)):
            phi, slopes = self.basis.phi_and_gradient(self.normalisation.apply(points[part]))
            u[part] = self.normalisation.length * (phi @ self.z)
            gradient[part] = (slopes @ self.z).transpose(1, 2, 0)  # mm per mm: the lengths cancel
        return u, gradient

    def displacement(self, points: Array) -> Array:
        """Displacement (N, 3), mm."""
        u = np.empty((len(points), 3))
        for part in _chunks(len(points)):
            u[part] = self._displacement(points[part])
        return u

    def displacement_and_gradient(self, points: Array) -> tuple[Array, Array]:
        """Displacement (N, 3), mm, and its exact gradient (N, 3, 3)."""
        u, gradient = np.empty((len(points), 3)), np.empty((len(points), 3, 3))
        for part in _chunks(len(points)):
            u[part], gradient[part] = self._with_gradient(points[part])
        return u, gradient

    def _displacement(self, points: Array) -> Array:
        u, field = np.zeros((len(points), 3)), self.outside
        own, beside = field.split(points)
        u[own] = self._own(points[own])
        values = field.spline.values(points[beside])
        distance, extension = values[:, 0], values[:, 1:]
        b, f = field.inner(distance)[0], field.fade(distance)[0]
        u[beside] = ((1 - b) * f)[:, None] * extension
        mixed = b > 0
        u[beside[mixed]] += b[mixed, None] * self._own(points[beside[mixed]])
        return u

    def _with_gradient(self, points: Array) -> tuple[Array, Array]:
        u, gradient, field = np.zeros((len(points), 3)), np.zeros((len(points), 3, 3)), self.outside
        own, beside = field.split(points)
        u[own], gradient[own] = self.inside(points[own])
        values, slopes = field.spline.values_and_gradients(points[beside])
        distance, extension, normal = values[:, 0], values[:, 1:], slopes[:, 0]
        (b, db), (f, df) = field.inner(distance), field.fade(distance)
        share, d_share = (1 - b) * f, (1 - b) * df - db * f
        u[beside] = share[:, None] * extension
        gradient[beside] = share[:, None, None] * slopes[:, 1:] + _outer(d_share[:, None] * extension, normal)
        mixed = np.flatnonzero(b > 0)
        own_u, own_gradient = self.inside(points[beside[mixed]])
        u[beside[mixed]] += b[mixed, None] * own_u
        gradient[beside[mixed]] += b[mixed, None, None] * own_gradient
        gradient[beside[mixed]] += _outer(db[mixed, None] * own_u, normal[mixed])
        return u, gradient

    def _own(self, points: Array) -> Array:
        if not len(points):
            return np.zeros((0, 3))
        phi = self.basis.phi(self.normalisation.apply(points))
        return self.normalisation.length * (phi @ self.z)


def _chunks(count: int) -> list[slice]:
    return [slice(start, start + CHUNK) for start in range(0, count, CHUNK)]


def _outer(a: Array, b: Array) -> Array:
    return a[:, :, None] * b[:, None, :]
