"""The sample splat: Gaussians on the seen surface with noise, floaters and opaque outliers. mm, camera frame."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ..ground.checks import Array
from ..ground.frames import Similarity

WHITE_MM, SMOOTH_MM, SMOOTH_LENGTH_MM, SIDEWAYS_MM = 0.5, 0.7, 20.0, 0.2
FLOATER_SHARE, OUTLIER_SHARE = 0.22, 0.025


@dataclass(frozen=True)
class Gaussians:
    """Full Gaussians, N rows: centres (N, 3), standard deviations (N, 3) > 0 in the same unit, quaternions (N, 4)
    w x y z, colours (N, 3) and opacities (N,) in 0..1."""

    centres: Array
    deviations: Array
    quaternions: Array
    colours: Array
    opacities: Array

    def __len__(self) -> int:
        return len(self.centres)

    def moved(self, T_target_source: Similarity) -> Gaussians:
        """Centres and sizes in another frame; only the scale and translation of a similarity without rotation."""
        return Gaussians(
            T_target_source.apply(self.centres),
            T_target_source.scale * self.deviations,
            self.quaternions,
            self.colours,
            self.opacities,
        )


def sample_gaussians(points: Array, normals: Array, colours: Array, rng: np.random.Generator) -> Gaussians:
    """Gaussians in random order for seen surface points (N, 3) with unit normals (N, 3) and colours (N, 3)."""
    count = len(points)
    total = count / (1 - FLOATER_SHARE - OUTLIER_SHARE)
    parts = [
        _on_surface(points, normals, colours, rng),
        _floaters(points, int(FLOATER_SHARE * total), rng),
        _outliers(points, colours, int(OUTLIER_SHARE * total), rng),
    ]
    joined = {field.name: np.concatenate([getattr(p, field.name) for p in parts]) for field in fields(Gaussians)}
    order = rng.permutation(len(joined["centres"]))
    return Gaussians(**{name: values[order] for name, values in joined.items()})


def tissue_colours(points_ct: Array, points: Array, normals: Array, rng: np.random.Generator) -> Array:
    """Colours (N, 3) of wet tissue lit from the camera: mottled, darker where it turns away, with highlights."""
    mottle = _waves(points_ct, 9.0, rng) + 0.7 * _waves(points_ct, 28.0, rng)
    vessels = np.exp(-((_waves(points_ct, 35.0, rng) / 0.12) ** 2))[:, None]
    base = np.array([0.56, 0.20, 0.15]) * (1 + 0.10 * mottle[:, None]) * (1 - 0.28 * vessels * np.array([0.6, 1, 1]))
    distance = np.linalg.norm(points, axis=1)
    facing = np.clip(-np.einsum("ij,ij->i", points, normals) / distance, 0, 1)
    light = (np.percentile(distance, 10) / distance) ** 1.2 * (0.25 + 0.85 * facing)
    colours: Array = np.clip(base * light[:, None] + 0.55 * facing[:, None] ** 90, 0.01, 0.99)
    return colours


def _waves(points: Array, length_mm: float, rng: np.random.Generator, *, modes: int = 12) -> Array:
    """Smooth random function (N,) with unit variance that varies over ``length_mm``."""
    waves = rng.normal(size=(modes, 3)) * (1.5 / length_mm)
    result: Array = np.cos(points @ waves.T + rng.uniform(0, 2 * np.pi, modes)).sum(1) * np.sqrt(2 / modes)
    return result


def _on_surface(points: Array, normals: Array, colours: Array, rng: np.random.Generator) -> Gaussians:
    """Flat Gaussians with noise mostly along the viewing ray, as monocular depth has it."""
    count = len(points)
    ray = points / np.linalg.norm(points, axis=1, keepdims=True)
    along = WHITE_MM * rng.normal(size=count) + SMOOTH_MM * _waves(points, SMOOTH_LENGTH_MM, rng)
    centres = points + along[:, None] * ray + SIDEWAYS_MM * rng.normal(size=(count, 3))
    deviations = rng.lognormal(np.log([0.9, 0.9, 0.15]), 0.3, (count, 3))
    opacities = rng.beta(6, 1.5, count).clip(0.15, 0.995)
    speckled = (colours + rng.normal(0, 0.02, (count, 1))).clip(0, 1)
    return Gaussians(centres, deviations, _facing(normals, rng), speckled, opacities)


def _floaters(points: Array, count: int, rng: np.random.Generator) -> Gaussians:
    """Faint Gaussians strewn between the camera and behind the organ."""
    centres = points[rng.integers(len(points), size=count)] * rng.uniform(0.25, 1.25, (count, 1))
    centres = centres + rng.normal(0, 8, (count, 3))
    haze = rng.uniform(0.2, 0.6, (count, 1)) * np.array([1.0, 0.8, 0.75])
    deviations = rng.lognormal(np.log(2.5), 0.6, (count, 3))
    return Gaussians(centres, deviations, rng.normal(size=(count, 4)), haze, rng.uniform(0.004, 0.09, count))


def _outliers(points: Array, colours: Array, count: int, rng: np.random.Generator) -> Gaussians:
    """Opaque errors: clumps off the surface, and bleeding behind it along the ray."""
    source = rng.integers(len(points), size=count)
    clump = points[rng.integers(len(points), size=6)] * rng.uniform(0.75, 1.2, (6, 1))
    centres = clump[rng.integers(6, size=count)] + rng.normal(0, 3, (count, 3))
    bleeding = rng.random(count) < 0.5
    centres[bleeding] = (points[source] * rng.uniform(1.02, 1.25, (count, 1)))[bleeding]
    deviations = rng.lognormal(np.log(1.0), 0.4, (count, 3))
    return Gaussians(centres, deviations, rng.normal(size=(count, 4)), colours[source], rng.uniform(0.2, 0.95, count))


def _facing(normals: Array, rng: np.random.Generator) -> Array:
    """Quaternions (N, 4), w x y z and not normalised, that turn the third axis onto the unit normals (N, 3)."""
    half = normals + np.array([0.0, 0.0, 1.0])
    flipped = np.linalg.norm(half, axis=1) < 1e-6
    half[flipped] = [1.0, 0.0, 0.0]  # half a turn about x
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    w = np.where(flipped, 0.0, half[:, 2])
    x, y = np.where(flipped, 1.0, -half[:, 1]), np.where(flipped, 0.0, half[:, 0])
    return np.stack([w, x, y, np.zeros(len(w))], 1) * rng.lognormal(0, 0.4, (len(w), 1))
