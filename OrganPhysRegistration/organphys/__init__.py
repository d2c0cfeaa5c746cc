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
    from .ground.checks import InputError
    from .ground.frames import Similarity
    from .ground.progress import Cancelled
    from .pipeline.register import register
    from .pipeline.registration import RegisterOptions, Registration
    from .pipeline.sample_case import write_sample_case
    from .pipeline.session import RegistrationSession
    from .pipeline.write_outputs import write_outputs
    from .points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ, SceneUnit
    from .readers.gaussian_ply import read_splat
    from .readers.landmarks_file import read_landmarks
    from .readers.organ_from_mask import organ_from_mask
    from .readers.roi_file import read_box
    from .readers.segmentation_file import read_organ

_HOME = {
    "Box": "points.point_sets",
    "Camera": "points.point_sets",
    "Cancelled": "ground.progress",
    "GaussianCloud": "points.point_sets",
    "InputError": "ground.checks",
    "Landmarks": "points.point_sets",
    "Organ": "points.point_sets",
    "RegisterOptions": "pipeline.registration",
    "RegisteredOrgan": "asset.registered_organ",
    "Registration": "pipeline.registration",
    "RegistrationSession": "pipeline.session",
    "SceneUnit": "points.point_sets",
    "Similarity": "ground.frames",
    "load_asset": "asset.asset_file",
    "organ_from_mask": "readers.organ_from_mask",
    "read_box": "readers.roi_file",
    "read_landmarks": "readers.landmarks_file",
    "read_organ": "readers.segmentation_file",
    "read_splat": "readers.gaussian_ply",
    "register": "pipeline.register",
    "save_asset": "asset.asset_file",
    "write_outputs": "pipeline.write_outputs",
    "write_sample_case": "pipeline.sample_case",
}

__all__ = [
    "Box",
    "Camera",
    "Cancelled",
    "GaussianCloud",
    "InputError",
    "Landmarks",
    "Organ",
    "RegisterOptions",
    "RegisteredOrgan",
    "Registration",
    "RegistrationSession",
    "SceneUnit",
    "Similarity",
    "load_asset",
    "organ_from_mask",
    "read_box",
    "read_landmarks",
    "read_organ",
    "read_splat",
    "register",
    "save_asset",
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
