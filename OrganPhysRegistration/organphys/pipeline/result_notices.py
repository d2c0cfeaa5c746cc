"""What the finished result itself says against trusting it; the same for every method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.notices import Notice, plain_number

SEEN_WITHIN = 0.1  # of the organ's rms radius: a vertex this near to the splat and facing the camera counts as seen
LITTLE_SEEN = 0.15
MOVED_FAR = 0.1  # of the organ's rms radius
ENDOSCOPE_MM = (15.0, 400.0)
VOLUME_ML = {
    "liver": (400, 4000), "spleen": (30, 1500), "kidney": (40, 500), "pancreas": (15, 250),
    "prostate": (8, 250), "gallbladder": (3, 250),
}  # fmt: skip
ANY_VOLUME_ML = (1, 6000)


@dataclass(frozen=True)
class SurfaceState:
    """Registered organ surface: points (N, 3) and normals (N, 3) in the scene; displacement_mm (N,) beyond the
    similarity; distance_mm (N,) to the splat; radius_mm: the organ's rms radius; det_f (Q,) at quadrature points."""

    points: Array
    normals: Array
    displacement_mm: Array
    distance_mm: Array
    radius_mm: float
    det_f: Array

    def seen(self, camera_position: Array) -> NDArray[np.bool_]:
        """(N,) bool: faces the camera and lies on the splat."""
        facing = np.einsum("ij,ij->i", self.normals, camera_position - self.points) > 0
        seen: NDArray[np.bool_] = facing & (self.distance_mm < SEEN_WITHIN * self.radius_mm)
        return seen


def result_notices(
    state: SurfaceState, camera_position: Array, *, name: str, volume_ml: float, mm_per_unit: float
) -> tuple[Notice, ...]:
    """Warnings about visibility, sizes, folding and hidden tissue."""
    seen = state.seen(camera_position)
    found = [
        _little_seen(float(seen.mean())),
        _volume(name, volume_ml),
        _working_distance(state.points, camera_position, mm_per_unit),
        _folding(state.det_f),
        _hidden_motion(state.displacement_mm, seen, state.radius_mm),
    ]
    return tuple(notice for notice in found if notice is not None)


def _little_seen(fraction: float) -> Notice | None:
    if fraction >= LITTLE_SEEN:
        return None
    return Notice(
        "little_seen",
        f"Only about {100 * fraction:.0f} % of the organ's surface is seen in the splat (under "
        f"{100 * LITTLE_SEEN:.0f} %): the rest is a guess of the elastic model.",
    )


def _volume(name: str, volume_ml: float) -> Notice | None:
    known = next((v for organ, v in VOLUME_ML.items() if organ in name.lower()), ANY_VOLUME_ML)
    if known[0] <= volume_ml <= known[1]:
        return None
    return Notice(
        "implausible_volume",
        f"The organ measures {plain_number(volume_ml)} ml in the CT, outside the plausible {known[0]} to "
        f"{known[1]} ml: check the label and the spacing of the CT.",
    )


def _working_distance(points: Array, camera_position: Array, mm_per_unit: float) -> Notice | None:
    nearest = float(np.linalg.norm(points - camera_position, axis=1).min()) * mm_per_unit
    if ENDOSCOPE_MM[0] <= nearest <= ENDOSCOPE_MM[1]:
        return None
    return Notice(
        "implausible_scale",
        f"At the registered scale the organ begins {plain_number(nearest)} mm from the camera; endoscopes work at "
        f"{ENDOSCOPE_MM[0]:.0f} to {ENDOSCOPE_MM[1]:.0f} mm. Check the camera position and the scale.",
    )


def _folding(det_f: Array) -> Notice | None:
    folded = int((det_f <= 0).sum())
    if not folded:
        return None
    return Notice(
        "folded",
        f"The organ is turned inside out at {folded} of {len(det_f)} points (det F <= 0): do not use this result; "
        "try a stiffer preset.",
    )


def _hidden_motion(displacement_mm: Array, seen: NDArray[np.bool_], radius_mm: float) -> Notice | None:
    hidden = float(np.percentile(displacement_mm[~seen], 95)) if (~seen).any() else 0.0
    visible = float(np.percentile(displacement_mm[seen], 95)) if seen.any() else 0.0
    if hidden <= MOVED_FAR * radius_mm or hidden <= 1.5 * visible:
        return None
    return Notice(
        "hidden_tissue_moved",
        f"Tissue without data moved far: {hidden:.0f} mm (95th percentile) beyond the similarity where nothing was "
        f"seen, against {visible:.0f} mm where it was. Do not trust the hidden side.",
    )
