"""Ways to make a case harder: each takes the inputs of a case and a random generator, and gives worse inputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from case_inputs import CaseInputs

from organphys.points.point_sets import Camera, GaussianCloud, Landmarks

Stress = Callable[[CaseInputs, np.random.Generator], CaseInputs]


def camera_off(case: CaseInputs, rng: np.random.Generator) -> CaseInputs:
    """The camera is stated 15 % of the depth beside its true place, in a random direction across the view."""
    depth = float(np.median(_opaque(case.splat)[:, 2]))
    angle = rng.uniform(0, 2 * np.pi)
    return replace(case, camera=Camera(0.15 * depth * np.array([np.cos(angle), np.sin(angle), 0.0])))


def outliers(case: CaseInputs, rng: np.random.Generator, *, share: float = 0.2) -> CaseInputs:
    """A ``share`` more opaque Gaussians, spread over the bounding box of the opaque ones."""
    opaque = _opaque(case.splat)
    low, high = np.quantile(opaque, [0.01, 0.99], axis=0)
    return _with_splat(case, np.concatenate([opaque, rng.uniform(low, high, (round(share * len(opaque)), 3))]))


def noise(case: CaseInputs, rng: np.random.Generator, *, sd_mm: float = 0.6) -> CaseInputs:
    """White noise of ``sd_mm`` along the rays and as high waves of 14 mm length on top of the splat's own noise."""
    opaque = _opaque(case.splat)
    mm = opaque * case.truth.mm_per_unit
    waves = np.cos(mm @ (rng.normal(size=(3, 100)) / 14) + rng.uniform(0, 2 * np.pi, 100)).sum(1) * np.sqrt(2 / 100)
    along = sd_mm * (waves + rng.normal(size=len(mm))) / case.truth.mm_per_unit
    return _with_splat(case, opaque + along[:, None] * opaque / np.linalg.norm(opaque, axis=1, keepdims=True))


def few(case: CaseInputs, rng: np.random.Generator) -> CaseInputs:
    """5000 of the opaque Gaussians."""
    opaque = _opaque(case.splat)
    return _with_splat(case, opaque[rng.choice(len(opaque), min(5000, len(opaque)), replace=False)])


def half_seen(case: CaseInputs, rng: np.random.Generator) -> CaseInputs:
    """The half of the splat on one side of a plane through its middle, along the view: 7 to 21 % of the surfaces."""
    opaque = _opaque(case.splat)
    plane = opaque[:, :2] / opaque[:, 2:]
    angle = rng.uniform(0, 2 * np.pi)
    side = (plane - np.median(plane, axis=0)) @ np.array([np.cos(angle), np.sin(angle)])
    return _with_splat(case, opaque[side > 0])


def seen(case: CaseInputs, rng: np.random.Generator, *, share: float) -> CaseInputs:
    """So much cut off, beyond a plane along the view, that a ``share`` of the organ's surface is left seen (what the
    truth calls visible); a case that shows less stays as it is."""
    truth, angle = case.truth, rng.uniform(0, 2 * np.pi)
    along = np.array([np.cos(angle), np.sin(angle)])
    surface = truth.region < 2
    visible = truth.points_scene[truth.region == 0]
    kept = share * surface.sum() / len(visible)
    if kept >= 1:
        return case
    opaque = _opaque(case.splat)
    edge = np.quantile(visible[:, :2] / visible[:, 2:] @ along, 1 - kept)
    return _with_splat(case, opaque[opaque[:, :2] / opaque[:, 2:] @ along > edge])


def pinched(case: CaseInputs, rng: np.random.Generator) -> CaseInputs:
    """Tissue within 12 mm of a place is pulled 10 mm towards the camera, as by an instrument."""
    opaque, mm = _opaque(case.splat), case.truth.mm_per_unit
    middle = np.argmin(((opaque - np.median(opaque, axis=0)) ** 2).sum(1) + rng.uniform(0, (20 / mm) ** 2, len(opaque)))
    near = np.clip(1 - (np.linalg.norm(opaque - opaque[middle], axis=1) * mm / 12) ** 2, 0, None)
    pull = (10 / mm) * near[:, None] * opaque / np.linalg.norm(opaque, axis=1, keepdims=True)
    return _with_splat(case, opaque - pull)


def landmarks_off(case: CaseInputs, rng: np.random.Generator, *, distance_mm: float = 10.0) -> CaseInputs:
    """Landmarks ``distance_mm`` from where they were, snapped to the organ's surface."""
    if case.landmarks is None:
        return case
    moved = rng.normal(size=case.landmarks.positions.shape)
    moved = case.landmarks.positions + distance_mm * moved / np.linalg.norm(moved, axis=1, keepdims=True)
    nearest = np.linalg.norm(case.organ.vertices[None] - moved[:, None], axis=2).argmin(1)
    return replace(case, landmarks=Landmarks(case.organ.vertices[nearest]))


def no_region(case: CaseInputs, rng: np.random.Generator) -> CaseInputs:
    """Without the crop box (a change for cluttered scenes only)."""
    return replace(case, box=None)


STRESSES: dict[str, Stress] = {
    "camera off 15 %": camera_off,
    "20 % outliers": outliers,
    "more noise": noise,
    "5000 Gaussians": few,
    "25 % seen": partial(seen, share=0.25),
    "20 % seen": partial(seen, share=0.20),
    "15 % seen": partial(seen, share=0.15),
    "half seen": half_seen,
    "pinched": pinched,
    "landmarks off 10 mm": landmarks_off,
    "no region": no_region,
}


def _opaque(splat: GaussianCloud) -> np.ndarray:
    return np.asarray(splat.centres[splat.valid & (splat.opacities > 0.1)], dtype=np.float64)


def _with_splat(case: CaseInputs, centres: np.ndarray) -> CaseInputs:
    count = len(centres)
    splat = GaussianCloud(centres, np.full(count, 0.9), np.full((count, 3), 0.5), np.ones(count, dtype=bool))
    return replace(case, splat=splat)
