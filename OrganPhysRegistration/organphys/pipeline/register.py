"""One registration from point sets to a registered organ with its metrics and warnings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..ground.progress import Progress, no_progress
from ..points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ, SceneUnit
from .registration import RegisterOptions, Registration
from .session import RegistrationSession
from .stages import STAGES


def register(
    organ: Organ,
    splat: GaussianCloud,
    options: RegisterOptions | None = None,
    *,
    landmarks: Landmarks | None = None,
    camera: Camera | None = None,
    box: Box | None = None,
    unit: SceneUnit | None = None,
    provenance: Mapping[str, Any] | None = None,
    progress: Progress = no_progress,
) -> Registration:
    """Register ``organ`` (RAS mm) onto ``splat`` (raw scene units).

    ``box``: crop of the splat; ``unit``: millimetres per scene unit if known; ``provenance``: facts of the inputs that
    go into the asset. Same seed, same result. InputError tells what is wrong with the input; nothing is written.
    """
    session = RegistrationSession(
        organ, splat, options, landmarks=landmarks, camera=camera, box=box, unit=unit, provenance=provenance,
        progress=progress,
    )  # fmt: skip
    for stage in STAGES:
        session.advance(stage, progress)
    return session.registration
