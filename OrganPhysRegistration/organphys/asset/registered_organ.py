"""The registered organ: everything later stages need, without the inputs.

Inside the organ y = T_scene_ct(undo(X + Phi(X) Z)) with X the normalised CT point; beside it the deformation of the
nearest organ region fades to the similarity (``outside_field.py``). The map is continuously differentiable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..basis.error_radius import error_radius
from ..basis.reduced_basis import ReducedBasis
from ..basis.reduced_covariance import ReducedCovariance
from ..ground.checks import Array, InputError, as_points, one_of
from ..ground.frames import Normalisation, Similarity
from .deformation import Deformation
from .inverse_map import InverseMap, invert
from .point_covariance import PointCovariance
from .surface_distance import SurfaceDistance

VOLUME_POINTS = 30_000


@dataclass(frozen=True)
class RegisteredOrgan:
    """Similarity, basis and coordinates of one registered organ, with its geometry in CT RAS mm.

    z (4H, 3); vertices (Nv, 3), faces (Nf, 3): closed surface, faces counter-clockwise from outside; volume_points
    (N, 3) inside, N <= 30000; quadrature_points (Q, 3) and quadrature_weights (Q,) of the elastic energy, weights in
    parts of the organ volume; tissue: SI numbers (``youngs_pa``, ``nu``, ``density_kg_m3``, ...); mm_per_scene_unit:
    as stated with the input, None if it was not; provenance: input hashes, versions, options, seed (JSON values);
    uncertainty: covariance of z and the scale, None where the method gives none.
    """

    T_scene_ct: Similarity
    normalisation: Normalisation
    basis: ReducedBasis
    z: Array
    vertices: Array
    faces: NDArray[np.int64]
    volume_points: Array
    quadrature_points: Array
    quadrature_weights: Array
    volume_ml: float
    name: str = "organ"
    tissue: Mapping[str, Any] = field(default_factory=dict)
    mm_per_scene_unit: float | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    uncertainty: ReducedCovariance | None = None

    def __post_init__(self) -> None:
        for name in ("vertices", "volume_points", "quadrature_points"):
            object.__setattr__(self, name, np.ascontiguousarray(as_points(getattr(self, name), name)))
        faces = np.asarray(self.faces, dtype=np.int64)
        if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
            raise InputError(f"faces: expected triangles of shape (N, 3), got shape {faces.shape}")
        if faces.min() < 0 or faces.max() >= len(self.vertices):
            raise InputError(f"faces: indices must lie within the {len(self.vertices)} vertices")
        if np.shape(self.z) != (self.basis.size, 3) or not np.isfinite(self.z).all():
            raise InputError(f"z: expected finite coordinates of shape ({self.basis.size}, 3), got {np.shape(self.z)}")
        if np.shape(self.quadrature_weights) != (len(self.quadrature_points),):
            raise InputError("quadrature weights: expected one number per quadrature point")
        if self.uncertainty is not None and len(self.uncertainty.factor) != 3 * self.basis.size + 1:
            raise InputError(f"covariance factor: expected {3 * self.basis.size + 1} rows for this basis")
        # Row-major copies: the layout changes the rounding of matrix products, and a loaded asset must map bit for bit.
        arrays = {name: np.array(value, order="C") for name, value in self.basis.arrays().items()}
        object.__setattr__(self, "basis", ReducedBasis.from_arrays(self.basis.weights.kind, arrays))
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "z", np.array(self.z, dtype=np.float64, order="C"))
        object.__setattr__(self, "quadrature_weights", np.asarray(self.quadrature_weights, dtype=np.float64))

    @property
    def mm_per_unit(self) -> float:
        """Millimetres per scene unit: as stated, else 1 / registered scale."""
        return self.mm_per_scene_unit or 1 / self.T_scene_ct.scale

    def map_points(self, points_ct_mm: ArrayLike) -> Array:
        """CT RAS mm (N, 3) -> scene units (N, 3), anywhere in space."""
        points = as_points(points_ct_mm, "points", minimum=0)
        return self.T_scene_ct.apply(points + self.deformation.displacement(points))

    def inverse_map_points(self, points_scene: ArrayLike) -> Array:
        """Scene units (N, 3) -> CT RAS mm (N, 3); rows of NaN where no inverse was found (see ``inverse_map``)."""
        return self.inverse_map(points_scene).points

    def inverse_map(self, points_scene: ArrayLike) -> InverseMap:
        """Scene units (N, 3) -> CT RAS mm with what remains of the residual and which points converged."""
        points = as_points(points_scene, "points", minimum=0)
        return invert(self.deformation, self.T_scene_ct.inverse().apply(points))

    def deformation_gradient(self, points_ct_mm: ArrayLike) -> Array:
        """F (N, 3, 3), [a, m] = d x'_a / d x_m, of the deformation beyond the similarity: det F = 1 keeps volume."""
        points = as_points(points_ct_mm, "points", minimum=0)
        return self.deformation.displacement_and_gradient(points)[1] + np.eye(3)

    def covariance(self, points_ct_mm: ArrayLike) -> Array:
        """Covariance (N, 3, 3), mm^2 along the CT axes, of the mapped positions of CT points (N, 3): how sure they are.

        InputError where the organ carries no uncertainty (an older file, or a method that gives none).
        """
        return self.point_covariance.anywhere(as_points(points_ct_mm, "points", minimum=0))

    def error_radius(self, points_ct_mm: ArrayLike, probability: float = 0.95) -> Array:
        """Radius (N,) in mm within which the true positions of CT points (N, 3) lie with ``probability``."""
        return error_radius(self.covariance(points_ct_mm), probability, freedom=self.known_uncertainty.freedom)

    def outside_distance_mm(self, points_ct_mm: ArrayLike) -> Array:
        """How far (N,) the CT points (N, 3) lie outside the organ surface, mm; 0 inside."""
        points = as_points(points_ct_mm, "points", minimum=0)
        return self.surface_distance.outside(points)

    def surface(self, *, frame: str = "scene") -> tuple[Array, NDArray[np.int64]]:
        """Vertices (Nv, 3) and faces (Nf, 3): "scene" (scene units, registered) or "ct" (mm, before registration)."""
        one_of(frame, "frame", ("scene", "ct"))
        return (self.vertices if frame == "ct" else self.scene_vertices), self.faces

    @cached_property
    def scene_vertices(self) -> Array:
        """Registered surface vertices (Nv, 3), scene units."""
        return self.T_scene_ct.apply(self.vertices + self.surface_displacement_mm)

    @cached_property
    def surface_displacement_mm(self) -> Array:
        """Displacement (Nv, 3) of the vertices beyond the similarity, mm along the CT axes (RAS)."""
        return self._surface_motion[0]

    @cached_property
    def surface_det_f(self) -> Array:
        """det F (Nv,) at the surface vertices."""
        return np.linalg.det(self._surface_motion[1] + np.eye(3))

    def surface_error_mm(self, probability: float) -> Array:
        """Radius (Nv,) in mm within which the true positions of the vertices lie with ``probability``."""
        return error_radius(self._surface_covariance, probability, freedom=self.known_uncertainty.freedom)

    @cached_property
    def _surface_covariance(self) -> Array:
        return self.point_covariance.inside(self.vertices)

    @property
    def known_uncertainty(self) -> ReducedCovariance:
        """``uncertainty``; InputError where there is none."""
        if self.uncertainty is None:
            raise InputError("confidence: this organ carries none; register it again with method organphys")
        return self.uncertainty

    @property
    def point_covariance(self) -> PointCovariance:
        """Covariance of mapped CT points."""
        reduced = self.known_uncertainty
        return PointCovariance(self.normalisation, self.basis, self.z, reduced, self.surface_distance)

    @cached_property
    def _surface_motion(self) -> tuple[Array, Array]:
        return self.deformation.inside(self.vertices)

    @cached_property
    def surface_distance(self) -> SurfaceDistance:
        """Signed distance to the CT surface, mm."""
        return SurfaceDistance(self.vertices, self.faces)

    @cached_property
    def deformation(self) -> Deformation:
        """The deformation in CT mm, similarity taken out."""
        return Deformation(self.normalisation, self.basis, self.z, self.surface_distance)
