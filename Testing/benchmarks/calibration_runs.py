"""Registrations for the calibration of the error radii: what each says of its precision, and how far it is off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from case_inputs import CaseInputs, read_case

from organphys.basis.error_radius import error_radius
from organphys.elastic.elastic_registration import ElasticState
from organphys.elastic.posterior import PosteriorConstants, PosteriorTerms, posterior_terms
from organphys.ground.progress import no_progress
from organphys.pipeline.default_method import DefaultMethod
from organphys.pipeline.evaluation import errors_mm
from organphys.pipeline.sample_case import write_sample_case
from organphys.pipeline.scale_checks import scale_percent


@dataclass(frozen=True)
class Run:
    """One registration: terms of its precision, and for the truth's points (N,): phi (N, 4H), mapped (N, 3) normalised,
    region (0 visible, 1 hidden, 2 interior) and error_mm; length_mm: of the normalisation."""

    case: str
    seed: int
    unit: bool
    data: np.ndarray
    energy: np.ndarray
    scale: float
    phi: np.ndarray
    mapped: np.ndarray
    region: np.ndarray
    error_mm: np.ndarray
    length_mm: float

    def radii(self, constants: PosteriorConstants, probabilities: Sequence[float]) -> np.ndarray:
        """Error radii (P, N) in mm."""
        terms = PosteriorTerms(self.data, self.energy, float(self.scale))
        covariance = self.length_mm**2 * terms.covariance(constants).at(self.phi, self.mapped)
        return np.array([error_radius(covariance, p, freedom=constants.freedom) for p in probabilities])


def runs_of(folder: Path, seeds: Sequence[int], samples: int, cache: Path) -> Iterator[Run]:
    """Every case with every seed, without and with the unit; then sample cases, once each, without the unit."""
    cache.mkdir(parents=True, exist_ok=True)
    for path in sorted(path.parent for path in folder.glob("*/case.json")):
        yield from _runs(path, path.name, seeds, (False, True), cache)
    for number in range(1, samples + 1):
        path = cache / f"sample_{number}"
        if not (path / "case.json").exists():
            path.mkdir(exist_ok=True)
            write_sample_case(path, seed=number)
        yield from _runs(path, path.name, (0,), (False,), cache)


def _runs(folder: Path, name: str, seeds: Sequence[int], units: Sequence[bool], cache: Path) -> Iterator[Run]:
    """Those of one case; what is in ``cache`` already is not run again."""
    inputs = None
    for seed in seeds:
        for unit in units:
            stored = cache / f"{name}_{seed}_{'unit' if unit else 'free'}.npz"
            if stored.exists():
                with np.load(stored) as values:
                    yield Run(**{key: _plain(values[key]) for key in values.files})
                continue
            inputs = inputs or read_case(folder)
            run = _run(inputs, name, seed, unit)
            np.savez(stored, **{field.name: getattr(run, field.name) for field in fields(run)})
            print(f"{name} seed {seed}{' unit' if unit else ''}: {run.error_mm.mean():.2f} mm", flush=True)
            yield run


def _run(inputs: CaseInputs, name: str, seed: int, unit: bool) -> Run:
    method = DefaultMethod(inputs.case(seed=seed, unit=unit))
    coarse = method.coarse(no_progress)
    result = method.elastic(coarse, method.rigid(coarse, None, no_progress), None, no_progress).result
    pose = method.view.T_camera_scene @ result.T_scene_ct @ result.normalisation.T_ct_normalised
    state = ElasticState(result.z, 1.0, pose)
    percent = None if method.case.unit is None else scale_percent(method.case.unit)
    terms = posterior_terms(method.organ, method.view, state, scale_percent=percent)
    truth, x = inputs.truth, result.normalisation.apply(inputs.truth.points_ct)
    phi = result.basis.phi(x)
    error = errors_mm(truth, result.map_points(truth.points_ct))
    return Run(
        name, seed, unit, terms.data, terms.energy, terms.scale, phi, x + phi @ result.z, truth.region, error,
        result.normalisation.length,
    )  # fmt: skip


def _plain(value: np.ndarray) -> object:
    return value if value.ndim else value.item()
