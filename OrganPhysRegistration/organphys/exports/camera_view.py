"""Pinhole view of a picture: where scene points land on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array
from ..ground.frames import rotation_about


@dataclass(frozen=True)
class View:
    """Camera at ``position`` looking at ``target`` (3,), ``down`` (3,) pointing down the picture (OpenCV axes).

    focal: pixels per unit of tangent; width, height in pixels. Any one unit of length.
    """

    position: Array
    target: Array
    down: Array
    focal: float
    width: int
    height: int

    @property
    def axes(self) -> Array:
        """Rows: picture right, picture down, forward (3, 3)."""
        forward = _unit(self.target - self.position)
        down = self.down - (self.down @ forward) * forward
        if np.linalg.norm(down) < 1e-6 * np.linalg.norm(self.down):
            down = np.cross(forward, np.eye(3)[np.argmin(np.abs(forward))])
        down = _unit(down)
        return np.stack([np.cross(down, forward), down, forward])

    @property
    def distance(self) -> float:
        """From the camera to the target."""
        return float(np.linalg.norm(self.target - self.position))

    def project(self, points: Array) -> Array:
        """Pixel x, pixel y and depth (N, 3) of the points (N, 3); pixel centres lie at whole numbers plus 0.5."""
        local = (points - self.position) @ self.axes.T
        depth = np.where(local[:, 2] > 1e-9 * self.distance, local[:, 2], np.nan)
        centre = np.array([self.width / 2, self.height / 2])
        return np.column_stack([self.focal * local[:, :2] / depth[:, None] + centre, depth])

    def scaled(self, factor: int) -> View:
        """The same picture with ``factor`` times the pixels along each side."""
        return View(
            self.position, self.target, self.down, factor * self.focal, factor * self.width, factor * self.height
        )

    def turned(self, axis: int, degrees: float) -> View:
        """The view from a camera carried round the target about the picture's axis 0 (right) or 1 (down)."""
        turn = rotation_about(self.axes[axis], np.deg2rad(degrees))
        position = self.target + turn @ (self.position - self.target)
        return View(position, self.target, turn @ self.axes[1], self.focal, self.width, self.height)

    def fitted(self, points: Array, *, fill: float = 0.9) -> View:
        """The same direction with target and focal length such that the points (N, 3) fill the picture."""
        centre = self._centre_of(points)
        moved = View(self.position, centre, self.down, 1.0, 0, 0)
        spread = moved.project(points)[:, :2]
        half = np.nanmax(np.abs(spread), axis=0)
        focal = fill * min(self.width / 2 / max(half[0], 1e-9), self.height / 2 / max(half[1], 1e-9))
        return View(self.position, centre, self.down, float(focal), self.width, self.height)

    def _centre_of(self, points: Array) -> Array:
        """Point in the middle of the picture of the points, at their mean depth."""
        rough = View(self.position, self.target, self.down, 1.0, 0, 0)
        picture = rough.project(points)
        middle = (np.nanmin(picture[:, :2], axis=0) + np.nanmax(picture[:, :2], axis=0)) / 2
        depth = float(np.nanmean(picture[:, 2]))
        centre: Array = self.position + depth * (np.array([*middle, 1.0]) @ rough.axes)
        return centre


def parallel_view(points: Array, towards_viewer: Array, down: Array, width: int, height: int) -> View:
    """Nearly parallel projection (camera very far away) of the points, seen from direction ``towards_viewer`` (3,)."""
    centre = points.mean(0)
    size = float(np.linalg.norm(points - centre, axis=1).max())
    position = centre + 200 * size * _unit(towards_viewer)
    return View(position, centre, down, 1.0, width, height).fitted(points, fill=0.8)


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)
