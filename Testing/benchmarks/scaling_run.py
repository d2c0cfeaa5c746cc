"""One registration taken apart: prints processor time, wall time and peak memory of every stage as JSON.

    python Testing/benchmarks/scaling_run.py labels.nii.gz splat.ply [--grids] [--follow]

What `organphys register` does, in its order and by the same functions; with --grids the displacement grids, with
--follow the splat bound to the organ, moved and written as well. Run by scaling.py, one process a case.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
from stage_meter import StageMeter

from organphys.asset.asset_file import load_asset, save_asset
from organphys.exports.displacement_grid import sample_displacement
from organphys.exports.report import write_report
from organphys.exports.splat_frames import FollowingSplat
from organphys.exports.surface_vtp import write_surface_vtp
from organphys.ground.progress import no_progress
from organphys.pipeline.case import Case
from organphys.pipeline.case_state import CaseState
from organphys.pipeline.default_method import DefaultMethod
from organphys.pipeline.organ_in_scene import organ_in_scene
from organphys.pipeline.processor import one_blas_thread
from organphys.pipeline.provenance import fingerprint
from organphys.pipeline.registration import Registration
from organphys.pipeline.write_outputs import report_content
from organphys.readers.gaussian_ply import read_gaussians, read_splat
from organphys.readers.segmentation_file import read_organ
from organphys.simulation.organ_body import metres_per_unit, organ_body
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("labels")
    parser.add_argument("splat")
    parser.add_argument("--grids", action="store_true")
    parser.add_argument("--follow", action="store_true")
    options = parser.parse_args()
    meter, facts = StageMeter(), {}
    with tempfile.TemporaryDirectory() as folder:
        registration = registered(options.labels, options.splat, meter, facts)
        written(registration, Path(folder), meter)
        if options.grids:
            with meter.stage("displacement grids"):
                sample_displacement(load_asset(Path(folder) / "organ.organphys"))
        if options.follow:
            follow(Path(folder), options.splat, meter)
    print(json.dumps({"facts": facts, "stages": meter.stages}))


@one_blas_thread
def registered(labels: str, splat_file: str, meter: StageMeter, facts: dict) -> Registration:
    """The registration, stage by stage."""
    with meter.stage("read splat"):
        splat = read_splat(splat_file)
    with meter.stage("read label map"):
        organ = read_organ(labels, organ="5")
    with meter.stage("hash inputs"):
        fingerprint(labels), fingerprint(splat_file)
    with meter.stage("select"):
        case = Case.of(organ, splat)
    with meter.stage("organ in scene"):
        case = organ_in_scene(case, no_progress)
    method = DefaultMethod(case)
    with meter.stage("surface samples"):
        method.samples.grid  # noqa: B018 both are made on first use
    with meter.stage("splat view"):
        method.view.tree  # noqa: B018
    with meter.stage("basis"):
        method.rough_organ, method.organ  # noqa: B018
    with meter.stage("start search"):
        coarse = method.coarse(no_progress)
    with meter.stage("rigid"):
        rigid = method.rigid(coarse, None, no_progress)
    with meter.stage("elastic"):
        elastic = method.elastic(coarse, rigid, None, no_progress)
    with meter.stage("metrics"):
        state = CaseState(case).followed_by({"coarse": coarse, "rigid": rigid, "elastic": elastic})
        registration = state.registration
    facts.update(
        gaussians=len(splat), opaque=len(case.scene.centres), organ_voxels=len(organ.volume_points),
        vertices=len(organ.vertices), splat_mb=Path(splat_file).stat().st_size / 1e6,
        checksum=float(np.abs(registration.organ.scene_vertices).sum()),
    )  # fmt: skip
    return registration


@one_blas_thread
def written(registration: Registration, folder: Path, meter: StageMeter) -> None:
    """The files."""
    with meter.stage("write asset"):
        save_asset(registration.organ, folder / "organ.organphys")
    with meter.stage("write surface"):
        write_surface_vtp(folder / "surface.vtp", registration.organ, registration.vertex_distance_mm)
    with meter.stage("write report"):
        write_report(folder / "report.html", report_content(registration))


@one_blas_thread
def follow(folder: Path, splat_file: str, meter: StageMeter) -> None:
    """The splat on the simulated organ: bound, moved and written, as `organphys export` does for one moment."""
    organ = load_asset(folder / "organ.organphys")
    with meter.stage("read all of the splat"):
        gaussians = read_gaussians(splat_file)
    with meter.stage("simulated body"):
        body = organ_body(organ)
    with meter.stage("bind splat"):
        splat = FollowingSplat(gaussians, body, metres_per_unit(organ), once=True)
    scene = Scene((body,), ())
    moment = Simulation(scene, scene.initial_state()).snapshot
    with meter.stage("move and write splat"):
        splat.write(folder / "moved.ply", moment)


if __name__ == "__main__":
    main()
