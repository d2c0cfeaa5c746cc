"""What the sample camera sees: a pinhole camera at the origin of the scene, looking along +z (OpenCV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..ground.checks import Array
from ..ground.frames import Similarity, rotation_about

FOV_DEG = 70.0
FRONT_CT = np.array([0.15, 0.86, -0.48])  # from the organ towards the camera: from the front, a little from below


@dataclass(frozen=True)
class Sight:
    """Depth image (rows, columns) in mm of the visible surface, and the tool that hides a strip of it.

    A point projects to ``x / z``; pixel = floor((x / z + reach) / pixel).
    """

    depth: Array
    pixel: float
    reach: float
    tool_from: Array
    tool_to: Array
    tool_half_width: float

    def visible(self, points: Array, normals: Array, *, slack_mm: float = 2.0) -> NDArray[np.bool_]:
        """(N,) bool: which surface points (N, 3), mm in the camera frame, are seen."""
        image, inside = self._project(points)
        row, column = np.where(inside[:, None], self._cell(image), 0).T
        ray = points / np.linalg.norm(points, axis=1, keepdims=True)
        cosine = -np.einsum("ij,ij->i", ray, normals)
        steepness = np.sqrt(1 - cosine**2) / np.maximum(cosine, 0.02)
        allowed = slack_mm + 2 * self.pixel * points[:, 2] * steepness  # depth changes that much within two pixels
        near = points[:, 2] < self.depth[row, column] + allowed
        seen: NDArray[np.bool_] = inside & (cosine > 0.1) & near & ~self.behind_tool(image)
        return seen

    def behind_tool(self, image: Array) -> NDArray[np.bool_]:
        """(N,) bool: which image points (N, 2) lie behind the tool, a strip from the rim to a tip."""
        along = self.tool_to - self.tool_from
        offset = image - self.tool_from
        share = np.clip(offset @ along / (along @ along), 0, 1)
        hidden: NDArray[np.bool_] = np.linalg.norm(offset - share[:, None] * along, axis=1) < self.tool_half_width
        return hidden

    def _project(self, points: Array) -> tuple[Array, NDArray[np.bool_]]:
        image = points[:, :2] / points[:, 2:]
        return image, np.linalg.norm(image, axis=1) < np.tan(np.radians(FOV_DEG / 2))

    def _cell(self, image: Array) -> NDArray[np.int64]:
        index: NDArray[np.int64] = np.floor((image + self.reach) / self.pixel).astype(np.int64)
        return index


def camera_pose(centre: Array, distance_mm: float, rng: np.random.Generator) -> Similarity:
    """T_camera_ct, rigid, mm: the organ's ``centre`` (3,) near the axis at ``distance_mm``, tilted and rolled."""
    z = -FRONT_CT / np.linalg.norm(FRONT_CT)
    x = np.cross(z, np.array([0.0, 0.0, 1.0]))  # right of the image, with the patient's head up
    x /= np.linalg.norm(x)
    upright = np.stack([x, np.cross(z, x), z])
    tilt = rotation_about(rng.normal(size=3), np.radians(rng.uniform(5, 12)))
    roll = rotation_about(np.array([0.0, 0.0, 1.0]), np.radians(rng.uniform(-40, 40)))
    rotation = roll @ tilt @ upright
    target = np.append(rng.uniform(-10, 10, 2), distance_mm)
    return Similarity(1.0, rotation, target - rotation @ centre)


def look(points: Array, *, pixel_mm: float, rng: np.random.Generator) -> Sight:
    """The depth image of a densely sampled surface (N, 3), mm in the camera frame."""
    middle = float(np.median(points[:, 2]))
    pixel, reach = pixel_mm / middle, float(np.tan(np.radians(FOV_DEG / 2)))
    width = int(np.ceil(2 * reach / pixel)) + 1
    image = points[:, :2] / points[:, 2:]
    index = np.floor((image + reach) / pixel).astype(np.int64)
    inside = ((index >= 0) & (index < width)).all(1)
    depth = np.full((width, width), np.inf)
    np.minimum.at(depth, tuple(index[inside].T), points[inside, 2])
    depth = ndimage.minimum_filter(depth, size=3)  # closes the gaps between the samples
    angle = rng.uniform(0, 2 * np.pi)
    start = reach * np.array([np.cos(angle), np.sin(angle)])
    return Sight(depth, pixel, reach, start, 0.25 * rng.uniform(-1, 1, 2) * reach, 4.5 / middle)
