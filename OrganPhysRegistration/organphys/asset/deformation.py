"""The deformation in CT mm, inside and beside the organ, with its gradient; in chunks of bounded memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..basis.reduced_basis import ReducedBasis
from ..ground.checks import Array
from ..ground.frames import Normalisation
from .in_chunks import in_chunks
from .outside_field import OutsideField, build_outside_field
from .surface_distance import SurfaceDistance

FEW = 20_000  # up to so many points a test for lying inside is quicker than baking the outside field
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

        def evaluate(part: slice) -> None:
            at = self.normalisation.apply(points[part])
            moved, gradient[part] = self.basis.displacement_and_gradient(self.z, at)  # mm per mm: the lengths cancel
            u[part] = self.normalisation.length * moved

        in_chunks(len(points), CHUNK, evaluate)
        return u, gradient

    def inside_displacement(self, points: Array) -> Array:
        """Displacement (N, 3) in mm of the reduced basis itself, also where the points (N, 3) lie outside."""
        return self._gathered(self._own, points)

    def displacement(self, points: Array) -> Array:
        """Displacement (N, 3), mm."""
        if self._all_inside(points):
            return self.inside_displacement(points)
        field = self.outside  # baked before the threads ask for it
        return self._gathered(lambda part: self._displacement(part, field), points)

    def displacement_and_gradient(self, points: Array) -> tuple[Array, Array]:
        """Displacement (N, 3), mm, and its exact gradient (N, 3, 3)."""
        if self._all_inside(points):
            return self.inside(points)
        u, gradient, field = np.empty((len(points), 3)), np.empty((len(points), 3, 3)), self.outside

        def evaluate(part: slice) -> None:
            u[part], gradient[part] = self._with_gradient(points[part], field)

        in_chunks(len(points), CHUNK, evaluate)
        return u, gradient

    def _gathered(self, move: Callable[[Array], Array], points: Array) -> Array:
        u = np.empty((len(points), 3))

        def evaluate(part: slice) -> None:
            u[part] = move(points[part])

        in_chunks(len(points), CHUNK, evaluate)
        return u

    def _all_inside(self, points: Array) -> bool:
        """Whether the field beside the organ can be left unbaked: it is not there yet, and few points need no bake."""
        if "outside" in vars(self) or len(points) > FEW:
            return False
        return not (self.surface.signed(points) > 0).any()

    def _displacement(self, points: Array, field: OutsideField) -> Array:
        u = np.zeros((len(points), 3))
        own, beside = field.split(points)
        u[own] = self._own(points[own])
        values = field.spline.values(points[beside])
        distance, extension = values[:, 0], values[:, 1:]
        b, f = field.inner(distance)[0], field.fade(distance)[0]
        mixed = np.flatnonzero(b > 0)
        moved = (1 - b)[:, None] * extension
        moved[mixed] += b[mixed, None] * self._own(points[beside[mixed]])
        u[beside] = f[:, None] * moved
        return u

    def _with_gradient(self, points: Array, field: OutsideField) -> tuple[Array, Array]:
        u, gradient = np.zeros((len(points), 3)), np.zeros((len(points), 3, 3))
        own, beside = field.split(points)
        u[own], gradient[own] = self.inside(points[own])
        values, slopes = field.spline.values_and_gradients(points[beside])
        distance, extension, normal = values[:, 0], values[:, 1:], slopes[:, 0]
        (b, db), (f, df) = field.inner(distance), field.fade(distance)
        mixed = np.flatnonzero(b > 0)
        moved, slope = (1 - b)[:, None] * extension, (1 - b)[:, None, None] * slopes[:, 1:]
        own_u, own_slope = self.inside(points[beside[mixed]])
        moved[mixed] += b[mixed, None] * own_u
        slope[mixed] += b[mixed, None, None] * own_slope
        slope[mixed] += _outer(db[mixed, None] * (own_u - extension[mixed]), normal[mixed])
        u[beside] = f[:, None] * moved
        gradient[beside] = f[:, None, None] * slope + _outer(df[:, None] * moved, normal)
        return u, gradient

    def _own(self, points: Array) -> Array:
        if not len(points):
            return np.zeros((0, 3))
        moved = self.basis.displacement(self.z, self.normalisation.apply(points))
        return self.normalisation.length * moved


def _outer(a: Array, b: Array) -> Array:
    return a[:, :, None] * b[:, None, :]
