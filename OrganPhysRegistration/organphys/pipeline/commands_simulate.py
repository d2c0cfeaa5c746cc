"""organphys simulate: a registered organ under an instrument, from the asset alone."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..asset.asset_file import load_asset
from ..asset.registered_organ import RegisteredOrgan
from ..exports.animation import ffmpeg
from ..exports.splat_frames import FollowingSplat, frame_name
from ..ground.checks import Array, InputError
from ..ground.progress import Progress
from ..readers.gaussian_ply import read_gaussians
from ..readers.trajectory_file import read_trajectory
from ..simulation.body import Body
from ..simulation.instruments import instrument_named
from ..simulation.local_detail import LocalDetail
from ..simulation.options import SimulationOptions, gravity_along
from ..simulation.organ_body import metres_per_unit, scene_direction
from ..simulation.psm import Psm, default_trocar
from ..simulation.psm_trocar import trocar_at
from .default_grasp import default_grasp, far_side_pin
from .output_folder import whole_or_nothing
from .processor import one_blas_thread
from .simulated_organ import body_from_options, camera_of
from .simulation_outputs import STRIP, notices_of, write_simulation
from .simulation_plan import SimulationPlan, simulation_plan, step_count
from .simulation_run import SimulationLog, Step, run_plan
from .simulation_view import SimulationView
from .terminal_progress import shown_progress


@one_blas_thread
def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for what cannot be used."""
    every = arguments.splat_frames
    if every is not None and (arguments.splat is None or every < 1):
        raise InputError("--splat-frames: expected a number of at least 1, together with --splat FILE")
    if arguments.video == "mp4":
        ffmpeg()  # told before the work, not after it
    with shown_progress(quiet=arguments.quiet) as progress, whole_or_nothing(arguments.out) as folder:
        plan, splat = prepared(arguments, progress)
        view = SimulationView(plan, splat, video=arguments.video is not None, renderer=arguments.renderer)

        def watch(step: Step) -> None:
            view.watch(step)
            if splat is not None and every is not None and step.number % every == 0:
                splat.write(frame_name(folder / "splat", step.number), step.moment)

        log, recording = run_plan(plan, watch, progress=progress)
        progress("write the results", 0.0)
        write_simulation(folder, plan, log, recording, view, arguments.video)
    if not arguments.quiet:
        print(told(plan, log, arguments.out))


def prepared(arguments: argparse.Namespace, progress: Progress) -> tuple[SimulationPlan, FollowingSplat | None]:
    """The plan and the splat that follows. The small files come first: their errors are found at once."""
    options, device = SimulationOptions(), device_of(arguments)
    organ = load_asset(arguments.asset)
    trajectory = None if arguments.trajectory is None else read_trajectory(arguments.trajectory)
    if trajectory is not None:
        step_count(trajectory, arguments.fps)
    if arguments.gravity is not None:
        down = scene_direction(organ, direction_of(arguments.gravity))
        options = SimulationOptions(gravity=gravity_along(down))
    gaussians = None if arguments.splat is None else read_gaussians(arguments.splat, progress=progress)
    progress("build the reduced model", 0.0)
    camera = camera_of(organ) * metres_per_unit(organ)
    body = body_from_options(organ, arguments, otherwise=() if trajectory else (far_side_pin(organ, camera),))
    psm = arm_over(body, arguments.instrument, camera, trocar=trocar_of(organ, arguments.trocar))
    trajectory = default_grasp(body, camera, psm.rcm) if trajectory is None else trajectory
    detail = LocalDetail() if arguments.detail else None
    plan = simulation_plan(organ, body, psm, trajectory, fps=arguments.fps, options=options, detail=detail)
    if gaussians is None:
        return plan, None
    progress("bind the splat", 0.0)
    return plan, FollowingSplat(
        gaussians, body, metres_per_unit(organ), device=device, distance=1e-3 * arguments.follow_mm
    )


def device_of(arguments: argparse.Namespace) -> str | None:
    """The GPU that moves the splat, None without one; InputError where it is missing or has nothing to move."""
    if arguments.device == "cpu":
        return None
    if arguments.splat is None:
        raise InputError("--device cuda: it moves the splat that follows the organ; name one with --splat")
    from ..simulation.splat_warp import check_device

    check_device(arguments.device)
    return str(arguments.device)


def arm_over(body: Body, instrument: str, camera: Array, *, trocar: Array | None = None) -> Psm:
    """The arm with its trocar there (3,) m; None: beside the camera, the organ's middle well within its reach."""
    row, vertices = instrument_named(instrument), body.samples.vertices
    if trocar is not None:
        return Psm(row, trocar_at(trocar, vertices, instrument=row))
    return Psm(row, default_trocar(vertices, camera=camera, instrument=row))


def trocar_of(organ: RegisteredOrgan, text: str | None) -> Array | None:
    """``X,Y,Z`` in CT RAS mm as a place (3,) of the simulation's scene, m."""
    if text is None:
        return None
    numbers = numbers_of(text)
    if numbers is None:
        raise InputError(f"--trocar: expected a place X,Y,Z in CT RAS mm, say 20,80,150, got {text!r}")
    place: Array = metres_per_unit(organ) * organ.T_scene_ct.apply(numbers)
    return place


def direction_of(text: str) -> Array:
    """``X,Y,Z`` as a direction (3,)."""
    values = numbers_of(text)
    if values is None or not values.any():
        raise InputError(f"--gravity: expected a direction X,Y,Z in CT axes, say 0,-1,0, got {text!r}")
    return values


def numbers_of(text: str) -> Array | None:
    """``X,Y,Z`` as numbers (3,); None if it is nothing of the kind."""
    try:
        values = np.array([float(part) for part in text.split(",")])
    except ValueError:
        return None
    return values if values.shape == (3,) and np.isfinite(values).all() else None


def told(plan: SimulationPlan, log: SimulationLog, folder: str) -> str:
    """What the command prints."""
    force = np.linalg.norm(np.array(log.force_n), axis=1)
    least, most = min(log.volume_ml) / log.volume_ml[0] - 1, max(log.volume_ml) / log.volume_ml[0] - 1
    lines = [
        f"{plan.organ.name}, {plan.scene.bodies[0].tissue.name}: {len(log.time_s) - 1} steps, {log.time_s[-1]:.2f} s",
        f"force on the tool up to {force.max():.2f} N, at the end {force[-1]:.2f} N",
        f"volume {100 * least:+.2f} % to {100 * most:+.2f} %, smallest det F {min(log.min_det_f):.2f}, "
        f"deepest penetration {max(log.deepest_mm):.2f} mm",
    ]
    lines += [f"warning: {notice.message}" for notice in notices_of(plan, log)]
    lines.append(f"pictures: {Path(folder) / STRIP}")
    return "\n".join(lines)
