"""Contact, friction and grip of one body during one step: energy, gradient and Hessian of the samples near tools."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from .barrier import barrier
from .continuous_check import PathStart, path_crosses
from .friction import friction, held_back
from .grasp import grip_value
from .tools import PlacedPart


class Sticking(NamedTuple):
    """Friction pairs: row (k,) into the samples, part (k,), normal (k, 3), limit (k,) N, motion (k, 3) of the tool."""

    row: NDArray[np.int64]
    part: NDArray[np.int64]
    normal: Array
    limit: Array
    motion: Array
    smooth: float


class Held(NamedTuple):
    """Samples in a grip: row (k,), anchor (k, 3) in the scene, stiffness (k,) N/m, limit (k,) N, and the tool."""

    row: NDArray[np.int64]
    anchor: Array
    stiffness: Array
    limit: Array
    tool: int


class ContactValue(NamedTuple):
    """Energy J; pull (N, 3) N: gradient by sample position; blocks (N, 3, 3) N/m: its derivative, without the bend of
    the tools' surfaces, so positive semi-definite; gap (P, N) m that pushes, so beside what is allowed; press (P, N) N
    along normals (P, N, 3), and the other forces."""

    energy: float
    pull: Array
    blocks: Array
    gap: Array
    press: Array
    normals: Array
    stick_pull: Array
    grip_pull: tuple[Array, ...]


@dataclass(frozen=True)
class ContactTerms:
    """samples (N,) near tools with rest points (N, 3), areas (N,), phi (N, n) and start (N, 3): their old positions.

    ``old`` and ``new``: all parts of all tools at the start and the end of the step; allowed (P, N) m: how much deeper
    than elsewhere tissue may be that a grip holds or has let go; gripped (P, N): pairs between jaws that hold;
    ``unchecked`` (P, N): pairs whose way is not looked at, for these reasons or because the tool had crossed already.
    """

    samples: NDArray[np.int64]
    points: Array
    areas: Array
    phi: Array
    start: Array
    old: tuple[PlacedPart, ...]
    new: tuple[PlacedPart, ...]
    allowed: Array
    gripped: NDArray[np.bool_]
    unchecked: NDArray[np.bool_]
    sticking: Sticking
    held: tuple[Held, ...]
    width: float
    pressure: float

    def positions(self, z: Array) -> Array:
        """Positions (N, 3) m at Z (n, 3)."""
        return self.points + self.phi @ z

    def gaps(self, x: Array) -> tuple[Array, Array]:
        """Gaps (P, N) m to the new parts and normals (P, N, 3), at positions (N, 3)."""
        pairs = [part.gap_and_normal(x) for part in self.new]
        return np.stack([gap for gap, _ in pairs]), np.stack([normal for _, normal in pairs])

    def deepest(self, gaps: Array) -> float:
        """Largest penetration, m, at gaps (P, N); of what jaws hold, beyond what it is allowed."""
        return max(0.0, -float(np.where(self.gripped, gaps + self.allowed, gaps).min()))

    def value(self, z: Array) -> ContactValue:
        """Energy and derivatives at Z (n, 3)."""
        x = self.positions(z)
        gap, normals = self.gaps(x)
        gap = gap + self.allowed
        pushed = barrier(gap, self.width, self.pressure)
        energy, slope, curvature = (term * self.areas for term in pushed)
        pull = np.einsum("pn,pna->na", slope, normals)
        blocks = np.einsum("pn,pna,pnb->nab", curvature, normals, normals)
        stick = self.sticking
        rubbed = friction(self._slip(x), stick.normal, stick.limit, stick.smooth)
        np.add.at(pull, stick.row, rubbed.gradient)
        np.add.at(blocks, stick.row, rubbed.blocks)
        total, grips = float(energy.sum()) + rubbed.energy, []
        for held in self.held:
            spring = grip_value(x[held.row] - held.anchor, held.stiffness, held.limit)
            pull[held.row] += spring.gradient
            blocks[held.row] += spring.blocks
            total += spring.energy
            grips.append(spring.gradient)
        return ContactValue(total, pull, blocks, gap, -slope, normals, rubbed.gradient, tuple(grips))

    def firmer(self, z: Array, value: ContactValue, change: Array) -> ContactValue | None:
        """The value at Z with stiffer blocks where ``change`` (n, 3) would turn friction round; None: nowhere."""
        stick = self.sticking
        move = self.phi[stick.row] @ change
        rows, missing = held_back(self._slip(self.positions(z)), stick.normal, stick.limit, stick.smooth, move)
        if not len(rows):
            return None
        blocks = value.blocks.copy()
        np.add.at(blocks, stick.row[rows], missing)
        return value._replace(blocks=blocks)

    def _slip(self, x: Array) -> Array:
        """Way (k, 3) m of the friction pairs beside their tools, at positions (N, 3)."""
        row = self.sticking.row
        slip: Array = x[row] - self.start[row] - self.sticking.motion
        return slip

    def whole_blocks(self, z: Array, value: ContactValue) -> Array:
        """The blocks (N, 3, 3) with the bend of the tools' surfaces, which softens: they may be indefinite.

        Without it for tissue inside a tool, where Newton may begin but does not end: it is pressed so hard there that
        the bend can outweigh all that resists a way along the surface, which cuts conjugate gradients off at once.
        """
        x, blocks = self.positions(z), value.blocks.copy()
        for part, gap, press in zip(self.new, value.gap, value.press, strict=True):
            touched = np.flatnonzero((press > 0) & (gap >= 0))
            blocks[touched] -= press[touched, None, None] * part.bend(x[touched])
        return blocks

    def crosses(self, z: Array) -> bool:
        """Whether some sample has gone through a tool on its way from the start of the step to Z (n, 3)."""
        x, parts = self.positions(z), zip(self._paths, self.new, self._checked, strict=True)
        return any(path_crosses(path, new, x[rows]) for path, new, rows in parts)

    @cached_property
    def _checked(self) -> list[NDArray[np.int64]]:
        return [np.flatnonzero(~skip) for skip in self.unchecked]

    @cached_property
    def _paths(self) -> list[PathStart]:
        return [PathStart.of(old, self.start[rows]) for old, rows in zip(self.old, self._checked, strict=True)]


def already_crossed(old: tuple[PlacedPart, ...], new: tuple[PlacedPart, ...], start: Array) -> NDArray[np.bool_]:
    """(P, N) bool: samples at rest at ``start`` (N, 3) that a part's own motion passes with its middle.

    It happens only to tissue deep inside a tool (placed there by hand); it is pushed out on the nearest side.
    """
    out = np.zeros((len(new), len(start)), dtype=bool)
    for row, a, b in zip(out, old, new, strict=True):
        before, after = a.shape.gap_and_normal(a.to_local(start)), b.shape.gap_and_normal(b.to_local(start))
        row[:] = (before[0] < 0) & (after[0] < 0) & ((before[1] * after[1]).sum(1) < 0)
    return out
