"""The frozen records that flow from the readers to the stages. Arrays are float64 unless said."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, InputError, as_positive, as_vector
from ..ground.notices import Notice

LEAST_UNIT_MM = 1e-6


@dataclass(frozen=True)
class Organ:
    """One organ of a pre-operative label map, RAS mm.

    vertices (Nv, 3), faces (Nf, 3) int: smoothed closed surface, faces counter-clockwise seen from outside;
    vertex_normals (Nv, 3) unit, outward; volume_points (N, 3): centres of all labelled voxels (the paper's V);
    boundary (N,) bool: which of them lie on the boundary (the paper's S); spacing_mm (3,).
    """

    vertices: Array
    faces: NDArray[np.int64]
    vertex_normals: Array
    volume_points: Array
    boundary: NDArray[np.bool_]
    spacing_mm: Array
    volume_ml: float
    name: str = "organ"
    notices: tuple[Notice, ...] = ()

    @property
    def boundary_points(self) -> Array:
        """Centres (M, 3) of the boundary voxels, RAS mm."""
        return self.volume_points[self.boundary]


@dataclass(frozen=True)
class GaussianCloud:
    """All Gaussians of a splat in file order, raw scene units; index i is row i of the file.

    centres (N, 3) float32 or float64; opacities (N,) in 0..1; colours (N, 3) in 0..1 (zero-order SH); valid (N,)
    bool: False where any of the Gaussian's numbers is not finite (masked, never dropped).
    """

    centres: NDArray[np.floating]
    opacities: NDArray[np.floating]
    colours: NDArray[np.floating]
    valid: NDArray[np.bool_]
    notices: tuple[Notice, ...] = ()

    def __len__(self) -> int:
        return len(self.centres)


@dataclass(frozen=True)
class Landmarks:
    """Points clicked on the CT organ: points_ct (L, 3) RAS mm and their names; of some or all of them also the same
    tissue's place in the splat: points_scene (P, 3), raw scene units, of the landmarks numbered ``pairs`` (P,), which
    may be left out where P = L."""

    points_ct: Array
    names: tuple[str, ...] = ()
    points_scene: Array | None = None
    pairs: tuple[int, ...] | None = None

    @property
    def positions(self) -> Array:
        """points_ct."""
        return self.points_ct


@dataclass(frozen=True)
class Box:
    """Oriented box in scene units: centre (3,), size (3,) full edge lengths, axes (3, 3) rows = unit axes."""

    centre: Array
    size: Array
    axes: Array = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", as_vector(self.centre, "box centre"))
        object.__setattr__(self, "size", as_vector(self.size, "box size"))
        axes = np.array(self.axes, dtype=np.float64)
        sound = axes.shape == (3, 3) and bool((np.abs(axes) <= 1.001).all())
        if not sound or not np.allclose(axes @ axes.T, np.eye(3), atol=1e-3):
            raise InputError("box axes: expected three orthonormal rows of shape (3, 3)")
        if (self.size <= 0).any():
            raise InputError(f"box size: expected three numbers above 0, got {self.size.tolist()}")
        object.__setattr__(self, "axes", axes)

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """(N,) bool: which of the points (N, 3) lie inside."""
        inside: NDArray[np.bool_] = np.all(np.abs((points - self.centre) @ self.axes.T) <= self.size / 2, axis=1)
        return inside


@dataclass(frozen=True)
class Camera:
    """The endoscope's reference view: position (3,) in scene units and full field of view in degrees, if known."""

    position: Array = field(default_factory=lambda: np.zeros(3))
    fov_deg: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", as_vector(self.position, "camera position"))
        if self.fov_deg is not None and not 1 <= as_positive(self.fov_deg, "field of view") < 180:
            raise InputError(f"field of view: expected from 1 to below 180 degrees, got {self.fov_deg}")


@dataclass(frozen=True)
class SceneUnit:
    """Millimetres per scene unit, with a standard deviation in percent (0: exact)."""

    mm_per_unit: float
    percent: float = 0.0

    def __post_init__(self) -> None:
        if not LEAST_UNIT_MM <= as_positive(self.mm_per_unit, "mm per unit") <= 1 / LEAST_UNIT_MM:
            raise InputError(
                f"mm per unit: expected {LEAST_UNIT_MM:g} to {1 / LEAST_UNIT_MM:g} mm, got {self.mm_per_unit}"
            )
        if not 0 <= self.percent <= 100:
            raise InputError(f"mm per unit: expected a deviation of 0 to 100 percent, got {self.percent}")
