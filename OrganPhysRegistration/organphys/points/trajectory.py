"""A tool's trajectory: where the tip of a gripper is, how it is turned and how wide it is open, over time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..ground.checks import Array, InputError, as_points, one_of
from ..ground.frames import MM_PER_UNIT, Similarity, rotation_about

FRAMES = ("scene", "ct", "m")
UNITS = {"scene": ("scene", "m", "cm", "mm"), "ct": ("mm", "cm", "m"), "m": ("m", "cm", "mm")}  # the first: if not said
MOST_POSES = 200_000
FARTHEST_JAW = 180.0  # deg


class TipPose(NamedTuple):
    """The tip at one moment: position (3,), rotation (3, 3) with z forward and x along the hinge, opening in deg."""

    position: Array
    rotation: Array
    jaw_deg: float


@dataclass(frozen=True)
class Trajectory:
    """Poses of the tip of the closed jaws, T >= 1 of them.

    times (T,) s, rising; positions (T, 3); rotations (T, 3, 3), proper; jaw_deg (T,). frame: "scene" (the splat's raw
    axes), "ct" (RAS), "m" (the simulation: scene axes, metres); unit of the positions: "mm", "cm", "m", or "scene" for
    the splat's own unit. InputError names what does not fit.
    """

    times: Array
    positions: Array
    rotations: Array
    jaw_deg: Array
    frame: str = "m"
    unit: str = ""

    def __post_init__(self) -> None:
        one_of(self.frame, "trajectory frame", FRAMES)
        object.__setattr__(
            self, "unit", one_of(self.unit or UNITS[self.frame][0], "trajectory unit", UNITS[self.frame])
        )
        positions = as_points(self.positions, "trajectory positions")
        count = len(positions)
        if count > MOST_POSES:
            raise InputError(f"trajectory: {count} poses, at most {MOST_POSES} can be taken; thin them out")
        times, jaw_deg = _column(self.times, "times", count), _column(self.jaw_deg, "jaw_deg", count)
        if (np.diff(times) <= 0).any():
            row = int(np.argmax(np.diff(times) <= 0)) + 1
            raise InputError(
                f"trajectory: times must rise, pose {row + 1} at {times[row]:g} s follows one at {times[row - 1]:g} s"
            )
        if (np.abs(jaw_deg) > FARTHEST_JAW).any():
            raise InputError(f"trajectory: jaw_deg must be within +-{FARTHEST_JAW:g} degrees; were they radians or mm?")
        rotations = _rotations(self.rotations, count)
        for name, value in (("times", times), ("positions", positions), ("jaw_deg", jaw_deg), ("rotations", rotations)):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.times)

    @property
    def duration(self) -> float:
        """Seconds from the first pose to the last."""
        return float(self.times[-1] - self.times[0])

    def at(self, time: float) -> TipPose:
        """The pose at ``time`` s: straight between poses, turning evenly (Slerp); outside, that of the nearest end."""
        if not np.isfinite(time):
            raise InputError(f"time: expected finite seconds, got {time}")
        if time <= self.times[0] or time >= self.times[-1]:
            end = 0 if time <= self.times[0] else -1
            return TipPose(self.positions[end], self.rotations[end], float(self.jaw_deg[end]))
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        part = float((time - self.times[k]) / (self.times[k + 1] - self.times[k]))
        position = self.positions[k] + part * (self.positions[k + 1] - self.positions[k])
        jaw = self.jaw_deg[k] + part * (self.jaw_deg[k + 1] - self.jaw_deg[k])
        turn, angle = self._turns[k], float(np.linalg.norm(self._turns[k]))
        rotation = self.rotations[k] if angle < 1e-12 else rotation_about(turn, part * angle) @ self.rotations[k]
        return TipPose(position, rotation, float(jaw))

    def resampled(self, times: ArrayLike) -> Trajectory:
        """The trajectory at other times (K,) s, rising; outside its own the pose of the nearest end."""
        wanted = np.asarray(times, dtype=np.float64)
        if wanted.ndim != 1 or not len(wanted) or not np.isfinite(wanted).all():
            raise InputError("time: expected finite seconds")
        tips = [self.at(float(time)) for time in wanted]
        positions, rotations = np.stack([tip.position for tip in tips]), np.stack([tip.rotation for tip in tips])
        return replace(
            self,
            times=wanted,
            positions=positions,
            rotations=rotations,
            jaw_deg=np.array([tip.jaw_deg for tip in tips]),
        )

    def in_metres(self, T_sim_scene: Similarity | None = None, T_sim_ct: Similarity | None = None) -> Trajectory:
        """The same in frame "m". T_sim_scene takes raw scene units, T_sim_ct mm RAS, to the simulation's metres.

        InputError if the frame's transform is missing. A stated metric unit is taken at its word, not as scene units.
        """
        if self.frame == "m":
            T_sim = Similarity.identity()
        else:
            given = T_sim_scene if self.frame == "scene" else T_sim_ct
            if given is None:
                raise InputError(f"trajectory: in frame {self.frame!r}, whose transform to the simulation is not given")
            T_sim = given
        positions = self.positions
        if self.unit != "scene":
            positions = positions * MM_PER_UNIT[self.unit] * (1.0 if self.frame == "ct" else 1e-3)
            if self.frame == "scene":  # metres along the scene's axes already
                T_sim = Similarity(1.0, T_sim.rotation, T_sim.translation)
        rotations = T_sim.rotation @ self.rotations
        return replace(self, positions=T_sim.apply(positions), rotations=rotations, frame="m", unit="m")

    @cached_property
    def _turns(self) -> Array:
        """Rotation vectors (T - 1, 3), rad, in the trajectory's axes, from each pose to the next."""
        turns: Array = Rotation.from_matrix(self.rotations[1:] @ self.rotations[:-1].transpose(0, 2, 1)).as_rotvec()
        return turns


