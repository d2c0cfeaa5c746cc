"""Gaussians moved by a warp kernel, on the CPU or a CUDA device; warp is loaded when one of these is made."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from ..ground.checks import Array, InputError
from .simulation_basis import LocalColumns
from .splat_binding import Followers
from .splat_grid import Single, SplatGrid
from .splat_threads import in_threads

THREADS = min(os.cpu_count() or 1, 4)
NOWHERE = np.zeros((0, 3))


class WarpMover:
    """Moves Gaussians with covariance (K, 3, 3) at rest by the motion of the nodes of their grid.

    InputError if warp-lang is not installed or has no such device.
    """

    def __init__(
        self, bound: Followers, grid: SplatGrid, covariance: Single, device: str, *, nodes_too: bool | None = None
    ) -> None:
        """``nodes_too``: a kernel also moves the nodes, where a GPU is (None) or always or never."""
        self._warp, self._kernels = _loaded(device)
        self._device, self._grid = device, grid
        wp = self._warp
        self._rest = (
            self._array(grid.corners, wp.int32),
            self._array(grid.cell, wp.int32),
            self._array(grid.part, wp.vec3),
            self._array(bound.points, wp.vec3),
            self._array(bound.share, wp.float32),
            self._array(bound.share_slope, wp.vec3),
            self._array(covariance, wp.mat33),
        )
        self._count, self._per_metre, self._rows = len(bound.index), 1.0 / bound.unit, None
        if device != "cpu" if nodes_too is None else nodes_too:
            rows = np.concatenate([grid.phi[None], grid.slopes]).transpose(0, 2, 1)
            self._rows = self._array(rows, wp.float32)

    def frame(self, base: Array, local: LocalColumns | None, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and covariances (K, 3, 3) at base coordinates (n, 3)."""
        moved, shape = self.on_device(base, local, z)
        return moved.numpy(), shape.numpy()

    def motion(self, base: Array, local: LocalColumns | None, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and deformation gradients (K, 3, 3)."""
        moved, gradient = self.on_device(base, local, z, gradients=True)
        return moved.numpy(), gradient.numpy()

    def on_device(
        self, base: Array, local: LocalColumns | None, z: Array, *, gradients: bool = False
    ) -> tuple[Any, Any]:
        """The same as warp arrays on the device, for whoever draws them there; CUDA may still be at work on them."""
        wp, (_, kernel, _) = self._warp, self._kernels
        centres, weights, radius, middle, reach = NOWHERE, NOWHERE, 1.0, np.zeros(3), 0.0
        if local is not None:
            centres, weights = local.functions.centres, local.mixing @ z
            radius, middle, reach = local.functions.radius, local.functions.middle, local.functions.reach
        moved = wp.empty(self._count, dtype=wp.vec3, device=self._device)
        shape = wp.empty(self._count, dtype=wp.mat33, device=self._device)
        fields = self._fields(base)
        local_kernels = (self._array(centres, wp.vec3), self._array(weights, wp.vec3))
        numbers = (float(radius), wp.vec3(*middle.tolist()), float(reach), self._per_metre)

        def launch(ends: tuple[int, int]) -> None:
            inputs = [fields, *self._rest, *local_kernels, *numbers, ends[0], gradients]
            wp.launch(kernel, ends[1] - ends[0], inputs, outputs=[moved, shape], device=self._device)

        cuts = np.linspace(0, self._count, (THREADS if self._device == "cpu" else 1) + 1).astype(int).tolist()
        pieces = list(pairwise(cuts))
        if len(pieces) == 1:
            launch(pieces[0])
        else:
            with ThreadPoolExecutor(len(pieces)) as pool:
                list(pool.map(launch, pieces))
        return moved, shape

    def _fields(self, base: Array) -> Any:
        """Motion of the nodes on the device."""
        wp, (nodes, _, motion) = self._warp, self._kernels
        if self._rows is None:
            return self._array(self._grid.fields(base, in_threads), motion)
        fields = wp.empty(self._rows.shape[2], dtype=motion, device=self._device)
        inputs = [self._rows, self._array(base, wp.vec3)]
        wp.launch(nodes, len(fields), inputs, outputs=[fields], device=self._device)
        return fields

    def _array(self, values: Any, dtype: Any) -> Any:
        single = np.ascontiguousarray(values, dtype=np.int32 if dtype is self._warp.int32 else np.float32)
        return self._warp.array(single, dtype=dtype, device=self._device)


def check_device(device: str) -> None:
    """InputError that says what is missing for "cpu" or "cuda"."""
    _loaded(device)


def _loaded(device: str) -> tuple[Any, tuple[Any, Any, Any]]:
    """The warp module, the kernels of nodes and Gaussians, and the type of a node's motion."""
    try:
        import warp
    except ImportError as error:
        raise InputError(
            f"device {device!r}: warp-lang is not installed; pip install 'organphys[gpu]', or use device 'numpy'"
        ) from error
    from .splat_kernels import Motion, move_gaussians, move_nodes

    if device == "cuda" and not warp.is_cuda_available():
        raise InputError("device 'cuda': warp finds no CUDA device here; use 'cpu' or 'numpy'")
    warp.load_module(move_gaussians.module, device=device)
    return warp, (move_nodes, move_gaussians, Motion)
