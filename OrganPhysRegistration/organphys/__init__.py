"""OrganPhys: a CT organ brought into an endoscopic Gaussian splat, rigidly and elastically.

The names below are imported when they are first used: ``import organphys`` loads no reader and no solver.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from .asset.asset_file import load_asset, save_asset
    from .asset.registered_organ import RegisteredOrgan
    from .exports.gaussian_ply import write_gaussians
    from .exports.recording_file import load_recording, save_recording
    from .ground.checks import InputError
    from .ground.frames import Similarity
    from .ground.progress import Cancelled
    from .pipeline.register import register
    from .pipeline.registration import RegisterOptions, Registration
    from .pipeline.sample_case import write_sample_case
    from .pipeline.session import RegistrationSession
    from .pipeline.write_outputs import write_outputs
    from .points.gaussians import Gaussians
    from .points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ, SceneUnit
    from .readers.gaussian_ply import read_gaussians, read_splat
    from .readers.landmark_pairs import read_landmark_pairs
    from .readers.landmarks_file import read_landmarks
    from .readers.organ_from_mask import organ_from_mask
    from .readers.roi_file import read_box
    from .readers.segmentation_file import read_organ
    from .simulation.local_detail import LocalDetail
    from .simulation.moved_splat import moved_splat
    from .simulation.options import SimulationOptions, gravity_along
    from .simulation.organ_body import metres_per_unit, organ_body, scene_direction
    from .simulation.pins import Pin
    from .simulation.scene import Scene
    from .simulation.session import Simulation, replay
    from .simulation.splat_binding import bind_splat
    from .simulation.state import ToolPose
    from .simulation.tools import Jaws, gripper, probe

_HOME = {
    "Box": "points.point_sets",
    "Camera": "points.point_sets",
    "Cancelled": "ground.progress",
    "GaussianCloud": "points.point_sets",
    "Gaussians": "points.gaussians",
    "InputError": "ground.checks",
    "Jaws": "simulation.tools",
    "Landmarks": "points.point_sets",
    "LocalDetail": "simulation.local_detail",
    "Organ": "points.point_sets",
    "Pin": "simulation.pins",
    "RegisterOptions": "pipeline.registration",
    "RegisteredOrgan": "asset.registered_organ",
    "Registration": "pipeline.registration",
    "RegistrationSession": "pipeline.session",
    "Scene": "simulation.scene",
    "SceneUnit": "points.point_sets",
    "Similarity": "ground.frames",
    "Simulation": "simulation.session",
    "SimulationOptions": "simulation.options",
    "ToolPose": "simulation.state",
    "bind_splat": "simulation.splat_binding",
    "gravity_along": "simulation.options",
    "gripper": "simulation.tools",
    "load_asset": "asset.asset_file",
    "load_recording": "exports.recording_file",
    "metres_per_unit": "simulation.organ_body",
    "moved_splat": "simulation.moved_splat",
    "organ_body": "simulation.organ_body",
    "organ_from_mask": "readers.organ_from_mask",
    "probe": "simulation.tools",
    "read_box": "readers.roi_file",
    "read_gaussians": "readers.gaussian_ply",
    "read_landmark_pairs": "readers.landmark_pairs",
    "read_landmarks": "readers.landmarks_file",
    "read_organ": "readers.segmentation_file",
    "read_splat": "readers.gaussian_ply",
    "register": "pipeline.register",
    "replay": "simulation.session",
    "save_asset": "asset.asset_file",
    "save_recording": "exports.recording_file",
    "scene_direction": "simulation.organ_body",
    "write_gaussians": "exports.gaussian_ply",
    "write_outputs": "pipeline.write_outputs",
    "write_sample_case": "pipeline.sample_case",
}

__all__ = [
    "Box",
    "Camera",
    "Cancelled",
    "GaussianCloud",
    "Gaussians",
    "InputError",
    "Jaws",
    "Landmarks",
    "LocalDetail",
    "Organ",
    "Pin",
    "RegisterOptions",
    "RegisteredOrgan",
    "Registration",
    "RegistrationSession",
    "Scene",
    "SceneUnit",
    "Similarity",
    "Simulation",
    "SimulationOptions",
    "ToolPose",
    "bind_splat",
    "gravity_along",
    "gripper",
    "load_asset",
    "load_recording",
    "metres_per_unit",
    "moved_splat",
    "organ_body",
    "organ_from_mask",
    "probe",
    "read_box",
    "read_gaussians",
    "read_landmark_pairs",
    "read_landmarks",
    "read_organ",
    "read_splat",
    "register",
    "replay",
    "save_asset",
    "save_recording",
    "scene_direction",
    "write_gaussians",
    "write_outputs",
    "write_sample_case",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