def rotation_along(direction: Array, roll_deg: float) -> Array:
    """Rotation (3, 3) of a tool whose z is ``direction`` (3,), turned about it by ``roll_deg``.

    At roll 0 it is turned the shortest way from pointing along +z with its hinge along +x.
    """
    return rotations_along(np.asarray(direction, dtype=np.float64)[None], np.array([roll_deg]))[0]


def rotations_along(directions: Array, roll_deg: Array) -> Array:
    """The same (N, 3, 3) for directions (N, 3) and turns (N,): half a turn about +z, then one about the bisector."""
    z = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    bisector = z + np.array([0.0, 0.0, 1.0])
    length = np.linalg.norm(bisector, axis=1, keepdims=True)
    bisector = np.where(length < 1e-8, [0.0, 1.0, 0.0], bisector / np.maximum(length, 1e-8))  # along -z: any
    half_turn = 2 * bisector[:, :, None] * bisector[:, None, :] - np.eye(3)
    roll: Array = Rotation.from_rotvec(np.radians(roll_deg)[:, None] * z).as_matrix()
    return roll @ (half_turn * [-1.0, -1.0, 1.0])


def _column(values: ArrayLike, name: str, count: int) -> Array:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise InputError(f"trajectory {name}: expected {count} finite numbers, one per pose")
    return array


def _rotations(values: ArrayLike, count: int) -> Array:
    """Proper rotations, rounding of the input removed."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (count, 3, 3) or not np.isfinite(array).all():
        raise InputError(f"trajectory rotations: expected {count} finite matrices (3, 3), got shape {array.shape}")
    error = np.abs(array @ array.transpose(0, 2, 1) - np.eye(3)).max((1, 2))
    bad = (error > 1e-3) | (np.linalg.det(array) < 0)
    if bad.any():
        raise InputError(f"trajectory rotations: pose {int(bad.argmax()) + 1} is no proper rotation")
    u, _, vt = np.linalg.svd(array)
    out: Array = u @ vt
    return out
