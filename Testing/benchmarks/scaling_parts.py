"""Basis and elastic fit of the sample organ at another number of surface points, handles or quadrature points.

    python Testing/benchmarks/scaling_parts.py {surface,handles,quadrature} N SAMPLE_FOLDER

Prints processor time, wall time and peak memory of each part as JSON. Run by scaling.py, one process a number.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from stage_meter import StageMeter

from organphys.basis.reduced_covariance import ReducedCovariance
from organphys.elastic.elastic_registration import ElasticLevel, ElasticOptions, register_elastically
from organphys.elastic.reduced_organ import ReducedOrganOptions, reduce_organ
from organphys.ground.frames import Similarity
from organphys.pipeline.case import Case
from organphys.pipeline.default_method import DefaultMethod
from organphys.pipeline.processor import one_blas_thread
from organphys.points.surface_samples import sample_surface
from organphys.readers.gaussian_ply import read_splat
from organphys.readers.segmentation_file import read_organ

OUTER_STEPS = 4
MAPPED = 50_000


@one_blas_thread
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("axis", choices=("surface", "handles", "quadrature"))
    parser.add_argument("value", type=int)
    parser.add_argument("sample", type=Path)
    options = parser.parse_args()
    meter = StageMeter()
    method = DefaultMethod(
        Case.of(read_organ(options.sample / "ct_labels.nii.gz", organ="5"), read_splat(options.sample / "splat.ply"))
    )
    facts = measure(method, options.axis, options.value, true_pose(method, options.sample), meter)
    print(json.dumps({"facts": facts, "stages": meter.stages}))


def measure(method: DefaultMethod, axis: str, value: int, start: Similarity, meter: StageMeter) -> dict[str, float]:
    """The parts that depend on ``axis``, at ``value`` of it; all else as the method has it."""
    organ, view = method.case.organ, method.view
    with meter.stage("surface samples"):
        samples = sample_surface(organ, count=value) if axis == "surface" else sample_surface(organ)
    with meter.stage("closest-sample grid"):
        samples.grid  # noqa: B018 made on first use
    chosen = {"handles": "handles", "quadrature": "quadrature"}.get(axis)
    basis_options = replace(ReducedOrganOptions(), **({chosen: value} if chosen else {}))
    with meter.stage("basis"):
        reduced = reduce_organ(organ, samples, options=basis_options)
    level = ElasticLevel(alpha=0.04, tau=0.12, steps=OUTER_STEPS)
    elastic = ElasticOptions(levels=(level,), move_tolerance=0.0)
    with meter.stage(f"{OUTER_STEPS} elastic steps"):
        state, report = register_elastically(reduced, view, start, options=elastic)
    points = samples.normalisation.apply(organ.volume_points[:MAPPED])
    with meter.stage(f"map {MAPPED} points"):
        reduced.basis.displacement_and_gradient(state.z, points)
    covariance = ReducedCovariance(np.eye(3 * reduced.basis.size + 1))
    with meter.stage(f"error radii of {MAPPED} points"):
        phi = reduced.basis.phi(points)
        covariance.at(phi, points)
    return {"samples": len(samples.points), "handles": basis_options.handles, "evaluations": report.evaluations}


def true_pose(method: DefaultMethod, sample: Path) -> Similarity:
    """T_camera_normalised of the best similarity of the true points."""
    matrix = np.load(sample / "truth.npz")["similarity"]
    scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
    return method.camera_pose(Similarity(scale, matrix[:3, :3] / scale, matrix[:3, 3]))


if __name__ == "__main__":
    main()
