"""The files of one simulation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..exports.animation import write_animation
from ..exports.picture_sheet import write_picture_sheet
from ..exports.recording_file import save_recording
from ..exports.simulation_tables import write_forces, write_states
from ..exports.trajectory_file import write_trajectory
from ..ground.atomic_file import write_text
from ..ground.notices import Notice
from ..ground.plain_json import dump
from ..simulation.organ_body import metres_per_unit
from ..simulation.pins import AnyPin, Pin
from ..simulation.psm_trajectory import tip_trajectory
from ..simulation.session import Recording
from .simulation_plan import SimulationPlan
from .simulation_run import SimulationLog
from .simulation_view import SimulationView

RECORDING, STATES, FORCES, SUMMARY, STRIP = "recording.npz", "states.npz", "forces.csv", "summary.json", "strip.png"
TRAJECTORY = "trajectory.csv"  # as the instrument went, to edit and drive it by


def write_simulation(
    folder: Path,
    plan: SimulationPlan,
    log: SimulationLog,
    recording: Recording,
    view: SimulationView,
    video: str | None,
) -> None:
    """All files into an existing folder; ``video``: "webp", "gif" or "png", None for none."""
    body = plan.scene.bodies[0]
    forces: dict[str, Sequence[object]] = {
        "time_s": log.time_s,
        "force_n": log.force_n,
        "torque_nm": log.torque_nm,
        "volume_ml": log.volume_ml,
    }
    more: dict[str, Sequence[object]] = {
        "min_det_f": log.min_det_f,
        "deepest_mm": log.deepest_mm,
        "contacts": log.contacts,
        "held": log.held,
    }
    write_forces(folder / FORCES, {**forces, "jaw_deg": [pose.jaw_deg for pose in log.poses], **more})
    write_states(folder / STATES, body, metres_per_unit(plan.organ), {**forces, "z_m": log.z}, log.poses)
    jaw_length = plan.psm.instrument.jaw_length
    write_trajectory(folder / TRAJECTORY, tip_trajectory(log.time_s, log.poses, jaw_length))
    save_recording(folder / RECORDING, recording)
    write_picture_sheet(folder / STRIP, view.rows)
    if video is not None:
        write_animation(folder / f"video.{video}", view.video, fps=view.video_fps, format=video)
    write_text(folder / SUMMARY, dump(summary(plan, log)))


def notices_of(plan: SimulationPlan, log: SimulationLog) -> Sequence[Notice]:
    """What was known before and what came up on the way."""
    return (*plan.notices, *log.notices)


def _told(pin: AnyPin) -> dict[str, Any]:
    told: dict[str, Any] = {"centre_m": pin.centre, "stiffness_n_m": pin.stiffness}
    if isinstance(pin, Pin):
        return told | {"radius_m": pin.radius}
    return told | {"sides_m": pin.sides, "axes": pin.axes}


def summary(plan: SimulationPlan, log: SimulationLog) -> dict[str, Any]:
    """What summary.json says: every number with its unit in its name."""
    body = plan.scene.bodies[0]
    force = np.linalg.norm(np.array(log.force_n), axis=1)
    return {
        "organphys": __version__,
        "organ": plan.organ.name,
        "tissue": {
            "name": body.tissue.name,
            "youngs_pa": body.tissue.youngs_pa,
            "nu": body.tissue.nu,
            "density_kg_m3": body.tissue.density,
            "source": body.tissue.source,
        },
        "instrument": plan.psm.instrument.name,
        "trocar_m": plan.psm.rcm,
        "pins": [_told(pin) for pin in body.pins],
        "gravity_m_s2": plan.scene.options.gravity,
        "steps": len(log.time_s) - 1,
        "dt_s": plan.dt,
        "largest_force_n": force.max(),
        "volume_ml": {"start": log.volume_ml[0], "least": min(log.volume_ml), "most": max(log.volume_ml)},
        "min_det_f": min(log.min_det_f),
        "deepest_mm": max(log.deepest_mm),
        "warnings": [{"code": notice.code, "message": notice.message} for notice in notices_of(plan, log)],
    }
