"""One organ registered at many times: the asset of the first frame, and coordinates and similarity of every frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..ground.checks import Array, InputError
from ..ground.frames import Similarity
from .baked_surface import BakedSurface
from .registered_organ import RegisteredOrgan

STATUS = ("first", "tracked", "restarted", "lost")


@dataclass(frozen=True)
class OrganSequence:
    """T frames of one organ, whose geometry and basis are those of ``organ``, the first frame.

    times (T,): ``time_unit`` ("s", or "frame" where nobody knows), rising; z (T, 4H, 3); scales (T,), rotations
    (T, 3, 3), translations (T, 3): T_scene_ct of each; status (T,): one of STATUS, "lost": the organ was not found and
    lies as in the frame before; figures: name -> (T,), with the unit in the name; notices: (frame, message).
    """

    organ: RegisteredOrgan
    times: Array
    z: Array
    scales: Array
    rotations: Array
    translations: Array
    status: tuple[str, ...]
    time_unit: str = "s"
    figures: Mapping[str, Array] = field(default_factory=dict)
    notices: Sequence[tuple[int, str]] = ()

    def __post_init__(self) -> None:
        count = len(self.times)
        shapes = {
            "times": (count,), "z": (count, self.organ.basis.size, 3), "scales": (count,),
            "rotations": (count, 3, 3), "translations": (count, 3),
        }  # fmt: skip
        for name, shape in shapes.items():
            array = np.asarray(getattr(self, name), dtype=np.float64)
            if array.shape != shape or not np.isfinite(array).all():
                raise InputError(f"sequence {name}: expected finite numbers of shape {shape}, got {array.shape}")
            object.__setattr__(self, name, array)
        if not count or (np.diff(self.times) <= 0).any():
            raise InputError("sequence times: expected at least one, each later than the one before")
        if len(self.status) != count or not set(self.status) <= set(STATUS):
            raise InputError(f"sequence status: expected {count} of {', '.join(STATUS)}")
        if (self.scales <= 0).any() or not np.allclose(self.rotations @ self.rotations.transpose(0, 2, 1), np.eye(3)):
            raise InputError("sequence similarities: expected scales above 0 and rotations")
        if any(np.shape(values) != (count,) for values in self.figures.values()):
            raise InputError(f"sequence figures: expected {count} numbers each")

    def __len__(self) -> int:
        return len(self.times)

    def similarity(self, frame: int) -> Similarity:
        """T_scene_ct of a frame."""
        k = self._checked(frame)
        return Similarity(float(self.scales[k]), self.rotations[k], self.translations[k])

    def frame(self, frame: int) -> RegisteredOrgan:
        """The organ as it lies in a frame (0 to T - 1); what it knows of its uncertainty is that of the first."""
        k = self._checked(frame)
        uncertainty = self.organ.uncertainty if k == 0 else None
        return replace(self.organ, z=self.z[k], T_scene_ct=self.similarity(k), uncertainty=uncertainty)

    def map_points(self, points_ct_mm: ArrayLike, frame: int) -> Array:
        """CT RAS mm (N, 3) -> scene units (N, 3) at a frame, anywhere in space."""
        return self.frame(frame).map_points(points_ct_mm)

    def scene_vertices(self, frame: int) -> Array:
        """Surface vertices (Nv, 3) in scene units at a frame; quick after the first call."""
        k = self._checked(frame)
        moved = self._baked.length * (self._baked.phi @ self.z[k])
        return self.similarity(k).apply(self.organ.vertices + moved)

    @cached_property
    def _baked(self) -> BakedSurface:
        return BakedSurface.of(self.organ.basis, self.organ.normalisation, self.organ.vertices)

    def _checked(self, frame: int) -> int:
        if not 0 <= frame < len(self):
            raise InputError(f"frame: expected 0 to {len(self) - 1}, got {frame}")
        return int(frame)
