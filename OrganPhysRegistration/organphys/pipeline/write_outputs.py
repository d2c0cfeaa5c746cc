"""The files of one registration: asset, JSON, surface and report."""

from __future__ import annotations

import os
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..asset.asset_file import save_asset
from ..exports.registration_json import write_registration_json
from ..exports.report import write_report
from ..exports.report_content import PictureStrip, ReportContent, ReportTable, StagePicture
from ..exports.surface_vtp import write_surface_vtp
from .processor import one_blas_thread, peak_memory_mb
from .registration import Registration

ASSET, JSON, SURFACE, REPORT = "organ.organphys", "registration.json", "surface.vtp", "report.html"
STAGES = ("before", "coarse", "rigid", "elastic")


@one_blas_thread
def write_outputs(
    registration: Registration,
    folder: str | os.PathLike[str],
    *,
    extra_tables: tuple[ReportTable, ...] = (),
    extra_strips: tuple[PictureStrip, ...] = (),
) -> None:
    """Write the four files into an existing folder, each atomically; the JSON last, with the time of the others."""
    start, folder = perf_counter(), Path(folder)
    save_asset(registration.organ, folder / ASSET)
    write_surface_vtp(folder / SURFACE, registration.organ, registration.vertex_distance_mm)
    write_report(folder / REPORT, report_content(registration, extra_tables, extra_strips))
    end = perf_counter()
    read = registration.seconds.get("read", 0.0)
    seconds = {**registration.seconds, "report": end - start, "total": read + end - registration.began}
    write_registration_json(
        folder / JSON,
        method=registration.options.method,
        scale_scene_per_mm=registration.organ.T_scene_ct.scale,
        seconds=seconds,
        peak_memory_mb=peak_memory_mb(),
        metrics=registration.metrics,
        stops=registration.stops,
        warnings=registration.notices,
        extra=_table_2_and_figure_8(registration),
    )


def _table_2_and_figure_8(registration: Registration) -> dict[str, Any]:
    """Further entries of the JSON: verdict and evidence, T_scene_ct per stage, point counts and time per elastic step,
    the elastic curves."""
    steps = registration.steps
    return {
        "verdict": None if registration.verdict is None else registration.verdict.as_dict(),
        "evidence": None if registration.evidence is None else vars(registration.evidence),
        "similarities": {name: T.matrix.tolist() for name, T in registration.similarities.items()},
        "runner_up": None if registration.runner_up is None else registration.runner_up.matrix.tolist(),
        "points": {"ct_surface": len(registration.organ.vertices), "splat_target": len(registration.target)},
        "seconds_per_elastic_step": registration.seconds["elastic"] / max(len(steps), 1),
        "elastic_steps": [vars(step) for step in steps],
    }


def report_content(
    registration: Registration,
    extra_tables: tuple[ReportTable, ...] = (),
    extra_strips: tuple[PictureStrip, ...] = (),
) -> ReportContent:
    """What the report shows of a registration."""
    organ, distance = registration.organ, registration.vertex_distance_mm
    to_ct = cKDTree(organ.scene_vertices).query(registration.target)[0] * organ.mm_per_unit
    return ReportContent(
        title=f"{organ.name} registered to the splat",
        faces=organ.faces,
        vertices_ct=organ.vertices,
        stages=[
            StagePicture(name, registration.stage_points(name), distance if name == "elastic" else None)
            for name in STAGES
        ],
        splat_centres=registration.splat_points.astype(np.float64),
        splat_colours=registration.splat_colours.astype(np.float64),
        mm_per_unit=organ.mm_per_unit,
        camera=registration.camera,
        method=registration.options.method,
        notices=registration.notices,
        verdict=registration.verdict,
        errors_mm=None if organ.uncertainty is None else organ.surface_error_mm(0.95),
        highlights=_highlights(registration),
        inputs=list(registration.facts.items()),
        metrics=registration.metrics,
        seconds=registration.seconds,
        stops=registration.stops,
        coarse=registration.coarse_view,
        steps=registration.steps,
        splat_to_ct_mm=to_ct,
        ct_visible_to_splat_mm=distance[registration.vertex_seen],
        provenance=organ.provenance,
        extra_tables=extra_tables,
        extra_strips=extra_strips,
    )


def _highlights(registration: Registration) -> list[tuple[str, str]]:
    elastic = registration.metrics["elastic"]
    number = {name: float(entry["value"]) for name, entry in elastic.items()}
    errors = [
        (f"95 % error radius, {region}", f"{number[name]:.1f} mm")
        for region, name in (("seen surface", "error_95_visible"), ("unseen surface", "error_95_hidden"))
        if name in number
    ]
    return [
        *errors,
        ("splat to organ, nearest 70 %", f"{number['trim30_splat_to_ct']:.2f} mm"),
        ("organ volume in the CT", f"{registration.organ.volume_ml:.4g} ml"),
        ("scale", f"{registration.organ.mm_per_unit:.4g} mm per scene unit"),
        ("volume drift", f"{number['volume_drift']:+.2f} %"),
        ("smallest det F", f"{number['min_det_F']:.2f}"),
    ]
