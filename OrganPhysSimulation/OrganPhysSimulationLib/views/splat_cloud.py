"""A splat's Gaussians as they are drawn: positions, axes and turns in world mm, those bound to the organ moving."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from organphys.ground.checks import Array
from organphys.simulation.body import Body
from organphys.simulation.quick_splat import QuickSplat
from OrganPhysRegistrationLib.inputs.matrices import apply_matrix, scale_of

from ..engine.covariance_axes import axes_of, turned

Single = NDArray[np.float32]

LEVELS = 65535


class SplatCloud:
    """``arrays``: of a splat node (see inputs.splat_input); ``rows`` (M,): the Gaussians that are drawn.

    positions (M, 3) mm, deviations (M, 3) mm, turns (M, 4) w, x, y, z; colours (M, 3) uint8; opacities (M,).
    """

    def __init__(self, arrays: dict[str, NDArray], rows: NDArray[np.int64]) -> None:
        self._rows = rows
        self._centres = np.asarray(arrays["centres"][rows], dtype=np.float64)
        self._scales = np.asarray(arrays["scale"][rows], dtype=np.float32)
        self._rotations = np.asarray(arrays["rotation"][rows], dtype=np.float32)
        self.colours, self.opacities = arrays["colour"][rows], np.asarray(arrays["opacity"][rows], dtype=np.float32)
        self._T_world_scene = np.eye(4)
        self.place(np.eye(4))

    def place(self, T_world_scene: Array) -> None:
        """Everything at rest where the splat stands now: a similarity (4, 4) from scene units to world mm."""
        self._T_world_scene = np.array(T_world_scene)
        self._size = abs(scale_of(T_world_scene))
        self._turn = Rotation.from_matrix(T_world_scene[:3, :3] / self._size).as_quat()[[3, 0, 1, 2]]
        self.positions: Single = apply_matrix(T_world_scene, self._centres).astype(np.float32)
        self.deviations: Single = np.float32(self._size) * self._scales
        self.turns: Single = turned(self._rotations, self._turn)

    def follow(self, binding: QuickSplat, body: Body, z: Array) -> None:
        """The bound Gaussians as they are at Z (n, 3) of ``body``."""
        drawn, here = self._drawn(binding)
        u, covariances = binding.frame(body, z)
        places = self._centres[here] + u[drawn]
        deviations, turns = axes_of(covariances[drawn])
        self.positions[here] = apply_matrix(self._T_world_scene, places)
        self.deviations[here] = np.float32(self._size) * deviations
        self.turns[here] = turned(turns, self._turn)

    def order(self, direction: Array) -> NDArray[np.int64]:
        """Rows from far to near for a camera that looks along ``direction`` (3,), world mm.

        By the depth in parts of 1/65535 of all depths, whole numbers of 16 bits being sorted several times faster.
        """
        depth = self.positions @ np.asarray(direction, dtype=np.float32)
        nearest, farthest = (depth.min(), depth.max()) if len(depth) else (0.0, 0.0)
        nearness = (farthest - depth) * (LEVELS / max(float(farthest - nearest), 1e-30))
        return np.argsort(nearness.astype(np.uint16), kind="stable")

    def _drawn(self, binding: QuickSplat) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows of the binding that are drawn, and where they are among the drawn ones."""
        if getattr(self, "_bound", None) is not binding:
            _, drawn, here = np.intersect1d(binding.index, self._rows, assume_unique=True, return_indices=True)
            self._bound, self._pairs = binding, (drawn, here)
        return self._pairs
