"""Covariance of the mapped position of any CT point, from that of the reduced coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..basis.reduced_basis import ReducedBasis
from ..basis.reduced_covariance import ReducedCovariance
from ..ground.checks import Array
from ..ground.frames import Normalisation
from .in_chunks import in_chunks
from .surface_distance import SurfaceDistance

CHUNK = 8192


@dataclass(frozen=True)
class PointCovariance:
    """In mm^2 along the CT axes (turned by the registered rotation in the scene), for points (N, 3) in CT mm.

    Beside the organ the uncertainty is continued linearly from the nearest point of its surface, as if the tissue there
    were one with the organ; that it is not is no part of it.
    """

    normalisation: Normalisation
    basis: ReducedBasis
    z: Array
    reduced: ReducedCovariance
    surface: SurfaceDistance

    def inside(self, points: Array) -> Array:
        """Covariance (N, 3, 3) of points that lie in the organ or on its surface."""

        def own(part: slice) -> Array:
            x = self.normalisation.apply(points[part])
            return self._at(self.basis.phi(x), x)

        return _in_parts(len(points), own)

    def anywhere(self, points: Array) -> Array:
        """Covariance (N, 3, 3) of points that may lie outside."""
        distance, foot = self.surface.signed_with_foot(points)
        out, beside = np.empty((len(points), 3, 3)), distance > 0
        out[~beside] = self.inside(points[~beside])
        offset = (points - foot)[beside] / self.normalisation.length
        feet = foot[beside]

        def continued(part: slice) -> Array:
            x = self.normalisation.apply(feet[part])
            phi, gradient = self.basis.phi_and_gradient(x)
            phi += np.einsum("nm,mnh->nh", offset[part], gradient)
            return self._at(phi, x + offset[part])

        out[beside] = _in_parts(len(feet), continued)
        return out

    def _at(self, phi: Array, x: Array) -> Array:
        return self.normalisation.length**2 * self.reduced.at(phi, x + phi @ self.z)


def _in_parts(count: int, evaluate: Callable[[slice], Array]) -> Array:
    """(count, 3, 3) from ``evaluate``, chunk by chunk."""
    out = np.empty((count, 3, 3))

    def fill(part: slice) -> None:
        out[part] = evaluate(part)

    in_chunks(count, CHUNK, fill)
    return out
