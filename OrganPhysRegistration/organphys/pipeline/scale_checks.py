"""The splat's unit: as a prior of the registration, and against what the registration itself finds."""

from __future__ import annotations

import math

import numpy as np

from ..elastic.joint_scale import ScalePrior
from ..ground.frames import Similarity
from ..ground.notices import Notice, plain_number
from ..points.point_sets import SceneUnit
from ..points.surface_samples import SurfaceSamples

DISAGREES = 1.15  # ratio of scales beyond the error of a short elastic fit without the unit (8 %, dev cases)
SWELLING = 1.0  # percent: an organ's own size (blood, pressure of the gas) and the splat's depth vary by as much
NEARLY_EXACT = 2.0  # percent: a unit as good as this fixes the scale of the start search


def plausible_scales(expected: float, percent: float) -> tuple[float, float]:
    """Range of start scales: three standard deviations of the unit and the 10 % error of a rigid start."""
    factor = float(np.exp(0.03 * percent + 0.1))
    return expected / factor, expected * factor


def unit_scale(unit: SceneUnit | None, samples: SurfaceSamples) -> float | None:
    """Scene units per normalised length that the stated unit implies."""
    return None if unit is None else samples.normalisation.length / unit.mm_per_unit


def scale_prior(start: Similarity, expected: float | None, unit: SceneUnit | None) -> ScalePrior:
    """Prior of the joint scale for a starting pose T_camera_normalised."""
    if unit is None or expected is None:
        return ScalePrior()
    return ScalePrior.of(start.scale / expected, scale_percent(unit))


def scale_percent(unit: SceneUnit) -> float:
    """Standard deviation, in percent, of the organ's registered size about what the stated unit makes of its CT: even
    an exact unit leaves ``SWELLING``."""
    return math.hypot(unit.percent, SWELLING)


def unit_notices(free_scale: float, samples: SurfaceSamples, unit: SceneUnit | None) -> tuple[Notice, ...]:
    """Whether the scale found without the unit contradicts the stated one."""
    expected = unit_scale(unit, samples)
    if unit is None or expected is None or abs(np.log(free_scale / expected)) < np.log(DISAGREES):
        return ()
    found = samples.normalisation.length / free_scale
    return (
        Notice(
            "scale_disagrees",
            f"The stated unit, {unit.mm_per_unit:g} mm per scene unit, disagrees with the organ's size in the splat: "
            f"the fit without it finds {plain_number(found)} mm per unit. "
            "Check the unit of the splat and the CT's spacing.",
        ),
    )
